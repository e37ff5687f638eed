//! The dome on its way to the GPU.

use super::{
    FittedDome, Refreshing, depth_pass,
    dome::Directions,
    textures::{AtlasLayout, DomeTextures, KEY_SPAN, VIEWS_HEADER},
    view::ViewUniform,
    visibility_pass::ServedByDome,
};
use crate::environment_map::EnvironmentCube;
use bevy::{
    light::EnvironmentMapLight,
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        render_asset::RenderAssets,
        render_resource::{ShaderType, encase::StorageBuffer},
        renderer::RenderQueue,
        storage::GpuShaderBuffer,
        view::ExtractedView,
    },
};
use std::collections::BTreeSet;

pub(super) fn build(app: &mut App) {
    app.sub_app_mut(RenderApp)
        .init_resource::<ExtractedDome>()
        .init_resource::<DomeViews>()
        .add_systems(ExtractSchedule, extract_dome)
        .add_systems(
            Render,
            (
                follow_dome.in_set(RenderSystems::PrepareResources),
                write_views.in_set(RenderSystems::PrepareBindGroups).after(depth_pass::prepare_depth),
            ),
        );
}

/// The dome as it is this frame.
#[derive(Resource, Default)]
pub(super) struct ExtractedDome {
    pub(super) fitted: FittedDome,
    pub(super) sky: Option<Sky>,
    /// Directions whose shadow maps are still to be drawn, in ascending order.
    pub(super) pending: BTreeSet<u32>,
}

/// The environment that gives the dome its colors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sky {
    pub(super) cube: AssetId<Image>,
    pub(super) cube_from_world: Quat,
    /// Whether it is what a probe measures, whose writes are announced.
    pub(super) is_measured: bool,
}

type ViewEnvironment = (&'static EnvironmentMapLight, Has<ServedByDome>);

fn extract_dome(
    mut extracted: ResMut<ExtractedDome>,
    fitted: Extract<Res<FittedDome>>,
    refreshing: Extract<Res<Refreshing>>,
    cubes: Extract<Query<&EnvironmentCube>>,
    maps: Extract<Query<ViewEnvironment, With<Camera3d>>>,
) {
    if fitted.is_changed() {
        extracted.fitted.clone_from(&fitted);
    }
    extracted.pending.extend(&refreshing.chosen);
    let measured =
        cubes.iter().next().map(|cube| Sky { cube: cube.0.id(), cube_from_world: Quat::IDENTITY, is_measured: true });
    extracted.sky = measured.or_else(|| {
        let (map, _) = maps.iter().max_by_key(|(_, is_served)| *is_served)?;
        Some(Sky { cube: map.specular_map.id(), cube_from_world: map.rotation.inverse(), is_measured: false })
    });
}

/// Mirror of `Dome` in dome.wgsl.
#[derive(ShaderType, Default)]
struct DomeUniform {
    counts: UVec4,
    params: Vec4,
    served: UVec4,
    visibility_size: UVec4,
    served_clip_from_world: Mat4,
    #[shader(size(runtime))]
    views: Vec<ViewUniform>,
}

/// Least share of a tile's half width kept free around the casters, so that filters do not read the neighbor's.
const GUTTER: f32 = 2.0 / 32.0;

/// The views as their shadow maps were drawn; those drawn at different times may have different spheres.
#[derive(Resource, Default)]
pub(super) struct DomeViews {
    uniform: DomeUniform,
    made_for: Option<(Directions, usize, Quat)>,
    is_written: bool,
}

impl DomeViews {
    /// Starts with views that see nothing when the dome has other directions than before.
    fn follow(&mut self, fitted: &FittedDome) {
        let is_same = self.made_for.as_ref().is_some_and(|(directions, keys, rotation)| {
            *directions == fitted.directions && *keys == fitted.keys.len() && *rotation == fitted.world_from_dome
        });
        if is_same {
            return;
        }
        self.made_for = Some((fitted.directions.clone(), fitted.keys.len(), fitted.world_from_dome));
        let blank = |direction: &Vec3| ViewUniform::blank(fitted.world_from_dome * *direction);
        let keys = std::iter::repeat_n(ViewUniform::blank(Vec3::Y), fitted.keys.len());
        let Directions { shadowed, below } = &fitted.directions;
        self.uniform.views = shadowed.iter().map(blank).chain(keys).chain(below.iter().map(blank)).collect();
        // An array without elements has no layout.
        if self.uniform.views.is_empty() {
            self.uniform.views.push(ViewUniform::blank(Vec3::Y));
        }
        self.is_written = false;
    }

    /// Fits views to the casters and lights as they are now.
    pub(super) fn refit(&mut self, fitted: &FittedDome, layout: &AtlasLayout, indices: &BTreeSet<u32>) {
        for &index in indices {
            let Some(slot) = self.uniform.views.get_mut(index as usize) else {
                continue;
            };
            let edge = layout.tile_edge(index) as f32;
            let gutter = GUTTER.max(2.0 * (fitted.filter.radius() as f32 + 2.0) / edge);
            let view = fitted.view(index);
            let fitted = view.zip(fitted.sphere).map(|(view, sphere)| ViewUniform::new(&view, sphere, gutter, edge));
            let blank = || ViewUniform::blank(view.map_or(Vec3::Y, |view| view.direction));
            *slot = fitted.unwrap_or_else(blank).at(layout.corners(index));
        }
        self.is_written &= indices.is_empty();
    }
}

fn follow_dome(mut views: ResMut<DomeViews>, dome: Res<ExtractedDome>) {
    views.follow(&dome.fitted);
}

type ServedView = (&'static ExtractedView, &'static ServedByDome);

pub(super) fn write_views(
    mut views: ResMut<DomeViews>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    served: Query<ServedView>,
    queue: Res<RenderQueue>,
) {
    let Some(textures) = textures else {
        return;
    };
    let Some(buffer) = buffers.get(&textures.views) else {
        return;
    };
    let (fitted, layout) = (&dome.fitted, &textures.layout);
    // Before the atlas has followed the settings nothing is shadowed.
    let shadowed = if fitted.fits(layout) { layout.shadow_maps() } else { 0 };
    let all = if shadowed > 0 { views.uniform.views.len() as u32 } else { 0 };
    let served = served.iter().next().map(|(view, _)| view);
    let casts = |is_phantom: bool| fitted.casters.iter().any(|caster| caster.is_phantom == is_phantom);
    // Shadows of what has gone stay until all shadow maps are drawn anew.
    let casters = if dome.pending.is_empty() { u32::from(casts(false)) | u32::from(casts(true)) << 1 } else { 3 };
    let header = DomeUniform {
        counts: UVec4::new(shadowed, all, layout.columns, layout.rows),
        params: Vec4::new(
            layout.resolution as f32,
            fitted.filter.radius() as f32,
            fitted.filter.spread(),
            KEY_SPAN as f32,
        ),
        served: UVec4::new(
            served.map_or(0, |_| fitted.samples.pixels()),
            fitted.occludes_reflections.into(),
            casters | u32::from(fitted.has_lamps) << 2,
            layout.directions,
        ),
        visibility_size: textures.visibility_size.extend(0).extend(0),
        served_clip_from_world: served
            .map_or(Mat4::ZERO, |view| view.clip_from_view * view.world_from_view.to_matrix().inverse()),
        views: std::mem::take(&mut views.uniform.views),
    };
    let old = &views.uniform;
    let parts = |header: &DomeUniform| {
        (header.counts, header.params, header.served, header.visibility_size, header.served_clip_from_world)
    };
    let is_header_new = parts(old) != parts(&header);
    let is_written = std::mem::replace(&mut views.is_written, true);
    views.uniform = header;
    if is_written && !is_header_new {
        return;
    }
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    if let Err(error) = bytes.write(&views.uniform) {
        error_once!("cannot lay out the dome's views: {error}");
        return;
    }
    let length = if is_written { VIEWS_HEADER } else { bytes.as_ref().len() };
    queue.write_buffer(&buffer.buffer, 0, &bytes.as_ref()[..length]);
}
