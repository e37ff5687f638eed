//! Toon material: a `StandardMaterial` shaded in flat bands of light.

use super::{
    ramps::{RampPair, RampsUniform},
    toon_uniform::ToonUniform,
};
use crate::materials::{
    dome_bindings::{DomeBindings, SurfaceShader, bind_fields, define_dome, define_in_fragment},
    strongest_light::LightBindings,
    style::{MeshContext, SharedBindings, StyleExtension, SurfaceStyle, ToonKey, ToonModel, ToonStyle, without_layers},
};
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError},
    shader::{ShaderDefVal, ShaderRef},
};

/// `StandardMaterial` shaded in flat bands of light.
pub type ToonMaterial = ExtendedMaterial<StandardMaterial, ToonShaded>;

/// Extension of `StandardMaterial` that makes a [`ToonMaterial`]. Managed by the crate: use [`SurfaceStyle::Toon`].
#[derive(Asset, TypePath, Clone, Debug)]
pub struct ToonShaded {
    dome: DomeBindings,
    light: LightBindings,
    toon: ToonBindings,
    parts: ShaderParts,
}

bind_fields!(ToonShaded, ToonPipelineKey, dome: DomeBindings, light: LightBindings, toon: ToonBindings);

#[derive(AsBindGroup, Clone, Debug)]
struct ToonBindings {
    #[uniform(106)]
    uniform: ToonUniform,
    #[uniform(107)]
    ramps: RampsUniform,
}

/// Permutation of the shader.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ToonPipelineKey {
    dome: SurfaceShader,
    parts: ShaderParts,
}

/// Parts of the shader that a style needs. Branching on uniforms instead would slow down software rasterizers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct ShaderParts {
    has_lamps: bool,
    follows_real_light: bool,
    has_author_direction: bool,
    is_phong: bool,
    has_diffuse_ramp: bool,
    has_specular_ramp: bool,
    has_rim: bool,
}

impl ShaderParts {
    fn new(style: &ToonStyle, has_rim: bool, context: MeshContext) -> Self {
        let [diffuse, specular] = context.ramps;
        Self {
            has_lamps: context.has_lamps,
            follows_real_light: style.key == ToonKey::StrongestRealLight,
            has_author_direction: style.key.authored_direction().is_some(),
            is_phong: matches!(style.model, ToonModel::Phong(_)),
            has_diffuse_ramp: diffuse.is_some(),
            has_specular_ramp: specular.is_some(),
            has_rim,
        }
    }

    fn shader_defs(&self) -> impl Iterator<Item = ShaderDefVal> {
        let definitions = [
            (self.has_lamps, "HAS_LAMPS"),
            (self.follows_real_light, "KEY_REAL_LIGHT"),
            (self.has_author_direction, "KEY_DIRECTION"),
            (self.is_phong, "PHONG"),
            (self.has_diffuse_ramp, "DIFFUSE_RAMP"),
            (self.has_specular_ramp, "SPECULAR_RAMP"),
            (self.has_rim, "RIM"),
        ];
        definitions.into_iter().filter(|(is_needed, _)| *is_needed).map(|(_, name)| name.into())
    }
}

impl From<&ToonShaded> for ToonPipelineKey {
    fn from(extension: &ToonShaded) -> Self {
        Self { dome: extension.dome.shader, parts: extension.parts }
    }
}

impl MaterialExtension for ToonShaded {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/toon/toon.wgsl".into()
    }

    fn specialize(
        _: &MaterialExtensionPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialExtensionKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let ToonPipelineKey { dome, parts } = key.bind_group_data;
        define_dome(descriptor, dome, key.mesh_key);
        define_in_fragment(descriptor, parts.shader_defs());
        Ok(())
    }
}

/// What the material of a toon surface depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::materials) struct ToonParameters {
    uniform: ToonUniform,
    ramps: RampPair,
    parts: ShaderParts,
}

impl StyleExtension for ToonShaded {
    type Parameters = ToonParameters;

    fn parameters(style: &SurfaceStyle, context: MeshContext) -> Option<ToonParameters> {
        let SurfaceStyle::Toon(style) = style else {
            return None;
        };
        let uniform = ToonUniform::new(style, context.measured_light);
        let parts = ShaderParts::new(style, uniform.has_rim(), context);
        Some(ToonParameters { uniform, ramps: context.ramps, parts })
    }

    fn new(parameters: ToonParameters, fades: bool, _: &StandardMaterial, shared: &SharedBindings) -> Self {
        let ToonParameters { uniform, ramps, parts } = parameters;
        let ramps = RampsUniform::new(ramps, &shared.ramps);
        let toon = ToonBindings { uniform, ramps };
        Self { dome: DomeBindings::new(&shared.dome, fades), light: shared.light.as_ref().into(), toon, parts }
    }

    /// Bands are matte.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        without_layers(base)
    }
}
