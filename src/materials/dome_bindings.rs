//! Bindings of the dome shadows, 100 to 104, shared by all materials that read them.

use crate::shadows::{DomeShader, DomeTextures};
use bevy::{
    ecs::system::lifetimeless::SRes,
    pbr::MeshPipelineKey,
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{AsBindGroup, RenderPipelineDescriptor},
        storage::{GpuShaderBuffer, ShaderBuffer},
        texture::{FallbackImage, GpuImage},
    },
    shader::ShaderDefVal,
};

/// Bindings of [`DomeTextures`] in a material, as the shader library of `shadows` declares them.
#[derive(AsBindGroup, Clone, Debug)]
#[bind_group_data(SurfaceShader)]
pub(super) struct DomeBindings {
    #[texture(100, sample_type = "depth")]
    #[sampler(101, sampler_type = "comparison")]
    atlas: Handle<Image>,
    #[storage(102, read_only)]
    views: Handle<ShaderBuffer>,
    #[storage(103, read_only)]
    results: Handle<ShaderBuffer>,
    #[storage(104, read_only)]
    visibility: Handle<ShaderBuffer>,
    pub(super) shader: SurfaceShader,
}

/// Permutation of the shaders that read the dome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct SurfaceShader {
    dome: DomeShader,
    /// Whether the surface is a copy of a mesh that fades out.
    fades: bool,
}

impl DomeBindings {
    pub(super) fn new(textures: &DomeTextures, fades: bool) -> Self {
        Self {
            atlas: textures.atlas.clone(),
            views: textures.views.clone(),
            results: textures.results.clone(),
            visibility: textures.visibility.clone(),
            shader: SurfaceShader { dome: textures.shader, fades },
        }
    }
}

impl From<&DomeBindings> for SurfaceShader {
    fn from(bindings: &DomeBindings) -> Self {
        bindings.shader
    }
}

/// Adds shader definitions to the fragment stage of a pipeline, if it has one.
pub(super) fn define_in_fragment(
    descriptor: &mut RenderPipelineDescriptor,
    definitions: impl IntoIterator<Item = ShaderDefVal>,
) {
    if let Some(fragment) = &mut descriptor.fragment {
        fragment.shader_defs.extend(definitions);
    }
}

/// Adds the shader definitions of the dome and of fading to the fragment stage of the pipeline of a mesh.
///
/// What a prepass shows takes its light from the samples of the visibility pass only. Few fragments would need to read
/// shadow maps, but software rasterizers would run that code for all, and GPUs reserve registers for it.
pub(super) fn define_dome(
    descriptor: &mut RenderPipelineDescriptor,
    SurfaceShader { dome, fades }: SurfaceShader,
    mesh_key: MeshPipelineKey,
) {
    let in_prepass = mesh_key.contains(MeshPipelineKey::DEPTH_PREPASS | MeshPipelineKey::NORMAL_PREPASS)
        && mesh_key.intersection(MeshPipelineKey::BLEND_RESERVED_BITS) == MeshPipelineKey::BLEND_OPAQUE
        && !mesh_key.contains(MeshPipelineKey::READS_VIEW_TRANSMISSION_TEXTURE);
    define_in_fragment(descriptor, dome.shader_defs());
    define_in_fragment(descriptor, fades.then(|| "FADES".into()));
    define_in_fragment(descriptor, (in_prepass && dome.samples_prepass).then(|| "SAMPLES_ONLY".into()));
}

/// System parameters of derived implementations of `AsBindGroup`.
pub(super) type BindingAssets =
    (SRes<RenderAssets<GpuImage>>, SRes<FallbackImage>, SRes<RenderAssets<GpuShaderBuffer>>);

/// Implements `AsBindGroup` for a material by concatenating the bindings of its fields, which the derive macro does not
/// support. The material converts into its bind group data with `From`. The bind group is never bindless.
///
/// List fields that hold only textures and buffers of assets first: a bind group whose assets are still loading then
/// fails before it creates a uniform buffer.
macro_rules! bind_fields {
    ($material:ident, $data:ty, $($field:ident: $bindings:ty),+) => {
        impl AsBindGroup for $material {
            type Data = $data;
            type Param = $crate::materials::dome_bindings::BindingAssets;

            fn label() -> &'static str {
                stringify!($material)
            }

            fn bind_group_data(&self) -> $data {
                self.into()
            }

            fn unprepared_bind_group(
                &self,
                layout: &bevy::render::render_resource::BindGroupLayout,
                device: &bevy::render::renderer::RenderDevice,
                param: &mut bevy::ecs::system::SystemParamItem<'_, '_, Self::Param>,
                force_no_bindless: bool,
            ) -> Result<
                bevy::render::render_resource::UnpreparedBindGroup,
                bevy::render::render_resource::AsBindGroupError,
            > {
                let mut resources = Vec::new();
                $(
                    let part = self.$field.unprepared_bind_group(layout, device, param, force_no_bindless)?;
                    resources.extend(part.bindings.0);
                )+
                let bindings = bevy::render::render_resource::BindingResources(resources);
                Ok(bevy::render::render_resource::UnpreparedBindGroup { bindings })
            }

            fn bind_group_layout_entries(
                device: &bevy::render::renderer::RenderDevice,
                force_no_bindless: bool,
            ) -> Vec<bevy::render::render_resource::BindGroupLayoutEntry> {
                let mut entries = Vec::new();
                $(entries.extend(<$bindings>::bind_group_layout_entries(device, force_no_bindless));)+
                entries
            }
        }
    };
}
pub(super) use bind_fields;
