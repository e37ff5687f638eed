//! Pipelines of the visibility pass, one per shader permutation and step.

use super::visibility_cache::ChangesUniform;
use crate::shadows::{atlas::SHADOW_BINDINGS, filter::DomeShader};
use bevy::{
    asset::load_embedded_asset,
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{
            BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
            PipelineCache, SamplerBindingType, ShaderStages, TextureSampleType,
            binding_types::{
                sampler, storage_buffer_read_only_sized, storage_buffer_sized, texture_2d, texture_2d_multisampled,
                texture_depth_2d, texture_depth_2d_multisampled, uniform_buffer,
            },
        },
        view::ViewUniform,
    },
    shader::ShaderDefVal,
};

/// Group of the dome's bindings in this pass.
pub(super) const DOME_GROUP: u32 = 1;
/// Group of the numbers of workgroups of indirect dispatches, for the steps that write them.
pub(super) const GROUPS_GROUP: u32 = 2;

/// A dispatch of the visibility pass; an entry point of its shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Step {
    /// Lists the directions to look up.
    Plan,
    /// Lists the tiles whose samples show something else than before.
    FindChanges,
    /// Looks up the listed tiles.
    LookUp,
    LookUpKeys,
    /// Looks up the listed directions.
    LookUpFresh,
    LookUpFreshKeys,
    /// Sums over the directions that each sample reads.
    Accumulate,
    /// Sums over the neighbors' quarters.
    Gather,
}

impl Step {
    fn entry_point(self) -> &'static str {
        match self {
            Self::Plan => "make_plan",
            Self::FindChanges => "find_changes",
            Self::LookUp => "look_up",
            Self::LookUpKeys => "look_up_keys",
            Self::LookUpFresh => "look_up_fresh",
            Self::LookUpFreshKeys => "look_up_fresh_keys",
            Self::Accumulate => "accumulate",
            Self::Gather => "gather",
        }
    }

    /// Whether the step is in `visibility_pass.wgsl`. The others are in `visibility_plan_pass.wgsl`.
    fn sums(self) -> bool {
        matches!(self, Self::Accumulate | Self::Gather)
    }

    /// Whether the step writes the numbers of workgroups of the indirect dispatches.
    fn writes_groups(self) -> bool {
        matches!(self, Self::Plan | Self::FindChanges)
    }
}

/// Permutation of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct VisibilityShader {
    pub(super) dome: DomeShader,
    /// Whether the prepass is multisampled.
    pub(super) is_multisampled: bool,
    pub(super) is_interleaved: bool,
    /// Whether lookups are kept.
    pub(super) is_cached: bool,
}

impl VisibilityShader {
    /// Returns the steps that may be needed, in order.
    fn steps(self) -> impl Iterator<Item = Step> {
        let cached: &[Step] = match (self.is_cached, self.dome.has_keys) {
            (false, _) => &[],
            (true, false) => &[Step::Plan, Step::FindChanges, Step::LookUp, Step::LookUpFresh],
            (true, true) => &[
                Step::Plan,
                Step::FindChanges,
                Step::LookUp,
                Step::LookUpKeys,
                Step::LookUpFresh,
                Step::LookUpFreshKeys,
            ],
        };
        let gather = self.is_interleaved.then_some(Step::Gather);
        cached.iter().copied().chain([Step::Accumulate]).chain(gather)
    }

    /// Returns the layout of the pass's own bindings: the view, the prepass, samples and sums, then what is kept.
    pub(super) fn layout(self) -> BindGroupLayoutDescriptor {
        let unfiltered = TextureSampleType::Float { filterable: false };
        let (depths, normals) = if self.is_multisampled {
            (texture_depth_2d_multisampled(), texture_2d_multisampled(unfiltered))
        } else {
            (texture_depth_2d(), texture_2d(unfiltered))
        };
        let (view, compute) = (uniform_buffer::<ViewUniform>(true), ShaderStages::COMPUTE);
        let written = || storage_buffer_sized(false, None);
        if self.is_cached {
            let changes = uniform_buffer::<ChangesUniform>(false);
            let all = (view, depths, normals, written(), written(), written(), written(), changes);
            let entries = BindGroupLayoutEntries::sequential(compute, all);
            return BindGroupLayoutDescriptor::new("mirrorball_shadows_visibility_cached_layout", &entries);
        }
        let entries = BindGroupLayoutEntries::sequential(compute, (view, depths, normals, written(), written()));
        BindGroupLayoutDescriptor::new("mirrorball_shadows_visibility_layout", &entries)
    }

    fn shader_defs(self) -> Vec<ShaderDefVal> {
        let flags =
            [(self.is_multisampled, "MULTISAMPLED"), (self.is_interleaved, "INTERLEAVED"), (self.is_cached, "CACHED")];
        let mut shader_defs = vec![ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), DOME_GROUP)];
        shader_defs.extend(self.dome.shader_defs());
        shader_defs.extend(flags.into_iter().filter(|(is_set, _)| *is_set).map(|(_, name)| name.into()));
        shader_defs
    }
}

/// Layouts, shader and queued pipelines.
#[derive(Resource)]
pub(super) struct VisibilityPipelines {
    pub(super) dome_layout: BindGroupLayoutDescriptor,
    pub(super) groups_layout: BindGroupLayoutDescriptor,
    plan_shader: Handle<Shader>,
    sum_shader: Handle<Shader>,
    queued: HashMap<VisibilityShader, Vec<(Step, CachedComputePipelineId)>>,
}

pub(super) fn init_visibility_pipelines(mut commands: Commands, asset_server: Res<AssetServer>) {
    let [atlas, atlas_sampler, views, results] = SHADOW_BINDINGS;
    let compute = ShaderStages::COMPUTE;
    commands.insert_resource(VisibilityPipelines {
        dome_layout: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_dome_layout",
            &BindGroupLayoutEntries::with_indices(
                compute,
                (
                    (atlas, texture_depth_2d()),
                    (atlas_sampler, sampler(SamplerBindingType::Comparison)),
                    (views, storage_buffer_read_only_sized(false, None)),
                    (results, storage_buffer_read_only_sized(false, None)),
                ),
            ),
        ),
        groups_layout: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_groups_layout",
            &BindGroupLayoutEntries::single(compute, storage_buffer_sized(false, None)),
        ),
        plan_shader: load_embedded_asset!(asset_server.as_ref(), "visibility_plan_pass.wgsl"),
        sum_shader: load_embedded_asset!(asset_server.as_ref(), "visibility_pass.wgsl"),
        queued: HashMap::default(),
    });
}

impl VisibilityPipelines {
    /// Returns the steps of a permutation with their pipelines, which are queued the first time.
    pub(super) fn steps(
        &mut self,
        shader: VisibilityShader,
        cache: &PipelineCache,
    ) -> &[(Step, CachedComputePipelineId)] {
        let Self { dome_layout, groups_layout, plan_shader, sum_shader, queued } = self;
        queued.entry(shader).or_insert_with(|| {
            let queue = |step: Step| {
                let groups = step.writes_groups().then(|| groups_layout.clone());
                let id = cache.queue_compute_pipeline(ComputePipelineDescriptor {
                    label: Some(format!("mirrorball_shadows_visibility_{}", step.entry_point()).into()),
                    layout: [shader.layout(), dome_layout.clone()].into_iter().chain(groups).collect(),
                    shader: if step.sums() { sum_shader.clone() } else { plan_shader.clone() },
                    shader_defs: shader.shader_defs(),
                    entry_point: Some(step.entry_point().into()),
                    ..default()
                });
                (step, id)
            };
            shader.steps().map(queue).collect()
        })
    }
}
