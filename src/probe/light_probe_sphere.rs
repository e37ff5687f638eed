//! Mirrored balls: their components and what they are made of.

use super::{
    clip_recovery::ClipRecovery, clip_task::ClipTask, history::HistoryHint, measured_event::WasInView,
    probe_measurement::ProbeMeasurement,
};
use bevy::prelude::*;

/// Mirrored ball in the real scene. Its center is the entity's origin.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands) {
/// // A ball of 10 cm diameter on the desk, 17 cm to the right of the marker.
/// commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin, children![
///     (LightProbeSphere { radius: 0.05, ..default() }, Transform::from_xyz(0.17, 0.05, 0.01)),
/// ]));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, ProbeMeasurement, ClipRecovery, HistoryHint, ClipTask, WasInView)]
pub struct LightProbeSphere {
    /// Radius in meters. Finite and above 0. Defaults to 0.05.
    pub radius: f32,
    /// Fraction of the light that the ball mirrors, 0…1 (exclusive of 0). The frame is divided by it. Polished chrome
    /// has about 0.65, silvered glass about 0.9. Defaults to 0.9. A ball below [`DARK`](Self::DARK) beside a brighter
    /// one is a second, shorter exposure in the same frame: it resolves lamps that the bright ball shows clipped
    /// ([`lighting`](crate::lighting)), and contributes nothing to the environment itself.
    pub reflectance: f32,
    /// Material of the ball: whether the reflectance depends on the angle. Defaults to [`BallSurface::Mirror`].
    pub surface: BallSurface,
}

impl LightProbeSphere {
    /// Reflectance below which a ball only measures lamps. Black glass and lacquer have 0.04.
    pub const DARK: f32 = 0.2;

    /// Whether the ball only measures lamps.
    pub fn is_dark(&self) -> bool {
        self.reflectance < Self::DARK
    }
}

/// Material of a ball.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum BallSurface {
    /// A mirror, with the same reflectance at all angles.
    #[default]
    Mirror,
    /// Black glass, lacquer or another clear coat over black. The reflectance given is the one at perpendicular
    /// incidence; it grows towards the rim (Fresnel).
    Dielectric,
}

impl BallSurface {
    /// Fraction of unpolarized light that is mirrored at an angle of incidence, given as its cosine. `perpendicular` is
    /// the fraction at perpendicular incidence.
    pub fn reflectance_at(self, perpendicular: f32, cosine: f32) -> f32 {
        if self == Self::Mirror {
            return perpendicular;
        }
        // Fresnel's equations with the refractive index that gives the perpendicular reflectance.
        let root = perpendicular.clamp(0.0, 0.98).sqrt();
        let index = (1.0 + root) / (1.0 - root);
        let cos = cosine.clamp(0.0, 1.0);
        let inside = (1.0 - (1.0 - cos * cos) / (index * index)).sqrt();
        let across = (cos - index * inside) / (cos + index * inside);
        let along = (index * cos - inside) / (index * cos + inside);
        0.5 * (across * across + along * along)
    }
}

impl Default for LightProbeSphere {
    fn default() -> Self {
        Self { radius: 0.05, reflectance: 0.9, surface: BallSurface::Mirror }
    }
}

/// Uniform sky that lights the scene instead of what the ball shows, for comparison. It belongs on the entity of a
/// [`LightProbeSphere`].
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::UniformSky};
/// fn compare(mut commands: Commands, ball: Single<Entity, With<LightProbeSphere>>) {
///     commands.entity(*ball).insert(UniformSky { radiance: Some(Vec3::splat(0.5)) });
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct UniformSky {
    /// Radiance in linear camera units. Defaults to `None`, which is the gray that makes the marker's paper as bright
    /// as it is in the frame (1.0 while no marker has been detected).
    pub radiance: Option<Vec3>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_mirrors_more_towards_the_rim() {
        // Refractive index 1.5: 4 % perpendicular, 8.9 % at 60° (Hecht, Optics, 4.6), all of it when grazing.
        let glass = |degrees: f32| BallSurface::Dielectric.reflectance_at(0.04, degrees.to_radians().cos());
        assert!(
            (glass(0.0) - 0.04).abs() < 1e-4 && (glass(60.0) - 0.0892).abs() < 5e-4,
            "{} {}",
            glass(0.0),
            glass(60.0)
        );
        assert!(glass(89.99) > 0.99);
        assert_eq!(BallSurface::Mirror.reflectance_at(0.9, 0.1), 0.9);
    }
}
