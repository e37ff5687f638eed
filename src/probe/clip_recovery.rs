//! Recovery of clipped light: the gain of a ball's clipped pixels, from the brightness of the marker's paper.

use super::{
    ball_points::BallPoints,
    ball_view::{BallView, EDGE_MARGIN_PIXELS},
    clipping::gain_limits,
};
use crate::{camera::PosedFrame, environment_map::cube_directions};
use bevy::prelude::*;
use std::f32::consts::PI;

/// Recovery of light that the camera clipped, on the entity of a [`LightProbeSphere`](super::LightProbeSphere).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::{ClipEvidence, ClipRecovery}};
/// fn setup(mut commands: Commands) {
///     // nothing but the marker's paper tells how bright lamps are
///     let recovery = ClipRecovery { evidence: ClipEvidence::Paper, ..default() };
///     commands.spawn((LightProbeSphere::default(), recovery, Transform::from_xyz(0.17, 0.05, 0.01)));
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct ClipRecovery {
    /// Whether clipped light is recovered; if not, it counts as white. Defaults to `true`.
    pub is_enabled: bool,
    /// Reflectance of the marker's white paper, 0…1 (exclusive of 0). Defaults to 0.80, common office paper.
    pub paper_reflectance: f32,
    /// Upper bound of the gain. Defaults to 1000.
    pub max_gain: f32,
    /// Evidence for the brightness of clipped light. Defaults to [`ClipEvidence::Desk`].
    pub evidence: ClipEvidence,
}

/// Evidence for the brightness of clipped light.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ClipEvidence {
    /// The marker's paper, which gives one gain for all clipped light.
    Paper,
    /// Everything that stands on the desk: the paper, the desk's brightness in and beside the shadows of phantoms and
    /// the ball, and the faces of phantoms. Each clipped region of the environment gets its own gain; see
    /// [`lighting`](crate::lighting). Without phantoms in view the same as [`Paper`](Self::Paper).
    #[default]
    Desk,
}

impl Default for ClipRecovery {
    fn default() -> Self {
        Self { is_enabled: true, paper_reflectance: 0.80, max_gain: 1000.0, evidence: ClipEvidence::Desk }
    }
}

/// Number of directions along each edge of the cube over which irradiance is summed (1.4° each, as fine as a ball 80
/// pixels wide).
const CUBE_EDGE: u32 = 64;

/// Irradiance ÷ π at a surface as a function of the gain of clipped pixels, for one channel.
#[derive(Clone, Debug, Default, PartialEq)]
struct Irradiance {
    /// Value at gain 1, where clipped light counts as white.
    as_seen: f32,
    /// Clipped contributions, sorted: the gain at which each stops growing, and its slope per unit of gain.
    clipped: Vec<(f32, f32)>,
}

impl Irradiance {
    /// Gain at which the irradiance has the value wanted, between 1 and `max_gain`.
    ///
    /// The irradiance is a piecewise linear, concave function of the gain; the search walks its pieces.
    fn gain_for(&self, wanted: f32, max_gain: f32) -> f32 {
        let first_slope: f32 = self.clipped.iter().map(|(_, part)| part).sum();
        let mut slope = first_slope;
        let mut reached = self.as_seen;
        let mut gain = 1.0;
        for &(limit, part) in &self.clipped {
            if reached >= wanted || limit >= max_gain {
                break;
            }
            let at_limit = reached + slope * (limit - gain);
            if at_limit >= wanted {
                break;
            }
            (reached, gain, slope) = (at_limit, limit, slope - part);
        }
        if reached >= wanted {
            return gain;
        }
        // The slope that remains after the subtractions may be rounding error; then no gain would be enough.
        if slope > 1e-5 * first_slope { (gain + (wanted - reached) / slope).min(max_gain) } else { gain }
    }
}

/// Inputs of the recovery: a frame with a ball and the marker's paper in it.
pub(super) struct PaperAndBall<'a> {
    pub(super) posed: PosedFrame<'a>,
    pub(super) ball: &'a BallView,
    /// Fraction of the light that the ball mirrors.
    pub(super) reflectance: f32,
    /// Normal of the paper, camera space.
    pub(super) normal_camera: Vec3,
}

impl PaperAndBall<'_> {
    /// Gain of clipped light, per channel, at which the ball explains the radiance of the paper.
    pub(super) fn gain(&self, paper: Vec3, recovery: &ClipRecovery) -> Vec3 {
        let wanted = paper / recovery.paper_reflectance;
        let channels = self.irradiance();
        Vec3::from_array(std::array::from_fn(|c| channels[c].gain_for(wanted[c], recovery.max_gain)))
    }

    /// Cosine-weighted sum of the radiance that the ball shows, over the hemisphere about the paper's normal.
    fn irradiance(&self) -> [Irradiance; 3] {
        let edge_angle = self.ball.edge_angle(&self.posed.intrinsics, EDGE_MARGIN_PIXELS);
        let points = BallPoints::new(self.ball, edge_angle);
        let mut channels = [const { Irradiance { as_seen: 0.0, clipped: Vec::new() } }; 3];
        for (dir_world, solid_angle) in cube_directions(CUBE_EDGE) {
            let dir_camera = self.posed.camera_from_world.transform_vector3(dir_world);
            let cosine = self.normal_camera.dot(dir_camera);
            if cosine <= 0.0 {
                continue;
            }
            let weight = cosine * solid_angle / (PI * self.reflectance);
            if let Some(pixel) = self.posed.intrinsics.project(points.surface_point(dir_camera)) {
                self.add_bilinear(&mut channels, pixel, weight, cosine);
            }
        }
        for channel in &mut channels {
            channel.clipped.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        channels
    }

    fn add_bilinear(&self, channels: &mut [Irradiance; 3], pixel: Vec2, weight: f32, cosine: f32) {
        for (pixel_weight, value) in self.posed.bilinear(pixel) {
            let limits = gain_limits(value);
            for (c, channel) in channels.iter_mut().enumerate() {
                let part = weight * pixel_weight * value[c];
                channel.as_seen += part;
                if let Some(limit) = limits[c] {
                    // The shader multiplies the pixel by 1 + (gain − 1) · cosine.
                    channel.clipped.push((1.0 + (limit - 1.0) / cosine, part * cosine));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{FramePixels, Intrinsics, srgb_to_linear};
    use bevy::math::Affine3A;

    #[test]
    fn the_gain_explains_the_paper() {
        let lamp = Irradiance { as_seen: 0.3, clipped: vec![(f32::INFINITY, 0.1)] };
        assert!((lamp.gain_for(1.0, 1000.0) - 8.0).abs() < 1e-5);
        assert_eq!(lamp.gain_for(0.25, 1000.0), 1.0, "the paper is darker than the ball says");
        assert_eq!(lamp.gain_for(1e6, 1000.0), 1000.0);
        let nothing_clipped = Irradiance { as_seen: 0.2, clipped: vec![] };
        assert_eq!(nothing_clipped.gain_for(1.0, 1000.0), 1.0);
        // Up to gain 2 both contributions grow (to 0.2 + 0.4), from there only the lamp.
        let wall_and_lamp = Irradiance { as_seen: 0.4, clipped: vec![(2.0, 0.1), (f32::INFINITY, 0.1)] };
        assert!((wall_and_lamp.gain_for(0.8, 1000.0) - 4.0).abs() < 1e-5);
    }

    #[test]
    fn a_gray_room_lights_a_surface_with_its_own_radiance() {
        let size = UVec2::new(200, 200);
        let frame = FramePixels::new(size, [188, 188, 188, 255].repeat(40_000)).expect("fits");
        let ball = BallView::new(Vec3::new(0.0, 0.0, -0.5), 0.05).expect("in front");
        let view = PaperAndBall {
            posed: PosedFrame {
                frame: &frame,
                intrinsics: Intrinsics::from_horizontal_fov(size, 0.4),
                camera_from_world: Affine3A::IDENTITY,
                exposure: 1.0,
            },
            ball: &ball,
            reflectance: 0.5,
            normal_camera: Vec3::Y,
        };
        for channel in view.irradiance() {
            assert!((channel.as_seen - 2.0 * srgb_to_linear(188)).abs() < 2e-3, "{}", channel.as_seen);
            assert!(channel.clipped.is_empty());
        }
    }
}
