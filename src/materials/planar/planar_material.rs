//! Material of the rectangle with a receiver's shadows.

use bevy::{material::OpaqueRendererMethod, prelude::*, render::render_resource::AsBindGroup, shader::ShaderRef};

/// Multiplies what is behind by the fraction of light that is left.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, PartialEq)]
pub(super) struct PlanarMaterial {
    #[texture(0)]
    #[sampler(1)]
    pub(super) ratio: Handle<Image>,
}

impl Material for PlanarMaterial {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/planar/planar.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Multiply
    }

    fn opaque_render_method(&self) -> OpaqueRendererMethod {
        OpaqueRendererMethod::Forward
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }
}
