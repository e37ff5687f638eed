//! Soft edges of phantoms, as soft as the edges in a camera frame.
//!
//! **Enters:** the rendered view and its depth and normal prepasses. **Leaves:** the same view, blended across edges
//! where a phantom hides a virtual object.

mod prepare_soft_edges;
mod soft_edges_pass;
mod soft_edges_pipeline;

use bevy::{
    asset::embedded_asset,
    core_pipeline::{
        Core3d, Core3dSystems,
        prepass::{DepthPrepass, NormalPrepass},
    },
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        extract_component::{ExtractComponent, ExtractComponentPlugin},
        render_resource::SpecializedRenderPipelines,
    },
};
use prepare_soft_edges::prepare_soft_edges;
use soft_edges_pass::soft_edges_pass;
use soft_edges_pipeline::{SoftEdgesPipeline, init_soft_edges_pipeline};

/// Soft edges of phantoms, on an [`ArCamera`](crate::camera::ArCamera): virtual objects fade into the phantoms that
/// hide them instead of ending within one pixel.
///
/// A stand-in never matches the outline of the real object exactly, and edges in a camera frame are some pixels wide.
/// Only edges where a phantom is in front are softened. Edges of virtual objects in front of phantoms, and contact
/// lines where objects stand on phantoms, stay sharp. The camera gets a depth and a normal prepass.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{materials::SoftPhantomEdges, prelude::*};
/// # fn setup(mut commands: Commands) {
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip"), SoftPhantomEdges { radius: 3.0 }));
/// # }
/// ```
///
/// Costs one full-screen pass with 32 reads of depth and normal per pixel. Hidden parts of virtual objects are not
/// rendered; the blend uses the colors of the visible parts beside them. Transparent objects are blended together
/// with what is behind them.
#[derive(Component, ExtractComponent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct SoftPhantomEdges {
    /// Half width of an edge in pixels, 0.5…16 (clamped). Defaults to 2, also used for NaN.
    pub radius: f32,
}

impl SoftPhantomEdges {
    const RADIUS: std::ops::RangeInclusive<f32> = 0.5..=16.0;
}

impl Default for SoftPhantomEdges {
    fn default() -> Self {
        Self { radius: 2.0 }
    }
}

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "soft_edges_pass.wgsl");
    app.add_plugins(ExtractComponentPlugin::<SoftPhantomEdges>::default()).add_systems(PostUpdate, ask_for_prepasses);
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<SpecializedRenderPipelines<SoftEdgesPipeline>>()
        .add_systems(RenderStartup, init_soft_edges_pipeline)
        .add_systems(Render, prepare_soft_edges.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(Core3d, soft_edges_pass.in_set(Core3dSystems::EarlyPostProcess));
}

type WithoutPrepasses = (With<SoftPhantomEdges>, Or<(Without<DepthPrepass>, Without<NormalPrepass>)>);

fn ask_for_prepasses(mut commands: Commands, cameras: Query<Entity, WithoutPrepasses>) {
    for camera in &cameras {
        commands.entity(camera).insert((DepthPrepass, NormalPrepass));
    }
}
