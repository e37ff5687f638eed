//! The buffer of views: where each direction's shadow map looks, and what all directions share.

use super::{extract::ExtractedDome, visibility_cache::Redrawn};
use crate::shadows::{
    atlas::{DomeTextures, VIEWS_HEADER_BYTES},
    atlas_layout::{AtlasLayout, KEY_SPAN},
    directions::Directions,
    fitted_dome::FittedDome,
    view::DomeViewUniform,
    visibility_camera::VisibilityCamera,
};
use bevy::{
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{ShaderType, encase::StorageBuffer},
        renderer::RenderQueue,
        storage::GpuShaderBuffer,
        view::ExtractedView,
    },
};
use std::collections::BTreeSet;

/// Mirror of `Dome` in `dome.wgsl`.
#[derive(ShaderType, Default)]
struct DomeUniform {
    header: DomeHeader,
    #[shader(size(runtime))]
    views: Vec<DomeViewUniform>,
}

/// The fields of `Dome` in `dome.wgsl` before its views, in the same order.
#[derive(ShaderType, Clone, Debug, Default, PartialEq)]
struct DomeHeader {
    shadow_map_count: u32,
    direction_count: u32,
    atlas_tiles: UVec2,
    tile_resolution: f32,
    filter_radius: f32,
    tangent_radius: f32,
    key_span: f32,
    sample_pixels: u32,
    occludes_reflections: u32,
    scene_flags: u32,
    first_key: u32,
    visibility_size: UVec2,
    visibility_clip_from_world: Mat4,
    visibility_viewport: Vec4,
}

impl DomeHeader {
    fn new(dome: &ExtractedDome, textures: &DomeTextures, view_count: u32, camera: Option<&ExtractedView>) -> Self {
        let (fitted, layout) = (&dome.fitted, &textures.layout);
        // Nothing is shadowed before the atlas has followed the settings.
        let shadow_map_count = if layout.fits(fitted) { layout.shadow_maps() } else { 0 };
        let casts = |is_phantom: bool| fitted.casters.iter().any(|caster| caster.is_phantom == is_phantom);
        // Shadows of casters that are gone stay until all shadow maps are drawn again.
        let casters = if dome.pending.is_empty() { u32::from(casts(false)) | u32::from(casts(true)) << 1 } else { 3 };
        Self {
            shadow_map_count,
            direction_count: if shadow_map_count > 0 { view_count } else { 0 },
            atlas_tiles: UVec2::new(layout.columns, layout.rows),
            tile_resolution: layout.resolution as f32,
            filter_radius: fitted.filter.radius() as f32,
            tangent_radius: fitted.filter.tangent_radius(),
            key_span: KEY_SPAN as f32,
            sample_pixels: camera.map_or(0, |_| textures.sample_pixels),
            occludes_reflections: fitted.occludes_reflections.into(),
            scene_flags: casters | u32::from(fitted.has_lamps) << 2,
            first_key: layout.directions,
            visibility_size: textures.visibility_size,
            visibility_clip_from_world: camera
                .map_or(Mat4::ZERO, |view| view.clip_from_view * view.world_from_view.to_matrix().inverse()),
            visibility_viewport: camera.map_or(Vec4::ZERO, |view| view.viewport.as_vec4()),
        }
    }
}

/// Minimum fraction of half a tile's width kept free around the casters, so that filters do not read the neighboring
/// tile.
const MIN_GUTTER: f32 = 2.0 / 32.0;

/// The views for which the shadow maps were drawn. Those drawn at different times may be fitted to different spheres.
#[derive(Resource, Default)]
pub(super) struct DomeViews {
    uniform: DomeUniform,
    made_for: Option<(Directions, usize, Quat)>,
    is_written: bool,
    /// What was drawn since the visibility pass has last run.
    pub(super) redrawn: Redrawn,
}

impl DomeViews {
    /// Replaces all views by empty ones if the dome has other directions than before.
    fn follow(&mut self, fitted: &FittedDome) {
        let is_same = self.made_for.as_ref().is_some_and(|(directions, keys, rotation)| {
            *directions == fitted.directions && *keys == fitted.keys.len() && *rotation == fitted.world_from_dome
        });
        if is_same {
            return;
        }
        self.made_for = Some((fitted.directions.clone(), fitted.keys.len(), fitted.world_from_dome));
        let blank = |direction: &Vec3| DomeViewUniform::blank(fitted.world_from_dome * *direction);
        let keys = std::iter::repeat_n(DomeViewUniform::blank(Vec3::Y), fitted.keys.len());
        let Directions { shadowed, below } = &fitted.directions;
        self.uniform.views = shadowed.iter().map(blank).chain(keys).chain(below.iter().map(blank)).collect();
        // An array without elements has no layout.
        if self.uniform.views.is_empty() {
            self.uniform.views.push(DomeViewUniform::blank(Vec3::Y));
        }
        self.is_written = false;
        self.redrawn.all = true;
    }

    /// Fits some views to the casters and lights of this frame.
    pub(super) fn refit(&mut self, fitted: &FittedDome, layout: &AtlasLayout, indices: &BTreeSet<u32>) {
        for &index in indices {
            let Some(slot) = self.uniform.views.get_mut(index as usize) else {
                continue;
            };
            let edge = layout.tile_edge(index) as f32;
            let gutter = MIN_GUTTER.max(2.0 * (fitted.filter.radius() as f32 + 2.0) / edge);
            let view = fitted.view(index);
            let uniform =
                view.zip(fitted.sphere).map(|(view, sphere)| DomeViewUniform::new(&view, sphere, gutter, edge));
            let blank = || DomeViewUniform::blank(view.map_or(Vec3::Y, |view| view.direction));
            *slot = uniform.unwrap_or_else(blank).at(layout.corners(index));
        }
        self.is_written &= indices.is_empty();
        self.redrawn.indices.extend(indices);
    }
}

pub(super) fn follow_dome(mut views: ResMut<DomeViews>, dome: Res<ExtractedDome>) {
    views.follow(&dome.fitted);
}

/// Writes the header if it has changed, and the views if any of them has.
pub(super) fn write_views(
    mut views: ResMut<DomeViews>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    cameras: Query<&ExtractedView, With<VisibilityCamera>>,
    queue: Res<RenderQueue>,
) {
    let Some(textures) = textures else {
        return;
    };
    let Some(buffer) = buffers.get(&textures.views) else {
        return;
    };
    let view_count = views.uniform.views.len() as u32;
    let header = DomeHeader::new(&dome, &textures, view_count, cameras.iter().next());
    let is_header_new = views.uniform.header != header;
    let is_written = std::mem::replace(&mut views.is_written, true);
    views.uniform.header = header;
    views.redrawn.all |= is_header_new;
    if is_written && !is_header_new {
        return;
    }
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    if let Err(error) = bytes.write(&views.uniform) {
        error_once!("cannot lay out the dome's views: {error}");
        return;
    }
    let length = if is_written { VIEWS_HEADER_BYTES } else { bytes.as_ref().len() };
    queue.write_buffer(&buffer.buffer, 0, &bytes.as_ref()[..length]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shadows::atlas::VIEW_BYTES;

    #[test]
    fn header_and_views_are_as_long_as_the_buffer_expects() {
        assert_eq!(DomeHeader::min_size().get() as usize, VIEWS_HEADER_BYTES);
        assert_eq!(DomeViewUniform::min_size().get() as usize, VIEW_BYTES);
    }
}
