//! Desk parallax: the environment as seen from the position of an object on the desk.

use super::filtered_environment::FilteredEnvironment;
use bevy::prelude::*;

/// Parallax correction of a [`LiveEnvironment`](super::LiveEnvironment) for the position of this entity. Put both
/// components on a [`LightProbe`].
///
/// An environment is correct only at its point of capture, the ball. The desk is near, so an object beside the ball
/// reflects another part of it. Directions that meet the desk are therefore looked up in the direction in which that
/// point of the desk was captured; all other directions count as far away. Things that stand on the desk are
/// flattened onto it.
///
/// Bevy's own parallax correction treats the room as a box around the probe, whose center has to be the point of
/// capture. For a ball on a desk that box would be as low as the ball, so switch Bevy's correction off on such probes
/// (`ParallaxCorrection::None`), as [`DeskParallax`] requires by default.
///
/// The maps are made for one position: each probe with this component costs one more filter, which runs again when
/// the probe moves.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_mirrorball::prefilter::{DeskParallax, LiveEnvironment};
///
/// fn beside_the_ball(mut commands: Commands, cube: Handle<Image>, ball: Vec3) {
///     commands.spawn((
///         LightProbe::default(),
///         LiveEnvironment::new(cube),
///         DeskParallax { captured_from: ball, height: 0.0 },
///         Transform::from_xyz(0.3, 0.1, 0.0).with_scale(Vec3::splat(0.2)),
///     ));
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(bevy::light::ParallaxCorrection::None)]
pub struct DeskParallax {
    /// Point of capture, the center of the ball, in world space, in meters. It has to be above the desk.
    /// Defaults to the origin, which is not: without another one, nothing is corrected.
    pub captured_from: Vec3,
    /// Height of the desk: world y in meters. Probes below it use the environment without correction.
    /// Defaults to 0.
    pub height: f32,
}

/// Minimum movement in meters for which the maps are made again.
const MIN_MOVEMENT: f32 = 1e-4;

impl DeskParallax {
    /// Eye relative to the point of capture; w: the desk's height relative to it. Zeros leave directions unchanged.
    pub(super) fn viewpoint(&self, eye: Vec3) -> Vec4 {
        let (eye, height) = (eye - self.captured_from, self.height - self.captured_from.y);
        let is_above = height < 0.0 && eye.y > height && eye.is_finite();
        if is_above { eye.extend(height) } else { Vec4::ZERO }
    }
}

/// Direction in which the point that is seen in a direction was captured. Twin of `captured_direction` in
/// `resample.wgsl`.
#[cfg(test)]
fn captured_direction(dir_world: Vec3, viewpoint: Vec4) -> Vec3 {
    let (eye, height) = (viewpoint.truncate(), viewpoint.w);
    let down = (-dir_world.y).max(0.0);
    (dir_world * (eye.y - height) + eye * down).try_normalize().unwrap_or(dir_world)
}

type Viewer = (&'static DeskParallax, &'static GlobalTransform, &'static mut FilteredEnvironment);

pub(super) fn update_viewpoints(mut viewers: Query<Viewer>) {
    for (parallax, place, mut maps) in &mut viewers {
        let viewpoint = parallax.viewpoint(place.translation());
        if maps.viewpoint.is_none_or(|old| old.distance(viewpoint) > MIN_MOVEMENT) {
            maps.viewpoint = Some(viewpoint);
            maps.request_refresh();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_desk_is_where_it_is_and_the_sky_stays() {
        let ball = Vec3::new(0.2, 0.05, 0.0);
        let viewpoint = DeskParallax { captured_from: ball, height: 0.0 }.viewpoint(Vec3::new(0.5, 0.1, 0.3));
        // Straight down from the eye is the point below it, as seen from the ball.
        let expected = (Vec3::new(0.5, 0.0, 0.3) - ball).normalize();
        assert!(captured_direction(Vec3::NEG_Y, viewpoint).distance(expected) < 1e-6);
        let up = Vec3::new(0.6, 0.8, 0.0);
        assert!(captured_direction(up, viewpoint).distance(up) < 1e-6);
        let level = Vec3::new(1.0, -1e-6, 0.0).normalize();
        assert!(captured_direction(level, viewpoint).distance(level) < 1e-4, "no step at the horizon");
    }

    #[test]
    fn from_below_the_desk_and_from_the_ball_itself_nothing_changes() {
        let parallax = DeskParallax { captured_from: Vec3::new(0.2, 0.05, 0.0), height: 0.0 };
        assert_eq!(parallax.viewpoint(Vec3::new(0.0, -0.1, 0.0)), Vec4::ZERO);
        let viewpoint = parallax.viewpoint(parallax.captured_from);
        let down = Vec3::new(0.6, -0.8, 0.0);
        assert!(captured_direction(down, viewpoint).distance(down) < 1e-6);
    }
}
