//! Ways to look up and to filter the light of a ball side by side, as Supan (2006, section 4.2) compared them: sphere
//! map and cube map, a blur of the ball's image and a filter on the sphere of directions.

use crate::{
    desk::STILL,
    gallery::Studio,
    look::Look,
    sheet::Sheet,
    support::{Outcome, asset_path},
};
use bevy::prelude::*;
use bevy_mirrorball::{camera::FramePixels, prelude::*, probe::Ellipse};
use image::{RgbImage, Rgba32FImage, imageops};

/// Exponent of the lobe with which the last two pictures are filtered.
const EXPONENT: f32 = 50.0;
/// Corners of the part of the picture that is shown, as fractions of its size: ball and teapot.
const PART: [Vec2; 2] = [Vec2::new(0.0, 0.27), Vec2::new(0.47, 0.80)];
const NAMES: [&str; 4] = ["sphere map", "cube map", "blurred image", "spherical filter"];

/// Draws the four pictures. The ball in the last two shows its filtered light, too.
pub(crate) fn draw(studio: &mut Studio) -> Outcome<RgbImage> {
    let mut sheet = Sheet::new(studio.size, PART, 2, NAMES.len() as u32);
    for (i, name) in (0..).zip(NAMES) {
        match name {
            "sphere map" => studio.show(&classic(ClassicModel::SphereMap(SPHERE_MAP), 0.0)),
            "cube map" => {
                let SphereMapModel { diffuse, mirror } = SPHERE_MAP;
                let model = CombinedModel { diffuse, reflection: mirror, specular: 0.0, ..default() };
                studio.show(&classic(ClassicModel::Combined(model), 0.0));
            }
            "blurred image" => {
                let sharp = FramePixels::open(asset_path(STILL))?;
                let blurred = blur_ball(&sharp, &outline(studio)?)?;
                film(studio, blurred)?;
                studio.show(&classic(MIRROR, 0.0));
            }
            _ => {
                film(studio, FramePixels::open(asset_path(STILL))?)?;
                let look = classic(MIRROR, SpecularLobe::perceptual_roughness(EXPONENT));
                studio.show(&look);
                cover_ball(studio, &look)?;
            }
        }
        sheet.add(i, "", name, &studio.draw()?);
    }
    Ok(sheet.picture)
}

const SPHERE_MAP: SphereMapModel = SphereMapModel { diffuse: 1.0, mirror: 0.3 };
const MIRROR: ClassicModel = ClassicModel::Mixed(MixedModel { base: 0.0, diffuse: 0.0, mirror: 1.0 });

fn classic(model: ClassicModel, roughness: f32) -> Look {
    let style = ClassicStyle { model, roughness: Some(roughness), ..default() };
    Look { style: SurfaceStyle::Classic(style), ..default() }
}

/// Shows the camera another frame of the same place, whose light is filtered with lobes of cosⁿ.
fn film(studio: &mut Studio, frame: FramePixels) -> Outcome<()> {
    let world = studio.app.world_mut();
    let camera = world.query_filtered::<Entity, With<ArCamera>>().single(world)?;
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    world.entity_mut(camera).insert(feed);
    let mut environments = world.query::<&mut LiveEnvironment>();
    environments.get_mut(world, camera)?.lobe = SpecularLobe::Cosine;
    Ok(())
}

fn outline(studio: &mut Studio) -> Outcome<Ellipse> {
    let world = studio.app.world_mut();
    Ok(world.query::<&ProbeMeasurement>().single(world)?.outline)
}

/// Blurs a ball in a frame, without its surroundings, about as widely as the lobe is in the middle of the ball: at a
/// fraction x of its radius, a ball mirrors what is at an angle of 2 · asin x to the camera. Towards the outline, the
/// same blur is ever wider.
fn blur_ball(frame: &FramePixels, outline: &Ellipse) -> Outcome<FramePixels> {
    let (width, height) = frame.size.into();
    let is_inside = |x, y| outline.contains(Vec2::new(x as f32, y as f32) + 0.5);
    let ball = Rgba32FImage::from_fn(width, height, |x, y| {
        let inside = f32::from(is_inside(x, y));
        let light = frame.linear(x as i32, y as i32) * inside;
        image::Rgba([light.x, light.y, light.z, inside])
    });
    // A lobe of cosⁿ is about as wide as a Gaussian of 1 ÷ √n radians in each of two axes.
    let sigma = 0.5 * outline.semi_axes.y / EXPONENT.sqrt();
    let blurred = imageops::blur(&ball, sigma);
    let mut rgba = frame.rgba.clone();
    for (pixel, (x, y, light)) in rgba.chunks_exact_mut(4).zip(blurred.enumerate_pixels()) {
        if is_inside(x, y) {
            let [red, green, blue, weight] = light.0;
            let color = Color::linear_rgb(red / weight, green / weight, blue / weight);
            pixel[..3].copy_from_slice(&color.to_srgba().to_u8_array_no_alpha());
        }
    }
    FramePixels::new(frame.size, rgba).ok_or_else(|| "the frame has the wrong size".into())
}

/// Puts a virtual ball over the real one, in the same look.
fn cover_ball(studio: &mut Studio, look: &Look) -> Outcome<()> {
    let world = studio.app.world_mut();
    let (ball, place) = world.query::<(&LightProbeSphere, &GlobalTransform)>().single(world)?;
    // Larger by less than a pixel, so that the real one is behind it.
    let (mesh, place) = (Sphere::new(1.005 * ball.radius), place.compute_transform());
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh.mesh().uv(64, 32));
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place, look.style));
    Ok(())
}
