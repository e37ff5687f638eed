//! Lights above a receiver, and points on them.

use super::planar_shadow::{PlanarLight, PlanarLightPlace, PlanarLights, PlanarShadow};
use crate::lighting::RealLight;
use bevy::prelude::*;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// Sine of the elevation below which a light only grazes the receiver: its shadows would be twenty times as long as
/// things are high, and its share is small.
const MIN_SINE: f32 = 0.05;
/// Largest angular radius in radians.
const MAX_ANGULAR_RADIUS: f32 = 1.0;

/// A light in the frame of reference of a receiver, which lies in y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LocalLight {
    /// Position and 1, or unit direction and 0.
    pub(super) center: Vec4,
    /// Radius of its disc: in meters of a near light, as a tangent of a distant one.
    pub(super) radius: f32,
    /// Tangent of its angular radius.
    pub(super) tangent_radius: f32,
    pub(super) share: LightShare,
    /// Directions of the environment map whose light it is: their middle, and the cosine of their radius.
    pub(super) cone: Vec4,
}

/// How much of all light on the receiver a light gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LightShare {
    /// Per channel.
    Known(Vec3),
    /// The irradiance of the receiver, per channel, which is to be divided by all of it.
    Irradiance(Vec3),
    /// What other lights leave, which have known shares.
    RestOfKnown(Vec3),
    /// What other lights leave, which give so much irradiance.
    RestOfIrradiance(Vec3),
}

impl LightShare {
    /// Returns the share that lights leave. All of them are known, or none is.
    pub(super) fn rest(lights: &[LocalLight], knows_environment: bool) -> Self {
        let of_lights = lights.iter().map(|light| match light.share {
            Self::Known(share) | Self::Irradiance(share) => share,
            Self::RestOfKnown(_) | Self::RestOfIrradiance(_) => Vec3::ZERO,
        });
        if knows_environment { Self::RestOfIrradiance(of_lights.sum()) } else { Self::RestOfKnown(of_lights.sum()) }
    }

    /// Whether it is known that nothing is left.
    pub(super) fn is_nothing(&self) -> bool {
        matches!(self, Self::RestOfKnown(known) if known.cmpge(Vec3::ONE).all())
    }

    pub(super) fn is_rest(&self) -> bool {
        matches!(self, Self::RestOfKnown(_) | Self::RestOfIrradiance(_))
    }
}

/// Cone that holds no direction.
const NO_CONE: Vec4 = Vec4::new(0.0, 0.0, 0.0, 2.0);
/// Radius of a light's cone in angular radii of the light, and how much wider it is because the map blurs the light, in
/// radians.
const CONE_RADII: f32 = 1.25;
const CONE_MARGIN: f32 = 0.08;

/// Returns the lights that shine on a receiver.
pub(super) fn lights_above<'l>(
    wanted: &PlanarLights,
    real: impl Iterator<Item = &'l RealLight>,
    local_from_world: &Isometry3d,
    knows_environment: bool,
) -> Vec<LocalLight> {
    let place = |place: PlanarLightPlace| match place {
        PlanarLightPlace::Direction(direction) => (local_from_world.rotation * *direction).extend(0.0),
        PlanarLightPlace::Point(position) => Vec3::from(local_from_world.transform_point(position)).extend(1.0),
    };
    match wanted {
        PlanarLights::Placed(lights) => lights
            .iter()
            .take(PlanarLights::MAX as usize)
            .filter_map(|PlanarLight { place: at, angular_radius, share }| {
                let share = share.to_vec4().truncate();
                let share = if share.is_finite() { share.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO };
                LocalLight::new(place(*at), *angular_radius, LightShare::Known(share))
            })
            .collect(),
        PlanarLights::Real(count) => {
            let mut found: Vec<_> = real
                .filter_map(|light| {
                    let at = light.position.map_or_else(
                        || Some(PlanarLightPlace::Direction(Dir3::new(light.direction).ok()?)),
                        |position| Some(PlanarLightPlace::Point(position)),
                    )?;
                    let sine = (local_from_world.rotation * light.direction).y.max(0.0);
                    let color = light.color.to_vec4().truncate();
                    let irradiance = light.irradiance * sine * color;
                    let share = if knows_environment {
                        LightShare::Irradiance(irradiance)
                    } else {
                        LightShare::Known(light.fraction.clamp(0.0, 1.0) * color)
                    };
                    let found = LocalLight::new(place(at), light.angular_radius, share)?;
                    let radius = CONE_RADII * light.angular_radius.clamp(0.0, MAX_ANGULAR_RADIUS) + CONE_MARGIN;
                    let cone = (local_from_world.rotation * light.direction).extend(radius.cos());
                    Some((irradiance.max_element(), LocalLight { cone, ..found }))
                })
                .collect();
            found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
            found.into_iter().take((*count).min(PlanarLights::MAX) as usize).map(|(_, light)| light).collect()
        }
    }
}

impl LocalLight {
    /// `None` for a light that is not above the receiver, whose points would have no shadows or mirrored ones.
    fn new(center: Vec4, angular_radius: f32, share: LightShare) -> Option<Self> {
        let distance = if center.w > 0.0 { center.truncate().length() } else { 1.0 };
        if !center.is_finite() || center.y <= MIN_SINE * distance {
            return None;
        }
        let angular_radius = if angular_radius.is_finite() { angular_radius } else { 0.0 };
        let tangent_radius = angular_radius.clamp(0.0, MAX_ANGULAR_RADIUS).tan();
        Some(Self { center, radius: tangent_radius * distance, tangent_radius, share, cone: NO_CONE })
    }

    /// Returns points on its disc: one, or as many as a square grid has. They are the same for the same number: one in
    /// each cell of the grid, moved within it by a fixed pattern.
    pub(super) fn points(&self, samples: u32) -> Vec<Vec4> {
        let edge = samples.clamp(1, PlanarShadow::MAX_SAMPLES).isqrt();
        if edge == 1 || self.radius <= 0.0 {
            return vec![self.center];
        }
        let towards = match self.center.w {
            0.0 => self.center.truncate(),
            _ => self.center.truncate().normalize_or(Vec3::Y),
        };
        let (right, up) = towards.any_orthonormal_pair();
        let cells = (0..edge).flat_map(|row| (0..edge).map(move |column| UVec2::new(column, row)));
        let points = cells.zip(1..).map(|(cell, number)| {
            let within = jitter(number);
            let on_disc = self.radius * disc_from_square(2.0 * (cell.as_vec2() + within) / edge as f32 - 1.0);
            self.center + (on_disc.x * right + on_disc.y * up).extend(0.0)
        });
        // The edge of a wide light may be below the receiver's horizon.
        let lowest = MIN_SINE * 0.5 * if self.center.w > 0.0 { self.center.y } else { 1.0 };
        points.map(|point| Vec4::new(point.x, point.y.max(lowest), point.z, point.w)).collect()
    }
}

/// A position within a cell: Roberts 2018, the additive recurrence R2.
fn jitter(number: u32) -> Vec2 {
    (Vec2::splat(0.5) + number as f32 * Vec2::new(0.754_877_7, 0.569_840_3)).fract()
}

/// Maps the square −1…1 to the unit disc so that areas keep their proportions (Shirley and Chiu 1997).
fn disc_from_square(square: Vec2) -> Vec2 {
    if square == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if square.x.abs() > square.y.abs() {
        (square.x, FRAC_PI_4 * square.y / square.x)
    } else {
        (square.y, FRAC_PI_2 - FRAC_PI_4 * square.x / square.y)
    };
    radius * Vec2::from_angle(angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn above(light: PlanarLight) -> Vec<LocalLight> {
        lights_above(&PlanarLights::Placed(vec![light]), [].iter(), &Isometry3d::IDENTITY, false)
    }

    #[test]
    fn only_lights_above_the_receiver_count() {
        for (y, count) in [(1.0, 1), (0.01, 0), (-1.0, 0)] {
            assert_eq!(above(PlanarLight::point(Vec3::new(1.0, y, 0.0), 0.1)).len(), count, "at {y}");
            let direction = Dir3::new(Vec3::new(1.0, y, 0.0)).expect("not zero");
            assert_eq!(above(PlanarLight::distant(direction, 0.1)).len(), count, "from {y}");
        }
        let lost = PlanarLight::point(Vec3::NAN, f32::NAN).with_share(LinearRgba::gray(f32::NAN));
        assert!(above(lost).is_empty());
    }

    #[test]
    fn points_fill_the_disc_evenly_and_are_always_the_same() {
        let light = above(PlanarLight::distant(Dir3::Y, 0.2))[0];
        let points = light.points(25);
        assert!(points.len() == 25 && points == light.points(30));
        let tangent = 0.2_f32.tan();
        let off: Vec<f32> = points.iter().map(|point| (point - light.center).length() / tangent).collect();
        assert!(off.iter().all(|off| *off <= 1.0), "{off:?}");
        // of a disc: half of the mean square
        let mean_square = off.iter().map(|off| off * off).sum::<f32>() / 25.0;
        assert!((mean_square - 0.5).abs() < 0.05, "{mean_square}");
        assert!((points.iter().sum::<Vec4>() / 25.0 - light.center).length() < 0.1 * tangent);
        assert_eq!(light.points(1), [light.center]);
    }

    #[test]
    fn the_strongest_real_lights_at_the_receiver_come_first() {
        let light = |id, direction: Vec3, irradiance| RealLight {
            id,
            direction: direction.normalize(),
            position: None,
            color: LinearRgba::WHITE,
            irradiance,
            angular_radius: 0.1,
            fraction: 0.25,
        };
        let lights = [light(1, Vec3::new(1.0, 0.2, 0.0), 3.0), light(2, Vec3::Y, 2.0), light(3, Vec3::NEG_Y, 9.0)];
        let found = lights_above(&PlanarLights::Real(2), lights.iter(), &Isometry3d::IDENTITY, true);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].share, LightShare::Irradiance(Vec3::splat(2.0)));
        let found = lights_above(&PlanarLights::Real(1), lights.iter(), &Isometry3d::IDENTITY, false);
        assert_eq!((found.len(), found[0].share), (1, LightShare::Known(Vec3::splat(0.25))));
    }
}
