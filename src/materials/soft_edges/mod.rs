//! Edges of phantoms as soft as those of a camera's picture.

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

/// On an [`ArCamera`](crate::camera::ArCamera): virtual things fade into the phantoms that hide them instead of ending at a pixel.
///
/// A stand-in never has quite the outline of the real thing, and a camera's own edges are some pixels wide. Only edges where a
/// phantom is in front are softened; virtual things in front, and where they stand on phantoms, stay sharp. The camera gets a
/// depth and a normal prepass.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{materials::SoftPhantomEdges, prelude::*};
/// # fn setup(mut commands: Commands) {
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip"), SoftPhantomEdges { radius: 3.0 }));
/// # }
/// ```
///
/// Costs one pass over the picture with 32 reads of depth and normal per pixel. Hidden parts of virtual things are not drawn: they
/// continue in the colors of what is seen beside them. Transparent things are softened with what is behind them.
#[derive(Component, ExtractComponent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct SoftPhantomEdges {
    /// Half the width of an edge, in pixels, 0.5…16; what is outside counts as the nearer end. Defaults to 2.
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
    app.register_type::<SoftPhantomEdges>()
        .add_plugins(ExtractComponentPlugin::<SoftPhantomEdges>::default())
        .add_systems(PostUpdate, ask_for_prepasses);
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
