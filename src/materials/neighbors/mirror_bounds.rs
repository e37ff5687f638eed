//! Materials and sizes of meshes that reflect their neighbors.

use bevy::{camera::primitives::Aabb, math::Affine3A, prelude::*, render::render_resource::Face};

/// Minimum fraction of perpendicular light that a mirror reflects. Plastic has 0.04.
const MIN_REFLECTANCE: f32 = 0.1;
/// Perceptual roughness from which on neighbors are no more than a change of brightness. Both have twins in
/// `near_reflections.wgsl`.
const MAX_ROUGHNESS: f32 = 0.6;

/// Whether a surface shows its neighbors, and is not seen from within. Textures can only make it rougher and darker.
pub(in crate::materials) fn is_mirror(material: &StandardMaterial) -> bool {
    let dielectric = 0.16 * material.reflectance * material.reflectance;
    let color = material.base_color.to_linear();
    let metal = color.red.max(color.green).max(color.blue);
    let reflected = dielectric + (metal - dielectric) * material.metallic;
    let is_solid = material.cull_mode == Some(Face::Back) && !material.double_sided;
    is_solid
        && !material.unlit
        && matches!(material.alpha_mode, AlphaMode::Opaque | AlphaMode::Mask(_))
        && reflected >= MIN_REFLECTANCE
        && material.perceptual_roughness < MAX_ROUGHNESS
}

/// Minimum of the smallest extent ÷ the largest one. What a cube shows from the middle of a ring or a plate is not what
/// these reflect.
const MIN_COMPACTNESS: f32 = 0.3;

/// Bounds of a mirror in world space, in meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MirrorBounds {
    pub(super) center: Vec3,
    pub(super) half_extents: Vec3,
}

impl MirrorBounds {
    pub(super) fn new(aabb: &Aabb, world_from_mesh: &Affine3A) -> Self {
        let axes = world_from_mesh.matrix3;
        Self {
            center: world_from_mesh.transform_point3a(aabb.center).into(),
            half_extents: (axes.abs() * aabb.half_extents).into(),
        }
    }

    /// Whether what is around the center is what the mesh reflects.
    pub(super) fn is_compact(&self) -> bool {
        self.half_extents.min_element() >= MIN_COMPACTNESS * self.half_extents.max_element()
    }

    /// Distance of the near plane of the faces: within the mesh, also if that is thin.
    pub(super) fn near(&self) -> f32 {
        (0.25 * self.half_extents.min_element()).clamp(1e-4, 0.01)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_and_polished_stones_are_mirrors_and_plastic_is_not() {
        let gold = StandardMaterial {
            base_color: Color::srgb(0.95, 0.78, 0.45),
            metallic: 1.0,
            perceptual_roughness: 0.2,
            ..default()
        };
        assert!(is_mirror(&gold));
        assert!(!is_mirror(&StandardMaterial { perceptual_roughness: 0.7, ..gold.clone() }));
        assert!(!is_mirror(&StandardMaterial { unlit: true, ..gold.clone() }));
        assert!(!is_mirror(&StandardMaterial { double_sided: true, cull_mode: None, ..gold.clone() }));
        assert!(!is_mirror(&StandardMaterial { base_color: Color::BLACK, ..gold.clone() }));
        let plastic = StandardMaterial { perceptual_roughness: 0.1, ..default() };
        assert!(!is_mirror(&plastic));
        assert!(is_mirror(&StandardMaterial { reflectance: 0.9, ..plastic }), "a gem");
    }

    #[test]
    fn rings_plates_and_poles_show_the_room() {
        let bounds = |half_extents: Vec3| MirrorBounds { center: Vec3::ZERO, half_extents };
        assert!(bounds(Vec3::new(0.1, 0.05, 0.08)).is_compact());
        assert!(!bounds(Vec3::new(0.1, 0.01, 0.1)).is_compact());
        assert!(!bounds(Vec3::new(0.02, 0.3, 0.02)).is_compact());
    }

    #[test]
    fn bounds_contain_the_mirror_however_that_is_turned() {
        let aabb = Aabb { center: Vec3::new(1.0, 0.0, 0.0).into(), half_extents: Vec3::new(0.2, 0.1, 0.05).into() };
        let turned = Transform::from_rotation(Quat::from_rotation_z(1.0)).with_scale(Vec3::splat(2.0));
        let bounds = MirrorBounds::new(&aabb, &turned.compute_affine());
        for corner in 0..8 {
            let sign = |bit: u32| if corner & bit == 0 { -1.0 } else { 1.0 };
            let place = Vec3::from(aabb.center) + Vec3::from(aabb.half_extents) * Vec3::new(sign(1), sign(2), sign(4));
            let offset = (turned.transform_point(place) - bounds.center).abs();
            assert!(offset.cmple(bounds.half_extents + 1e-5).all(), "{offset} of {bounds:?}");
        }
        assert!(bounds.near() <= 0.01 && bounds.near() < bounds.half_extents.min_element());
    }
}
