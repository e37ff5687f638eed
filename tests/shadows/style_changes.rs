//! Changes of styles on all kinds of models, many of them, and white surfaces in a white furnace.

use crate::studio::{Picture, Studio, checkers, normals, on_a_bone};
use bevy::{
    mesh::morph::{MeshMorphWeights, MorphAttributes},
    prelude::*,
};
use bevy_mirrorball::{
    materials::{ClassicMaterial, ImageBasedMaterial, OutlineMaterial, ToonMaterial},
    prelude::*,
};

const GRAY: f32 = 0.5;

fn small_ball() -> Mesh {
    Sphere::new(0.15).mesh().ico(8).expect("few enough")
}

/// A ball on a bone, one that morphs, and a masked box.
struct Models {
    studio: Studio,
    bone: Entity,
    models: [Entity; 3],
    frame: u32,
}

impl Models {
    fn new() -> Option<Self> {
        let mut studio = Studio::new(SurfaceStyle::ImageBased)?;
        studio.add_sky(Vec3::new(0.6, 0.64, 0.48), Vec3::splat(0.1), Vec3::new(0.9, 0.7, 0.5));
        studio.app.world_mut().spawn(ShadowDomeLight { directions: 8, resolution: 32, ..default() });
        studio.app.world_mut().despawn(studio.ball);
        let models = [
            studio.add(on_a_bone(small_ball()), Color::WHITE, Transform::from_xyz(-0.35, 0.2, 0.0)),
            studio.add(morphing_ball(), Color::WHITE, Transform::from_xyz(0.3, 0.25, 0.0)),
            studio.add(Cuboid::from_length(0.3), Color::WHITE, Transform::from_xyz(0.0, -0.3, 0.0)),
        ];
        let checkers = studio
            .app
            .world_mut()
            .resource_mut::<Assets<Image>>()
            .add(checkers([255, 200, 100, 0], [255, 200, 100, 255]));
        let masked = StandardMaterial {
            base_color_texture: Some(checkers),
            alpha_mode: AlphaMode::Mask(0.5),
            ..Color::WHITE.into()
        };
        let world = studio.app.world_mut();
        let masked = world.resource_mut::<Assets<StandardMaterial>>().add(masked);
        world.entity_mut(models[2]).insert(MeshMaterial3d(masked));
        let (bone, skin) = studio.add_bone(Transform::default());
        studio.app.world_mut().entity_mut(models[0]).insert(skin);
        Some(Self { studio, bone, models, frame: 0 })
    }

    /// Moves everything one frame on.
    fn animate(&mut self) {
        self.frame += 1;
        let phase = 0.4 * self.frame as f32;
        let world = self.studio.app.world_mut();
        world.entity_mut(self.bone).insert(Transform::from_xyz(-0.3, 0.2 + 0.1 * phase.sin(), 0.0));
        let weights = MeshMorphWeights::Value { weights: vec![0.5 + 0.5 * phase.cos()] };
        world.entity_mut(self.models[1]).insert(weights);
        self.studio.app.update();
    }

    fn set_style(&mut self, style: SurfaceStyle) {
        for model in self.models {
            self.studio.app.world_mut().entity_mut(model).insert(style);
        }
    }

    fn shoot(&mut self) -> Picture {
        self.studio.shoot()
    }
}

fn morphing_ball() -> Mesh {
    let mut ball = small_ball();
    let raised = MorphAttributes::from([Vec3::new(0.0, 0.15, 0.0), Vec3::ZERO, Vec3::ZERO]);
    ball.set_morph_targets(vec![raised; ball.count_vertices()]);
    ball
}

#[test]
fn models_that_changed_their_styles_look_as_if_they_never_had() {
    let (Some(mut changed), Some(mut kept)) = (Models::new(), Models::new()) else { return };
    // The caches of the dome fill, and the models are in their first poses.
    for models in [&mut kept, &mut changed] {
        for _ in 0..8 {
            models.animate();
        }
    }
    let first = kept.shoot();
    assert_eq!(changed.shoot().difference(&first), 0);
    let styles = [SurfaceStyle::Toon(default()), SurfaceStyle::Classic(default()), SurfaceStyle::ImageBased];
    for style in styles {
        changed.set_style(style);
        for models in [&mut kept, &mut changed] {
            for _ in 0..8 {
                models.animate();
            }
        }
        let difference = changed.shoot().difference(&kept.shoot());
        println!("{style:?}: {difference}");
        assert_eq!(difference > 10, style != SurfaceStyle::ImageBased);
        assert!(difference > 10 || difference == 0);
    }
    assert!(kept.shoot().difference(&first) > 20, "and they have moved");
}

/// Numbers in a fixed order that look random (Marsaglia 2003, xorshift).
struct Random(u32);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0 as usize % end
    }
}

/// Numbers of all assets that styles are made of.
fn asset_counts(app: &App) -> [usize; 7] {
    let world = app.world();
    [
        world.resource::<Assets<StandardMaterial>>().len(),
        world.resource::<Assets<ImageBasedMaterial>>().len(),
        world.resource::<Assets<ToonMaterial>>().len(),
        world.resource::<Assets<ClassicMaterial>>().len(),
        world.resource::<Assets<OutlineMaterial>>().len(),
        world.resource::<Assets<Image>>().len(),
        world.resource::<Assets<Mesh>>().len(),
    ]
}

#[test]
fn a_thousand_random_changes_leak_no_asset() {
    const CHANGES: usize = 1000;
    const CHANGES_PER_FRAME: usize = 4;
    let Some(Models { mut studio, models, .. }) = Models::new() else { return };
    let world = studio.app.world_mut();
    let material = world.get::<MeshMaterial3d<StandardMaterial>>(models[2]).expect("as added").clone();
    let mesh = world.get::<Mesh3d>(models[2]).expect("as added").clone();
    let boxes = (0..5).map(|i| {
        let place = Transform::from_xyz(0.2 * i as f32 - 0.4, 0.0, 0.0).with_scale(Vec3::splat(0.3));
        world.spawn((mesh.clone(), material.clone(), place)).id()
    });
    let boxes: Vec<Entity> = boxes.collect();
    let all: Vec<Entity> = models.into_iter().chain(boxes).collect();
    let mut random = Random(1);
    // Hulls of outlines are kept as long as their meshes.
    for entity in &all {
        studio.app.world_mut().entity_mut(*entity).insert(SurfaceStyle::Toon(default()));
    }
    studio.shoot();
    let reset = |studio: &mut Studio| {
        for entity in &all {
            studio.app.world_mut().entity_mut(*entity).insert((SurfaceStyle::ImageBased, MeasuredLightWeight(1.0)));
        }
        studio.shoot();
        studio.shoot();
        (asset_counts(&studio.app), studio.app.world().entities().count_spawned())
    };
    let before = reset(&mut studio);
    let mut most = [0; 7];
    for _ in 0..CHANGES / CHANGES_PER_FRAME {
        for _ in 0..CHANGES_PER_FRAME {
            let number = random.below(100) as f32;
            let style = match random.below(4) {
                0 => SurfaceStyle::ImageBased,
                1 => SurfaceStyle::Toon(ToonStyle { rim: 0.01 * number, outline_width: 0.1 * number, ..default() }),
                2 => SurfaceStyle::Classic(ClassicStyle { fresnel: Some(0.01 * number), ..default() }),
                _ => SurfaceStyle::Engine,
            };
            let weight = MeasuredLightWeight(0.25 * random.below(5) as f32);
            studio.app.world_mut().entity_mut(all[random.below(all.len())]).insert((style, weight));
        }
        studio.app.update();
        let counts = asset_counts(&studio.app);
        most = std::array::from_fn(|i| most[i].max(counts[i]));
    }
    println!("before {before:?}, at most {most:?}");
    assert!(most[1..5].iter().all(|most| *most > 1), "all kinds of materials were there");
    // A material of each thing, and of those that were replaced in this frame and the last.
    assert!(most[1..5].iter().all(|most| *most <= all.len() + 2 * CHANGES_PER_FRAME));
    assert_eq!(reset(&mut studio), before);
}

#[test]
fn white_surfaces_are_invisible_in_a_white_furnace_at_any_roughness() {
    const TOLERANCE: f32 = 0.02;
    // A step of the 8-bit picture.
    const STEP: f32 = 0.005;
    for has_dome in [false, true] {
        let Some(mut studio) = Studio::new(SurfaceStyle::ImageBased) else { return };
        studio.add_sky(Vec3::Y, Vec3::splat(GRAY), Vec3::splat(GRAY));
        if has_dome {
            studio.app.world_mut().spawn(ShadowDomeLight { directions: 16, resolution: 64, ..default() });
        }
        for (metallic, roughness) in [0.0, 1.0].into_iter().flat_map(|m| [0.0, 0.3, 0.6, 1.0].map(|r| (m, r))) {
            let white =
                StandardMaterial { base_color: Color::WHITE, metallic, perceptual_roughness: roughness, ..default() };
            studio.set_ball(white, SurfaceStyle::ImageBased);
            let picture = studio.shoot();
            let worst = normals().map(|(pixel, _)| (picture.linear(pixel) / GRAY - 1.0).abs().max_element());
            let worst = worst.fold(0.0, f32::max);
            println!("dome {has_dome}, metallic {metallic}, roughness {roughness}: off by {:.1} %", 100.0 * worst);
            assert!(worst <= TOLERANCE + STEP);
        }
    }
}
