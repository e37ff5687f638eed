//! Views of the shadow maps.

use super::bounding_sphere::BoundingSphere;
use bevy::{prelude::*, render::render_resource::ShaderType};

/// View of a shadow map in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightView {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Perspective of a light that is near; `None` for parallel light.
    pub perspective: Option<PerspectiveView>,
    /// Tangent of the light's angular radius as seen from the casters; 0 for a point light.
    pub tangent_radius: f32,
}

/// Perspective of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PerspectiveView {
    pub position: Vec3,
    /// Direction of the top of the image, at a right angle to the view's direction; of any length.
    pub up: Vec3,
    /// Half the width and height of the image at a distance of one meter.
    pub half_size: Vec2,
    /// Distance of the near plane from the position in meters.
    pub near: f32,
    /// Distance of the far plane from the position in meters.
    pub far: f32,
    /// Distance from the position at which the light was measured, in meters. The light falls off with the square of
    /// the distance, relative to this one. 0 for light that is equally strong everywhere.
    pub measured_at: f32,
}

/// Minimum distance of the near plane of a near light, as a fraction of that of the far plane.
const MIN_NEAR_FRACTION: f32 = 0.02;
/// Minimum distance of a near light from the center of the casters, in radii of their sphere. A closer light is
/// treated as far away, because one perspective view cannot contain all casters.
const MIN_LAMP_DISTANCE: f32 = 1.2;

impl LightView {
    /// Returns the view of parallel light.
    pub(super) fn parallel(direction: Vec3, tangent_radius: f32) -> Self {
        Self { direction, perspective: None, tangent_radius }
    }

    /// Returns the view of a lamp at a position, aimed at the casters. The lamp's light and angular radius were
    /// measured from another position. `None` if the lamp is too close to the casters.
    pub(super) fn near(
        position: Vec3,
        tangent_radius: f32,
        measured_from: Vec3,
        casters: Option<BoundingSphere>,
    ) -> Option<Self> {
        let casters = casters?;
        let (direction, distance) = (position - casters.center).normalize_and_length();
        let radius = 1.05 * casters.radius;
        if !distance.is_finite() || distance < MIN_LAMP_DISTANCE * radius {
            return None;
        }
        let far = distance + radius;
        let perspective = PerspectiveView {
            position,
            up: direction.any_orthonormal_vector(),
            half_size: Vec2::splat((radius / distance).asin().tan()),
            near: (distance - radius).max(MIN_NEAR_FRACTION * far),
            far,
            measured_at: position.distance(measured_from),
        };
        Some(Self { direction, perspective: Some(perspective), tangent_radius })
    }
}

/// Mirror of `DomeView` in `dome.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, PartialEq)]
pub(super) struct DomeViewUniform {
    axes_low: u32,
    axes_mid: u32,
    axes_high: u32,
    scale: f32,
    center: Vec3,
    corners: u32,
    depth: Vec2,
    penumbra_scale: f32,
    measured_at: f32,
}

/// Center of a view that contains no position.
const NOWHERE: Vec3 = Vec3::splat(1e12);

impl DomeViewUniform {
    /// Returns a view that contains no position.
    pub(super) fn blank(direction: Vec3) -> Self {
        Self::orthographic(direction, NOWHERE, 1.0)
    }

    /// Returns a view fitted to a sphere around all casters, for a tile of the given resolution. `gutter` is the
    /// fraction of half the tile's width that stays free.
    pub(super) fn new(view: &LightView, sphere: BoundingSphere, gutter: f32, resolution: f32) -> Self {
        match view.perspective {
            None => {
                let half_width = sphere.radius * (1.0 + gutter);
                // Snapping to whole texels draws still casters identically from every sphere of this size.
                let texel = 2.0 * half_width / resolution;
                let to_texel =
                    |axis: Vec3| axis * ((axis.dot(sphere.center) / texel).round() * texel - axis.dot(sphere.center));
                let (right, up) = axes(view.direction);
                let center = sphere.center + to_texel(right) + to_texel(up);
                Self {
                    penumbra_scale: view.tangent_radius,
                    ..Self::orthographic(view.direction, center, 1.0 / half_width)
                }
            }
            Some(perspective) => {
                let up = perspective.up.reject_from_normalized(view.direction).normalize_or(axes(view.direction).1);
                let right = up.cross(view.direction);
                let half_size = perspective.half_size * (1.0 + gutter);
                let shorter_side = half_size.min_element();
                // The scale fits the shorter side; the axis along the longer side is shorter instead.
                let shrunk = Vec2::splat(shorter_side) / half_size;
                let inverse_depth = (1.0 / perspective.near - 1.0 / perspective.far).max(f32::MIN_POSITIVE);
                let lamp_radius = view.tangent_radius * perspective.measured_at;
                Self {
                    center: perspective.position,
                    depth: Vec2::new(1.0 / inverse_depth, -1.0 / (perspective.far * inverse_depth)),
                    // Penumbras in tile widths per unit of depth; see `percentage_closer_soft_shadow` in maps.wgsl.
                    penumbra_scale: 0.5 * lamp_radius / shorter_side * inverse_depth,
                    measured_at: perspective.measured_at,
                    ..Self::with_axes(right * shrunk.x, up * shrunk.y, -1.0 / shorter_side)
                }
            }
        }
    }

    /// Returns the view with the corners of its two tiles in the atlas.
    pub(super) fn at(self, corners: [UVec2; 2]) -> Self {
        let [virtuals, phantoms] = corners;
        Self { corners: virtuals.x | virtuals.y << 8 | phantoms.x << 16 | phantoms.y << 24, ..self }
    }

    fn orthographic(direction: Vec3, center: Vec3, scale: f32) -> Self {
        let (right, up) = axes(direction);
        Self { center, ..Self::with_axes(right, up, scale) }
    }

    fn with_axes(right: Vec3, up: Vec3, scale: f32) -> Self {
        Self {
            axes_low: snorms(right.x, right.y),
            axes_mid: snorms(right.z, up.x),
            axes_high: snorms(up.y, up.z),
            scale,
            center: NOWHERE,
            corners: 0,
            depth: Vec2::ZERO,
            penumbra_scale: 0.0,
            measured_at: 0.0,
        }
    }
}

/// Returns two unit vectors (right and up) whose cross product is the direction.
fn axes(direction: Vec3) -> (Vec3, Vec3) {
    let (right, up) = direction.any_orthonormal_pair();
    if right.cross(up).dot(direction) > 0.0 { (right, up) } else { (up, right) }
}

/// Packs two signed 16-bit fractions for `unpack2x16snorm`.
fn snorms(low: f32, high: f32) -> u32 {
    let snorm = |value: f32| u32::from((value.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    snorm(low) | snorm(high) << 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twin of `project` in `dome.wgsl`, with the division by w.
    fn project(view: &DomeViewUniform, place: Vec3) -> Vec3 {
        let part =
            |word: u32, high: bool| f32::from(((word >> if high { 16 } else { 0 }) & 0xffff) as u16 as i16) / 32767.0;
        let right = Vec3::new(part(view.axes_low, false), part(view.axes_low, true), part(view.axes_mid, false));
        let up = Vec3::new(part(view.axes_mid, true), part(view.axes_high, false), part(view.axes_high, true));
        let direction = right.cross(up).normalize();
        let offset = place - view.center;
        let across = Vec2::new(right.dot(offset), up.dot(offset)) * view.scale.abs();
        if view.scale > 0.0 {
            return across.extend(0.5 + 0.5 * direction.dot(offset) * view.scale);
        }
        let distance = -direction.dot(offset);
        (across / distance).extend(view.depth.x / distance + view.depth.y)
    }

    #[test]
    fn a_spot_sees_its_picture_between_near_and_far() {
        let (position, target) = (Vec3::new(0.3, 1.0, -0.2), Vec3::new(0.1, 0.0, 0.4));
        let direction = (position - target).normalize();
        for half_size in [Vec2::new(0.5, 0.25), Vec2::new(0.3, 0.6), Vec2::splat(0.4)] {
            let perspective =
                PerspectiveView { position, up: Vec3::Y, half_size, near: 0.2, far: 3.0, measured_at: 0.0 };
            let view = LightView { direction, perspective: Some(perspective), tangent_radius: 0.0 };
            let sphere = BoundingSphere { center: target, radius: 1.0 };
            let uniform = DomeViewUniform::new(&view, sphere, 0.0, 256.0);
            let up = Vec3::Y.reject_from_normalized(direction).normalize();
            let right = up.cross(direction);
            for (distance, depth) in [(0.2, 1.0), (3.0, 0.0)] {
                let corner = position + distance * (half_size.x * right + half_size.y * up - direction);
                let expected = Vec3::new(1.0, 1.0, depth);
                let found = project(&uniform, corner);
                assert!(found.distance(expected) < 2e-3, "{half_size} {distance}: {found}");
            }
        }
    }

    #[test]
    fn a_near_lamp_sees_all_casters_and_one_among_them_none() {
        let sphere = BoundingSphere { center: Vec3::new(0.2, 0.1, 0.0), radius: 0.5 };
        let position = Vec3::new(0.7, 1.2, 0.4);
        let view = LightView::near(position, 0.1, Vec3::ZERO, Some(sphere)).expect("far enough");
        let uniform = DomeViewUniform::new(&view, sphere, 0.05, 512.0);
        for i in 0..200 {
            let angle = 2.4 * i as f32;
            let height = i as f32 / 99.5 - 1.0;
            let across = (1.0 - height * height).max(0.0).sqrt();
            let on_sphere = Vec3::new(across * angle.cos(), height, across * angle.sin());
            let seen = project(&uniform, sphere.center + sphere.radius * on_sphere);
            assert!(seen.xy().abs().max_element() <= 1.0 && (0.0..=1.0).contains(&seen.z), "{seen}");
        }
        assert_eq!(LightView::near(sphere.center, 0.1, Vec3::ZERO, Some(sphere)), None);
    }
}
