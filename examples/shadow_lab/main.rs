//! Toy cars in a corner of two walls, under a sky with a lamp that can be dragged, in the shadows of one method or
//! another. A panel has the methods and all settings of the shadow dome.
//!
//! `cargo run --features egui --example shadow_lab`, or without a window
//! ```text
//! cargo run --features egui --example shadow_lab -- \
//!     --headless --frames 8 --out shadow_lab --directions 64 --filter gauss
//! ```
//! `--method soft-planar` begins with another method than the dome, and `--gallery FILE.png` draws all of them into one
//! picture, with the cost and the error of each.
//!
//! Everything is virtual: there is no marker, no ball and no camera. In such a scene Freiling (2006) compared shadows.

mod gallery;
mod light;
mod method;
mod options;
mod panel;
mod picture;
mod scene;
#[path = "../support/mod.rs"]
mod support;

use bevy::{app::AppExit, core_pipeline::tonemapping::Tonemapping, diagnostic::FrameTimeDiagnosticsPlugin, prelude::*};
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass};
use bevy_mirrorball::{
    materials::MaterialsPlugin,
    phantom::PhantomPlugin,
    prefilter::PrefilterPlugin,
    shadows::{ShadowDomeLight, ShadowsPlugin},
};
use bevy_picking::{DefaultPickingPlugins, mesh_picking::MeshPickingPlugin};
use light::{Lamp, light_up};
use method::{Method, Shadows, choose_method};
use options::Options;
use picture::Picture;
use support::{Outcome, window_log};

/// What can be changed while it runs.
#[derive(Resource, Clone, Debug, PartialEq)]
struct Lab {
    lamp: Lamp,
    method: Method,
    dome: ShadowDomeLight,
    /// Seconds since the cars have started, and the speed at which this time passes.
    time: f32,
    speed: f32,
}

impl Lab {
    fn new(method: Method, dome: &ShadowDomeLight) -> Self {
        Self { lamp: Lamp::default(), method, dome: dome.clone(), time: 0.0, speed: 1.0 }
    }
}

fn main() -> Outcome<AppExit> {
    let options = Options::from_command_line()?;
    if let Some(file) = &options.gallery {
        gallery::draw(&options, file)?;
        return Ok(AppExit::Success);
    }
    if options.is_headless {
        draw_to_files(&options)?;
        return Ok(AppExit::Success);
    }
    let mut app = App::new();
    app.add_plugins((DefaultPlugins.set(window_log()), EguiPlugin::default(), FrameTimeDiagnosticsPlugin::default()))
        .add_plugins((DefaultPickingPlugins, MeshPickingPlugin))
        .add_systems(Startup, light::spawn_ball)
        .add_systems(Update, light::move_ball)
        .add_systems(EguiPrimaryContextPass, panel::draw_panel);
    build(&mut app, Lab::new(options.method, &options.dome));
    app.world_mut().spawn(camera());
    let advance = |time: Res<Time>, mut lab: ResMut<Lab>| {
        let step = time.delta_secs() * lab.speed;
        lab.time += step;
    };
    app.add_systems(Update, advance.before(scene::drive));
    Ok(app.run())
}

fn draw_to_files(options: &Options) -> Outcome<()> {
    std::fs::create_dir_all(&options.out)?;
    let mut picture = Picture::new(Lab::new(options.method, &options.dome), options.size)?;
    for frame in 0..options.frames {
        let bytes = picture.draw_next()?;
        let file = options.out.join(format!("frame_{frame:04}.png"));
        image::save_buffer(&file, &bytes, options.size.x, options.size.y, image::ExtendedColorType::Rgba8)?;
    }
    println!("shadow_lab: {} pictures in {}", options.frames, options.out.display());
    Ok(())
}

fn camera() -> impl Bundle {
    (
        Camera3d::default(),
        Tonemapping::None,
        Transform::from_xyz(2.0, 1.9, 2.6).looking_at(Vec3::new(-0.15, 0.15, -0.1), Vec3::Y),
        AmbientLight { brightness: 0.0, ..default() },
    )
}

fn build(app: &mut App, lab: Lab) {
    app.add_plugins((PhantomPlugin, PrefilterPlugin, ShadowsPlugin, MaterialsPlugin))
        .insert_resource(lab)
        .insert_resource(ClearColor(Color::srgb(0.62, 0.68, 0.75)))
        .add_systems(Update, (scene::drive, choose_method, light_up));
    app.world_mut().spawn(Shadows);
    scene::spawn_scene(app.world_mut());
}
