//! Classic material: a `StandardMaterial` shaded by sums of lookups in the environment maps.

use super::classic_uniform::ClassicUniform;
use crate::materials::{
    dome_bindings::{DomeBindings, SurfaceShader, bind_fields, define_dome, define_in_fragment},
    strongest_light::LightBindings,
    style::{ClassicModel, MeshContext, SharedBindings, StyleExtension, SurfaceStyle, without_layers},
};
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError},
    shader::ShaderRef,
};

/// `StandardMaterial` shaded by sums of lookups in the environment maps.
pub type ClassicMaterial = ExtendedMaterial<StandardMaterial, ClassicShaded>;

/// Extension of `StandardMaterial` that makes a [`ClassicMaterial`]. Managed by the crate: use
/// [`SurfaceStyle::Classic`].
#[derive(Asset, TypePath, Clone, Debug)]
pub struct ClassicShaded {
    dome: DomeBindings,
    light: LightBindings,
    classic: ClassicBindings,
    parts: ClassicParts,
}

bind_fields!(ClassicShaded, ClassicKey, dome: DomeBindings, light: LightBindings, classic: ClassicBindings);

#[derive(AsBindGroup, Clone, Debug)]
struct ClassicBindings {
    #[uniform(106)]
    uniform: ClassicUniform,
}

/// Permutation of the shader.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ClassicKey {
    dome: SurfaceShader,
    parts: ClassicParts,
}

/// Parts of the shader that a surface needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::materials) struct ClassicParts {
    /// Whether there is a dome. Without, the shader has no code for it.
    has_dome: bool,
    /// Whether the light is that of the sphere map instead of the environment maps.
    has_sphere_map: bool,
}

impl From<&ClassicShaded> for ClassicKey {
    fn from(extension: &ClassicShaded) -> Self {
        Self { dome: extension.dome.shader, parts: extension.parts }
    }
}

impl MaterialExtension for ClassicShaded {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/classic/classic.wgsl".into()
    }

    fn specialize(
        _: &MaterialExtensionPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialExtensionKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let ClassicKey { dome, parts: ClassicParts { has_dome, has_sphere_map } } = key.bind_group_data;
        define_dome(descriptor, dome, key.mesh_key);
        define_in_fragment(descriptor, has_dome.then(|| "DOME".into()));
        define_in_fragment(descriptor, has_sphere_map.then(|| "SPHERE_MAP".into()));
        Ok(())
    }
}

impl StyleExtension for ClassicShaded {
    type Parameters = (ClassicUniform, ClassicParts);

    fn parameters(style: &SurfaceStyle, context: MeshContext) -> Option<Self::Parameters> {
        match style {
            SurfaceStyle::Classic(style) => {
                let has_sphere_map = matches!(style.model, ClassicModel::SphereMap(_));
                let parts = ClassicParts { has_dome: context.has_dome, has_sphere_map };
                Some((ClassicUniform::new(style, context.measured_light), parts))
            }
            _ => None,
        }
    }

    fn new(
        (uniform, parts): (ClassicUniform, ClassicParts),
        fades: bool,
        _: &StandardMaterial,
        shared: &SharedBindings,
    ) -> Self {
        Self {
            dome: DomeBindings::new(&shared.dome, fades),
            light: shared.light.as_ref().into(),
            classic: ClassicBindings { uniform },
            parts,
        }
    }

    fn simplify(base: StandardMaterial) -> StandardMaterial {
        without_layers(base)
    }
}
