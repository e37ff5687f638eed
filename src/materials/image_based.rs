//! Image-based material: a `StandardMaterial` whose image-based light is shadowed by the dome.

use super::{
    SurfaceStyle,
    dome_bindings::{DomeBindings, SurfaceShader, bind_fields, define_dome, define_in_fragment},
    neighbors::is_mirror,
    style::{MeshContext, SharedBindings, StyleExtension, equal_by_numbers},
};
use bevy::{
    math::FloatOrd,
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
    render::storage::ShaderBuffer,
    shader::{ShaderDefVal, ShaderRef},
};

/// `StandardMaterial` with dome shadows on its image-based light, which mirrors its neighbors.
pub type ImageBasedMaterial = ExtendedMaterial<StandardMaterial, DomeShadowed>;

/// Extension of `StandardMaterial` that makes an [`ImageBasedMaterial`]. Managed by the crate.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct DomeShadowed {
    dome: DomeBindings,
    neighbors: NeighborBindings,
    light: MeasuredBindings,
    is_mirror: bool,
}

/// Permutation of the shader.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ImageBasedKey {
    dome: SurfaceShader,
    /// Whether the surface is one that reflects its neighbors, and there are cubes with these. Without, the shader has
    /// no code for them.
    is_mirror: bool,
}

/// Binding of the cubes of all mirrors, as `neighbor_cubes.wgsl` declares it.
#[derive(AsBindGroup, Clone, Debug)]
struct NeighborBindings {
    #[storage(105, read_only, visibility(fragment))]
    cubes: Handle<ShaderBuffer>,
}

#[derive(AsBindGroup, Clone, Debug)]
struct MeasuredBindings {
    #[uniform(106)]
    uniform: MeasuredUniform,
}

/// Mirror of `Measured` in `image_based.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug)]
pub(super) struct MeasuredUniform {
    weight: f32,
    /// Fraction of the dome's shadows that falls on the surface: 0 or 1.
    dome_shadows: f32,
}

impl MeasuredUniform {
    fn numbers(&self) -> [FloatOrd; 2] {
        [self.weight, self.dome_shadows].map(FloatOrd)
    }
}

equal_by_numbers!(MeasuredUniform);

bind_fields!(DomeShadowed, ImageBasedKey, dome: DomeBindings, neighbors: NeighborBindings, light: MeasuredBindings);

impl From<&DomeShadowed> for ImageBasedKey {
    fn from(extension: &DomeShadowed) -> Self {
        Self { dome: extension.dome.shader, is_mirror: extension.is_mirror }
    }
}

impl MaterialExtension for DomeShadowed {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/image_based.wgsl".into()
    }

    fn specialize(
        _: &MaterialExtensionPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialExtensionKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let ImageBasedKey { dome, is_mirror } = key.bind_group_data;
        define_dome(descriptor, dome, key.mesh_key);
        mend_layers(descriptor);
        define_in_fragment(descriptor, is_mirror.then(|| "NEIGHBORS".into()));
        Ok(())
    }
}

/// Mends what Bevy 0.19.1 draws without a direction. Normals that a prepass has are those of the base; coats and
/// anisotropic surfaces compute theirs. Without tangents, or the code for them, surfaces are isotropic.
fn mend_layers(descriptor: &mut RenderPipelineDescriptor) {
    const ANISOTROPIC: &str = "STANDARD_MATERIAL_ANISOTROPY";
    let Some(fragment) = &mut descriptor.fragment else {
        return;
    };
    let definitions = &mut fragment.shader_defs;
    let has = |definitions: &[ShaderDefVal], name: &str| definitions.contains(&name.into());
    if !has(definitions, "PBR_ANISOTROPY_TEXTURE_SUPPORTED") || !has(definitions, "VERTEX_TANGENTS") {
        definitions.retain(|definition| *definition != ANISOTROPIC.into());
    }
    if has(definitions, "STANDARD_MATERIAL_CLEARCOAT") || has(definitions, ANISOTROPIC) {
        definitions.retain(|definition| *definition != "LOAD_PREPASS_NORMALS".into());
    }
}

impl StyleExtension for DomeShadowed {
    type Parameters = MeasuredUniform;

    /// Without a dome, the engine draws a surface that receives all light. It cannot fade.
    fn parameters(style: &SurfaceStyle, context: MeshContext) -> Option<MeasuredUniform> {
        let weight = context.measured_light;
        match style {
            SurfaceStyle::ImageBased if context.has_dome || context.fades || weight < 1.0 => {
                Some(MeasuredUniform { weight, dome_shadows: 1.0 })
            }
            SurfaceStyle::Engine if context.fades => Some(MeasuredUniform { weight: 1.0, dome_shadows: 0.0 }),
            _ => None,
        }
    }

    fn new(uniform: MeasuredUniform, fades: bool, original: &StandardMaterial, shared: &SharedBindings) -> Self {
        Self {
            dome: DomeBindings::new(&shared.dome, fades),
            light: MeasuredBindings { uniform },
            neighbors: NeighborBindings { cubes: shared.neighbors.buffer.clone() },
            is_mirror: shared.neighbors.has_mirrors() && uniform.dome_shadows > 0.0 && is_mirror(original),
        }
    }
}
