//! Sphere maps: the ball, cut out of the camera frame, as light by normals in view space.
//!
//! The texels are written into the buffer of the strongest light, because a `StandardMaterial` with a shadow dome and
//! an environment map leaves no texture binding free within WebGPU's limits.

use crate::{
    camera::{CameraFrame, FramePixels},
    materials::style::{ClassicModel, ClassicStyle, SurfaceStyle},
    probe::{BallView, ProbeMeasurement, ProbeView, gain_limits},
};
use bevy::{prelude::*, render::extract_resource::ExtractResource};
use std::sync::Arc;

/// Edge lengths of the map of mirrored and of diffuse light, in texels, as in `sphere_map.wgsl`.
const MIRROR_EDGE: usize = 32;
const DIFFUSE_EDGE: usize = 16;
/// Number of texels of both maps.
pub(in crate::materials) const TEXELS: usize = MIRROR_EDGE * MIRROR_EDGE + DIFFUSE_EDGE * DIFFUSE_EDGE;
/// Samples of the frame along the edge of a texel.
const SAMPLES: usize = 2;

/// Both maps: mirrored light, then diffuse light, row by row from the top; linear camera units.
#[derive(Resource, ExtractResource, Clone, Default)]
pub(in crate::materials) struct SphereMap {
    /// Empty until a ball is seen.
    pub(in crate::materials) texels: Arc<[Vec4]>,
    /// Camera and number of the frame that the maps show.
    pub(in crate::materials) frame: Option<(Entity, u64)>,
}

/// Cuts the ball out of a new frame while surfaces ask for it.
pub(super) fn crop_sphere_map(
    styles: Query<&SurfaceStyle>,
    balls: Query<&ProbeMeasurement>,
    frames: Query<&CameraFrame>,
    mut map: ResMut<SphereMap>,
) {
    let is_wanted = |style: &SurfaceStyle| {
        matches!(style, SurfaceStyle::Classic(ClassicStyle { model: ClassicModel::SphereMap(_), .. }))
    };
    if !styles.iter().any(is_wanted) {
        return;
    }
    let seen = balls.iter().filter(|ball| ball.is_in_view).find_map(|ball| {
        let view = ball.view?;
        Some((view, frames.get(view.camera).ok()?))
    });
    let Some((view, frame)) = seen.filter(|(view, frame)| map.frame != Some((view.camera, frame.sequence))) else {
        return;
    };
    if let Some(mirrored) = mirrored_map(&frame.pixels, &view) {
        let texels = mirrored.iter().copied().chain(diffuse_map(&mirrored)).map(|light| light.extend(0.0));
        *map = SphereMap { texels: texels.collect(), frame: Some((view.camera, frame.sequence)) };
    }
}

/// Place −1…1 of a texel in its map, to the right and up.
fn place_of(texel: usize, edge: usize) -> Vec2 {
    let place = (Vec2::new((texel % edge) as f32, (texel / edge) as f32) + 0.5) * (2.0 / edge as f32) - 1.0;
    Vec2::new(place.x, -place.y)
}

/// Light that the ball shows at each normal. `None` if there is no ball before the camera. Normals at the rim, and
/// those that are none, show what the outermost usable ones do.
fn mirrored_map(pixels: &FramePixels, view: &ProbeView) -> Option<Vec<Vec3>> {
    let ball = BallView::new(view.center_camera, view.radius)?;
    let axis = -view.center_camera.normalize();
    let right = Vec3::Y.cross(axis).normalize_or(Vec3::X);
    let up = axis.cross(right);
    let rim = ball.normal_angle(view.edge_angle).sin();
    let light_at = |place: Vec2| {
        let side = place.clamp_length_max(rim);
        let normal = right * side.x + up * side.y + axis * (1.0 - side.length_squared()).max(0.0).sqrt();
        let point = view.center_camera + view.radius * normal;
        let pixel = view.center + view.focal * Vec2::new(point.x, -point.y) / -point.z;
        let seen = pixels.linear(pixel.x.floor() as i32, pixel.y.floor() as i32);
        let from_above = point.normalize().reflect(normal).dot(view.up_camera).max(0.0);
        seen * clip_gain(seen, 1.0 + (view.gain - 1.0) * from_above) / view.reflectance
    };
    let count = SAMPLES * SAMPLES;
    let light_of = |texel: usize| {
        let middle = place_of(texel, MIRROR_EDGE);
        let samples = (0..count).map(|i| light_at(middle + place_of(i, SAMPLES) / MIRROR_EDGE as f32));
        samples.sum::<Vec3>() / count as f32
    };
    let light = |texel| view.uniform_radiance.unwrap_or_else(|| light_of(texel));
    Some((0..MIRROR_EDGE * MIRROR_EDGE).map(light).collect())
}

/// Gain of a pixel, which only clipped channels have.
fn clip_gain(seen: Vec3, gain: Vec3) -> Vec3 {
    let limits = gain_limits(seen);
    Vec3::from_array([0, 1, 2].map(|c| limits[c].map_or(1.0, |limit| gain[c].min(limit))))
}

/// Normal at a place of a map, with the view along z; `None` outside of the disk.
fn normal_at(place: Vec2) -> Option<Vec3> {
    let height = 1.0 - place.length_squared();
    (height > 0.0).then(|| place.extend(height.sqrt()))
}

/// Direction that a normal mirrors the view into.
fn mirrored(normal: Vec3) -> Vec3 {
    2.0 * normal.z * normal - Vec3::Z
}

/// What white paper facing the direction that each normal mirrors shows. Equal areas of the map are equal solid angles,
/// for a ball that is far away.
fn diffuse_map(mirror: &[Vec3]) -> impl Iterator<Item = Vec3> {
    let lights: Vec<(Vec3, Vec3)> = mirror
        .iter()
        .enumerate()
        .filter_map(|(i, light)| Some((mirrored(normal_at(place_of(i, MIRROR_EDGE))?), *light)))
        .collect();
    (0..DIFFUSE_EDGE * DIFFUSE_EDGE).map(move |i| {
        let place = place_of(i, DIFFUSE_EDGE);
        // The rim of the map is behind the ball.
        let facing = mirrored(normal_at(place.clamp_length_max(0.999)).unwrap_or(Vec3::Z));
        let weighted = lights.iter().map(|(dir, light)| (facing.dot(*dir).max(0.0), *light));
        let (sum, weights) = weighted
            .fold((Vec3::ZERO, 0.0), |(sum, weights), (weight, light)| (sum + weight * light, weights + weight));
        sum / f32::max(weights, f32::MIN_POSITIVE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diffuse_light_is_the_cosine_sum_of_what_the_ball_shows() {
        let slope = Vec3::new(0.3, -0.4, 0.5);
        let radiance = |dir: Vec3| 1.0 + dir.dot(slope);
        let count = MIRROR_EDGE * MIRROR_EDGE;
        let mirror: Vec<Vec3> = (0..count)
            .map(|i| normal_at(place_of(i, MIRROR_EDGE)).map_or(Vec3::ZERO, |n| Vec3::splat(radiance(mirrored(n)))))
            .collect();
        for (i, light) in diffuse_map(&mirror).enumerate() {
            let Some(normal) = normal_at(place_of(i, DIFFUSE_EDGE)) else { continue };
            // The cosine sum of a slope is two thirds of it.
            let expected = 1.0 + mirrored(normal).dot(slope) * 2.0 / 3.0;
            assert!((light.x - expected).abs() < 0.02, "{normal}: {light}, expected {expected}");
        }
    }

    #[test]
    fn only_clipped_channels_have_a_gain() {
        let gain = Vec3::new(9.0, 8.0, 7.0);
        assert_eq!(clip_gain(Vec3::splat(0.9), gain), Vec3::ONE);
        assert_eq!(clip_gain(Vec3::ONE, gain), gain);
        let red = clip_gain(Vec3::new(1.0, 0.5, 0.1), gain);
        assert!(red.x > 1.0 && red.yz() == Vec2::ONE, "{red}");
    }

    #[test]
    fn the_map_shows_each_normal_where_the_frame_does() {
        let size = UVec2::splat(400);
        let center_camera = Vec3::new(0.1, -0.05, -1.0);
        let (radius, focal, center) = (0.3, Vec2::splat(400.0), Vec2::splat(200.0));
        // Red to the right and green upwards, by the place on the ball.
        let axis = -center_camera.normalize();
        let right = Vec3::Y.cross(axis).normalize();
        let up = axis.cross(right);
        let mut rgba = vec![0; 4 * size.element_product() as usize];
        for (i, pixel) in rgba.chunks_exact_mut(4).enumerate() {
            let at = (Vec2::new((i % 400) as f32, (i / 400) as f32) + 0.5 - center) / focal;
            let ray = Vec3::new(at.x, -at.y, -1.0).normalize();
            let ball = BallView { center_camera, radius };
            let Some(dir) = ball.mirrored_direction(ray) else { continue };
            let normal = (dir - ray).normalize();
            pixel[0] = (127.5 + 127.5 * normal.dot(right)) as u8;
            pixel[1] = (127.5 + 127.5 * normal.dot(up)) as u8;
        }
        let pixels = FramePixels::new(size, rgba).expect("as many bytes");
        let edge_angle = 2.6;
        let view = ProbeView {
            camera: Entity::PLACEHOLDER,
            camera_from_world: Mat3::IDENTITY,
            center_camera,
            radius,
            reflectance: 0.5,
            edge_angle,
            focal,
            center,
            gain: Vec3::ONE,
            up_camera: Vec3::Y,
            uniform_radiance: None,
        };
        let map = mirrored_map(&pixels, &view).expect("a ball");
        let decoded = |place: f32| 2.0 * crate::camera::srgb_to_linear((127.5 + 127.5 * place) as u8);
        for (i, light) in map.iter().enumerate() {
            let place = place_of(i, MIRROR_EDGE);
            if place.length() < 0.85 {
                let expected = Vec2::new(decoded(place.x), decoded(place.y));
                assert!(light.xy().distance(expected) < 0.04, "{place}: {light}, expected {expected}");
            }
        }
        let even = ProbeView { uniform_radiance: Some(Vec3::X), ..view };
        assert!(mirrored_map(&pixels, &even).is_some_and(|map| map.iter().all(|light| *light == Vec3::X)));
        assert!(mirrored_map(&pixels, &ProbeView { center_camera: Vec3::Z, ..view }).is_none());
        let white = FramePixels::new(size, vec![255; 4 * 400 * 400]).expect("as many bytes");
        let bright = mirrored_map(&white, &ProbeView { gain: Vec3::splat(3.0), ..view }).expect("a ball");
        // The upper half of the ball mirrors what is above it, the lower half what is below.
        let column = |row: usize| bright[row * MIRROR_EDGE + MIRROR_EDGE / 2].x;
        assert!(column(4) > 5.0 && column(28) == 2.0, "{} and {}", column(4), column(28));
    }
}
