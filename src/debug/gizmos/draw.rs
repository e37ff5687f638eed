//! Systems that draw the gizmos of each stage.

use super::MirrorballGizmos;
use crate::{
    camera::ArCamera,
    lighting::RealLight,
    phantom::StageRole,
    probe::{LightProbeSphere, ProbeMeasurement},
    shadows::{DomeRay, DomeRays},
    tracking::{MarkerAnchor, MarkerBoard, MarkerState, MarkerTracking},
};
use bevy::{
    camera::primitives::Aabb,
    color::palettes::css::{AQUA, DARK_GRAY, GRAY, LIME, MAGENTA, ORANGE_RED, WHITE, YELLOW},
    gizmos::gizmos::Gizmos,
    prelude::*,
};
use std::f32::consts::FRAC_PI_2;

/// Shortest arrow of a light, and what the arrow of a light that gives all light has more, in radii of the ball.
const ARROW: (f32, f32) = (1.0, 6.0);
/// Gap between a ball and the arrows that point at it, in radii.
const ARROW_GAP: f32 = 0.2;
/// Height of labels as a fraction of their distance from the camera.
const LABEL_HEIGHT: f32 = 0.025;
/// Radius of a dome without casters, in meters.
const EMPTY_DOME: f32 = 0.25;
/// Where the lines of a dome begin and end, in radii of the sphere around all casters.
const DOME_LINE: [f32; 2] = [1.1, 1.25];

type Lines<'w, 's> = Gizmos<'w, 's, MirrorballGizmos>;

type Anchor =
    (&'static MarkerAnchor, Option<&'static MarkerBoard>, Option<&'static MarkerTracking>, &'static GlobalTransform);

pub(super) fn markers(mut lines: Lines, anchors: Query<Anchor>) {
    if !lines.config_ext.markers {
        return;
    }
    for (anchor, board, tracking, transform) in &anchors {
        let color = match tracking.map(|tracking| tracking.state).unwrap_or_default() {
            MarkerState::Searching => GRAY,
            MarkerState::Tracked => LIME,
            MarkerState::Held => YELLOW,
            MarkerState::Lost => ORANGE_RED,
        };
        let world_from_anchor = transform.to_isometry();
        square(&mut lines, world_from_anchor, anchor.size, color);
        lines.axes(world_from_anchor, 0.5 * anchor.size);
        for marker in board.into_iter().flat_map(|board| &board.markers) {
            // Of a board, only the markers that the pose rests on have its color.
            let is_used = tracking.is_some_and(|tracking| tracking.markers.contains(&marker.marker()));
            square(&mut lines, world_from_anchor * marker.place, marker.size, if is_used { color } else { GRAY });
        }
    }
}

/// The square of a marker, in the plane of its paper.
fn square(lines: &mut Lines, world_from_marker: Isometry3d, size: f32, color: Srgba) {
    let paper_from_plane = Quat::from_rotation_x(-FRAC_PI_2);
    lines.rect(world_from_marker * Isometry3d::from_rotation(paper_from_plane), Vec2::splat(size), color);
}

type Ball = (&'static LightProbeSphere, &'static ProbeMeasurement, &'static GlobalTransform);

pub(super) fn balls(mut lines: Lines, balls: Query<Ball>, cameras: Query<(&Camera, &GlobalTransform), With<ArCamera>>) {
    if !lines.config_ext.balls {
        return;
    }
    for (_, camera) in cameras.iter().filter(|(camera, _)| camera.is_active) {
        for (ball, measurement, transform) in &balls {
            let color = if measurement.is_in_view { AQUA } else { GRAY };
            if let Some((circle, radius)) = outline(camera.translation(), transform.translation(), ball.radius) {
                lines.circle(circle, radius, color).resolution(96);
            }
        }
    }
}

/// The circle in which the lines of sight touch a sphere, and its radius. `None` from within the sphere.
fn outline(eye: Vec3, center: Vec3, radius: f32) -> Option<(Isometry3d, f32)> {
    let (towards_eye, distance) = (eye - center).normalize_and_length();
    let sine = radius / distance;
    let is_outside = sine.is_finite() && sine < 1.0;
    is_outside.then(|| {
        let rotation = Quat::from_rotation_arc(Vec3::Z, towards_eye);
        (Isometry3d::new(center + towards_eye * (radius * sine), rotation), radius * (1.0 - sine * sine).sqrt())
    })
}

pub(super) fn lights(
    mut lines: Lines,
    lights: Query<&RealLight>,
    balls: Query<(&LightProbeSphere, &GlobalTransform)>,
    cameras: Query<(&Camera, &GlobalTransform), With<ArCamera>>,
) {
    if !lines.config_ext.lights {
        return;
    }
    // Lights are seen from the first bright ball, as they are measured.
    let ball = balls.iter().find(|(ball, _)| !ball.is_dark()).or_else(|| balls.iter().next());
    let (radius, center) = ball.map_or((0.05, Vec3::ZERO), |(ball, transform)| (ball.radius, transform.translation()));
    let camera = cameras.iter().find(|(camera, _)| camera.is_active).map(|(_, transform)| transform);
    for light in &lights {
        let length = radius * (ARROW.0 + ARROW.1 * light.fraction.clamp(0.0, 1.0));
        let tip = center + light.direction * radius * (1.0 + ARROW_GAP);
        let start = tip + light.direction * length;
        lines.arrow(start, tip, light.color).with_tip_length(0.25 * radius);
        if let Some(position) = light.position {
            lines.sphere(position, position.distance(center) * light.angular_radius.tan().max(0.01), light.color);
        }
        if let Some(camera) = camera {
            let height = LABEL_HEIGHT * camera.translation().distance(start);
            let label = Isometry3d::new(start, camera.rotation());
            let text = format!("{}: {:.0} %", light.id, 100.0 * light.fraction);
            lines.text(label, &text, height, Vec2::new(-0.5, 0.0), light.color);
        }
    }
}

pub(super) fn dome(mut lines: Lines, rays: DomeRays) {
    if !lines.config_ext.dome {
        return;
    }
    let (center, radius) = rays.casters().unwrap_or((Vec3::ZERO, EMPTY_DOME));
    let [from, to] = DOME_LINE.map(|place| place * radius);
    for DomeRay { direction, brightness, is_key } in rays.iter() {
        let color = match brightness {
            _ if is_key => LinearRgba::from(WHITE),
            Some(brightness) => heat(brightness),
            None => LinearRgba::from(DARK_GRAY),
        };
        lines.line(center + direction * from, center + direction * to, color);
    }
}

/// Color of a number in 0…1: blue, red, yellow.
fn heat(brightness: f32) -> LinearRgba {
    let brightness = brightness.clamp(0.0, 1.0);
    LinearRgba::rgb((2.0 * brightness).min(1.0), (2.0 * brightness - 1.0).max(0.0), (1.0 - 2.0 * brightness).max(0.0))
}

pub(super) fn phantoms(mut lines: Lines, meshes: Query<(&StageRole, &Aabb, &GlobalTransform)>) {
    if !lines.config_ext.phantoms {
        return;
    }
    for (role, bounds, transform) in &meshes {
        if matches!(role, StageRole::Phantom(_)) {
            lines.aabb_3d(*bounds, *transform, MAGENTA);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_is_where_lines_of_sight_touch_the_sphere() {
        let (eye, center, radius) = (Vec3::new(0.3, 0.4, 0.5), Vec3::new(0.1, 0.05, -0.2), 0.05);
        let (circle, size) = outline(eye, center, radius).expect("outside of the sphere");
        for i in 0..8 {
            let (sin, cos) = (i as f32 * 0.7).sin_cos();
            let point: Vec3 = circle.transform_point(Vec3::new(size * cos, size * sin, 0.0)).into();
            assert!((point.distance(center) - radius).abs() < 1e-6, "on the sphere");
            assert!((eye - point).normalize().dot((point - center) / radius).abs() < 1e-4, "seen from the side");
        }
        assert!(outline(center + Vec3::X * 0.04, center, radius).is_none());
        assert!(outline(center, center, radius).is_none());
    }

    #[test]
    fn heat_goes_from_blue_over_red_to_yellow() {
        assert_eq!(heat(-1.0), LinearRgba::rgb(0.0, 0.0, 1.0));
        assert_eq!(heat(0.5), LinearRgba::rgb(1.0, 0.0, 0.0));
        assert_eq!(heat(1.0), LinearRgba::rgb(1.0, 1.0, 0.0));
    }
}
