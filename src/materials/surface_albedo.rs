//! Albedos of virtual meshes for the light that bounces off them, taken from their original materials.

use super::original_material::{NewMaterial, OriginalMaterial};
use crate::{phantom::StageRole, shadows::SurfaceAlbedo};
use bevy::{platform::collections::HashMap, prelude::*};

/// Texels along each axis from which the mean color of a texture is taken.
const TEXELS: u32 = 16;

/// Mean colors of textures, linear. `None` for textures whose data is not on the CPU, or compressed.
#[derive(Default)]
pub(super) struct TextureMeans(HashMap<AssetId<Image>, Option<Vec3>>);

impl TextureMeans {
    /// Mean of a texture; white if it is unknown.
    fn of(&mut self, id: AssetId<Image>, images: &Assets<Image>) -> Vec3 {
        let Some(image) = images.get(id) else {
            return Vec3::ONE;
        };
        self.0.entry(id).or_insert_with(|| mean_color(image)).unwrap_or(Vec3::ONE)
    }
}

/// Mean color of a texture, weighted with alpha.
fn mean_color(image: &Image) -> Option<Vec3> {
    let size = image.size();
    let at = |i: u32, edge: u32| (edge * (2 * i + 1) / (2 * TEXELS)).min(edge.saturating_sub(1));
    let texels = (0..TEXELS * TEXELS).map(|i| image.get_color_at(at(i % TEXELS, size.x), at(i / TEXELS, size.y)));
    let mut sum = Vec4::ZERO;
    for texel in texels {
        let color = LinearRgba::from(texel.ok()?).to_vec4();
        sum += (color.truncate() * color.w).extend(color.w);
    }
    (sum.w > 0.0).then(|| sum.truncate() / sum.w)
}

pub(super) fn mark_albedos(
    mut commands: Commands,
    mut changes: MessageReader<AssetEvent<StandardMaterial>>,
    mut image_changes: MessageReader<AssetEvent<Image>>,
    materials: Res<Assets<StandardMaterial>>,
    images: Res<Assets<Image>>,
    meshes: Query<(Entity, &StageRole, OriginalMaterial, Option<&SurfaceAlbedo>)>,
    fresh: Query<(), Or<(NewMaterial, Changed<StageRole>)>>,
    mut means: Local<TextureMeans>,
    mut is_waiting: Local<bool>,
) {
    for change in image_changes.read() {
        if let AssetEvent::Added { id } | AssetEvent::Modified { id } | AssetEvent::Removed { id } = change {
            *is_waiting |= means.0.remove(id).is_some();
        }
    }
    if changes.read().count() == 0 && fresh.is_empty() && !*is_waiting {
        return;
    }
    *is_waiting = false;
    for (mesh, _, original, marked) in meshes.iter().filter(|(_, role, ..)| **role == StageRole::Virtual) {
        let Some(material) = original.handle().and_then(|original| materials.get(original)) else {
            continue;
        };
        let texture = material.base_color_texture.as_ref();
        *is_waiting |= texture.is_some_and(|texture| images.get(texture).is_none());
        let base = LinearRgba::from(material.base_color).to_vec3();
        let albedo = base * texture.map_or(Vec3::ONE, |texture| means.of(texture.id(), &images));
        let wanted = SurfaceAlbedo(albedo.clamp(Vec3::ZERO, Vec3::ONE));
        if marked != Some(&wanted) {
            commands.entity(mesh).insert(wanted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::{
        asset::RenderAssetUsages,
        render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    };

    #[test]
    fn the_mean_of_a_texture_is_linear_and_leaves_out_what_is_transparent() {
        let size = Extent3d { width: 2, height: 2, depth_or_array_layers: 1 };
        let texels = [[255, 0, 0, 255], [0, 0, 255, 255], [0, 255, 0, 0], [188, 0, 0, 255]].concat();
        let format = TextureFormat::Rgba8UnormSrgb;
        let image = Image::new(size, TextureDimension::D2, texels, format, RenderAssetUsages::all());
        let mean = mean_color(&image).expect("readable");
        assert!(mean.distance(Vec3::new(1.5029, 0.0, 1.0) / 3.0) < 1e-3, "{mean}");
    }

    #[test]
    fn textures_without_data_have_no_mean() {
        let size = Extent3d { width: 2, height: 2, depth_or_array_layers: 1 };
        let format = TextureFormat::Rgba8UnormSrgb;
        let image = Image::new_uninit(size, TextureDimension::D2, format, RenderAssetUsages::all());
        assert_eq!(mean_color(&image), None);
    }
}
