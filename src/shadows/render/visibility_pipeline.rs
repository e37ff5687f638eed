//! Pipelines of the visibility pass, one per shader permutation and step.

use crate::shadows::{atlas::SHADOW_BINDINGS, dome_light::VisibilitySamples, filter::DomeShader};
use bevy::{
    asset::load_embedded_asset,
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{
            BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePipelineDescriptor, PipelineCache, SamplerBindingType, ShaderStages, StorageTextureAccess,
            TextureFormat, TextureSampleType,
            binding_types::{
                sampler, storage_buffer_read_only_sized, storage_buffer_sized, texture_2d, texture_2d_multisampled,
                texture_depth_2d, texture_depth_2d_multisampled, texture_storage_2d, uniform_buffer,
            },
        },
        view::ViewUniform,
    },
    shader::ShaderDefVal,
};

/// Group of the dome's bindings in this pass.
pub(super) const DOME_GROUP: u32 = 1;
/// Format of a sample's sums over a quarter of the directions: eight 16-bit floats.
pub(super) const PARTIAL_SUMS_FORMAT: TextureFormat = TextureFormat::Rgba32Uint;

/// A dispatch of the visibility pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Step {
    /// Sums over all directions at each sample.
    Full,
    /// Sums over a quarter of the directions at each sample.
    Accumulate,
    /// Sums over the neighbors' quarters.
    Gather,
}

impl Step {
    /// The dispatches that a choice of samples takes, in order.
    pub(super) fn of(samples: VisibilitySamples) -> &'static [Self] {
        if samples == VisibilitySamples::Interleaved { &[Self::Accumulate, Self::Gather] } else { &[Self::Full] }
    }

    fn entry_point(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Accumulate => "accumulate",
            Self::Gather => "gather",
        }
    }

    fn shader_def(self) -> Option<ShaderDefVal> {
        match self {
            Self::Full => None,
            Self::Accumulate => Some("TALLY".into()),
            Self::Gather => Some("GATHER".into()),
        }
    }
}

/// Layout, shader and queued pipelines.
#[derive(Resource)]
pub(super) struct VisibilityPipelines {
    pub(super) dome_layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    /// By shader permutation, whether the prepass is multisampled, and step.
    queued: HashMap<(DomeShader, bool, Step), (CachedComputePipelineId, BindGroupLayout)>,
}

pub(super) fn init_visibility_pipelines(mut commands: Commands, asset_server: Res<AssetServer>) {
    let [atlas, atlas_sampler, views, results] = SHADOW_BINDINGS;
    commands.insert_resource(VisibilityPipelines {
        dome_layout: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_dome_layout",
            &BindGroupLayoutEntries::with_indices(
                ShaderStages::COMPUTE,
                (
                    (atlas, texture_depth_2d()),
                    (atlas_sampler, sampler(SamplerBindingType::Comparison)),
                    (views, storage_buffer_read_only_sized(false, None)),
                    (results, storage_buffer_read_only_sized(false, None)),
                ),
            ),
        ),
        shader: load_embedded_asset!(asset_server.as_ref(), "visibility_pass.wgsl"),
        queued: HashMap::default(),
    });
}

/// Returns the layout of a step's own bindings: the view, the prepass, the output, and for the last step what the
/// first one has written.
fn view_layout(is_multisampled: bool, step: Step) -> BindGroupLayoutDescriptor {
    let unfiltered = TextureSampleType::Float { filterable: false };
    let (depths, normals) = if is_multisampled {
        (texture_depth_2d_multisampled(), texture_2d_multisampled(unfiltered))
    } else {
        (texture_depth_2d(), texture_2d(unfiltered))
    };
    let output = if step == Step::Accumulate {
        texture_storage_2d(PARTIAL_SUMS_FORMAT, StorageTextureAccess::WriteOnly)
    } else {
        storage_buffer_sized(false, None)
    };
    let view = uniform_buffer::<ViewUniform>(true);
    let compute = ShaderStages::COMPUTE;
    if step == Step::Gather {
        let partial_sums = texture_2d(TextureSampleType::Uint);
        let entries = BindGroupLayoutEntries::sequential(compute, (view, depths, normals, output, partial_sums));
        return BindGroupLayoutDescriptor::new("mirrorball_shadows_visibility_gather_layout", &entries);
    }
    let entries = BindGroupLayoutEntries::sequential(compute, (view, depths, normals, output));
    BindGroupLayoutDescriptor::new("mirrorball_shadows_visibility_layout", &entries)
}

impl VisibilityPipelines {
    /// Returns a pipeline and the layout of the step's own bindings; queues the pipeline the first time.
    pub(super) fn pipeline(
        &mut self,
        shader: DomeShader,
        is_multisampled: bool,
        step: Step,
        cache: &PipelineCache,
    ) -> (CachedComputePipelineId, BindGroupLayout) {
        let queue = || {
            let mut shader_defs = vec![ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), DOME_GROUP)];
            shader_defs.extend(shader.shader_defs());
            shader_defs.extend(step.shader_def());
            shader_defs.extend(is_multisampled.then(|| "MULTISAMPLED".into()));
            let layout = view_layout(is_multisampled, step);
            let bind_group_layout = cache.get_bind_group_layout(&layout);
            let id = cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some("mirrorball_shadows_visibility".into()),
                layout: vec![layout, self.dome_layout.clone()],
                shader: self.shader.clone(),
                shader_defs,
                entry_point: Some(step.entry_point().into()),
                ..default()
            });
            (id, bind_group_layout)
        };
        self.queued.entry((shader, is_multisampled, step)).or_insert_with(queue).clone()
    }
}
