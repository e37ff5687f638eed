//! Phantom material: the camera frame under the shadows of virtual objects and the light of virtual lamps.

use super::{
    ImageBasedMaterial, ToonMaterial,
    dome_bindings::{DomeBindings, bind_fields, define_in_fragment},
    outline::Outline,
};
use crate::{
    camera::{ArCamera, CameraFrame, FrameMapping, FrameTexture},
    phantom::{PhantomObject, StageRole},
    shadows::{DomeIdentity, DomeShader, DomeTextures, Lamp},
};
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
    shader::ShaderRef,
};

/// Material of phantoms. It shows the camera frame times the fraction of light that virtual objects let through, plus
/// the light of virtual lamps. Managed by the crate: put a [`PhantomObject`] on an entity instead.
///
/// The frame is that of the first [`ArCamera`]. Phantoms are not drawn before the first frame.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct PhantomMaterial {
    frame: FrameBindings,
    dome: DomeBindings,
    receives: bool,
    has_lamps: bool,
}

bind_fields!(PhantomMaterial, PhantomKey, dome: DomeBindings, frame: FrameBindings);

/// Bindings of the camera frame.
#[derive(AsBindGroup, Clone, Debug)]
struct FrameBindings {
    #[texture(0)]
    #[sampler(1)]
    frame: Option<Handle<Image>>,
    #[uniform(2)]
    uniform: PhantomUniform,
}

/// Mirror of `Phantom` in `phantom_frame.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, PartialEq)]
struct PhantomUniform {
    frame_uv_from_view_uv: Vec4,
}

/// Pipeline key of phantoms. Flags in the uniform would be enough, but lavapipe recompiles shaders that branch on
/// uniforms in every frame, and keeps them all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PhantomKey {
    receives: bool,
    shader: DomeShader,
    has_lamps: bool,
}

impl From<&PhantomMaterial> for PhantomKey {
    fn from(material: &PhantomMaterial) -> Self {
        Self { receives: material.receives, shader: material.dome.shader, has_lamps: material.has_lamps }
    }
}

/// Mapping of every view position to a point outside the frame, where phantoms are not drawn.
const NO_FRAME: Vec4 = Vec4::new(0.0, 0.0, -1.0, -1.0);

impl Material for PhantomMaterial {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/phantom.wgsl".into()
    }

    fn prepass_fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/phantom_prepass.wgsl".into()
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let PhantomKey { receives, shader, has_lamps } = key.bind_group_data;
        define_in_fragment(descriptor, receives.then(|| "RECEIVES_SHADOWS".into()));
        define_in_fragment(descriptor, shader.shader_defs());
        define_in_fragment(descriptor, has_lamps.then(|| "HAS_LAMPS".into()));
        Ok(())
    }
}

/// The two materials that all phantoms share.
#[derive(Resource, Default)]
pub(super) struct PhantomMaterials {
    receiving: Handle<PhantomMaterial>,
    hiding: Handle<PhantomMaterial>,
    made_from: Option<PhantomSources>,
}

/// Inputs of the shared materials.
#[derive(PartialEq)]
struct PhantomSources {
    frame: Option<AssetId<Image>>,
    frame_uv_from_view_uv: Vec4,
    textures: DomeIdentity,
    has_lamps: bool,
}

type FrameSource = (&'static ArCamera, &'static Camera, &'static CameraFrame, &'static FrameTexture);

/// Updates the shared materials when the frame, its mapping, the dome's textures or the presence of lamps changes.
pub(super) fn update_phantom_materials(
    mut shared: ResMut<PhantomMaterials>,
    mut materials: ResMut<Assets<PhantomMaterial>>,
    textures: Res<DomeTextures>,
    cameras: Query<FrameSource>,
    lamps: Query<(), Lamp>,
) {
    let source = cameras.iter().next().and_then(|(ar_camera, camera, frame, texture)| {
        let view_size = camera.physical_viewport_size().filter(|size| size.min_element() > 0)?;
        let mapping = FrameMapping::new(ar_camera.fit, frame.pixels.size.as_vec2(), view_size.as_vec2());
        Some((texture.image.clone(), mapping.frame_uv_from_view_uv()))
    });
    let (frame, frame_uv_from_view_uv) = source.unzip();
    let frame_uv_from_view_uv = frame_uv_from_view_uv.unwrap_or(NO_FRAME);
    let sources = PhantomSources {
        frame: frame.as_ref().map(Handle::id),
        frame_uv_from_view_uv,
        textures: textures.identity(),
        has_lamps: !lamps.is_empty(),
    };
    if shared.made_from.as_ref() == Some(&sources) {
        return;
    }
    let material = |receives: bool| PhantomMaterial {
        frame: FrameBindings { frame: frame.clone(), uniform: PhantomUniform { frame_uv_from_view_uv } },
        dome: textures.as_ref().into(),
        receives,
        has_lamps: sources.has_lamps,
    };
    if shared.made_from.is_none() {
        shared.receiving = materials.add(material(true));
        shared.hiding = materials.add(material(false));
    } else {
        for (handle, receives) in [(&shared.receiving, true), (&shared.hiding, false)] {
            if let Some(mut existing) = materials.get_mut(handle) {
                *existing = material(receives);
            }
        }
    }
    shared.made_from = Some(sources);
}

type VirtualMaterials =
    (MeshMaterial3d<StandardMaterial>, MeshMaterial3d<ImageBasedMaterial>, MeshMaterial3d<ToonMaterial>);

type ChangedRole = (Entity, &'static StageRole, Has<MeshMaterial3d<PhantomMaterial>>);

/// Puts the shared materials on phantoms, and removes them from meshes that became virtual.
pub(super) fn assign_phantom_materials(
    mut commands: Commands,
    shared: Res<PhantomMaterials>,
    meshes: Query<ChangedRole, (Changed<StageRole>, Without<Outline>)>,
) {
    for (mesh, role, has_material) in &meshes {
        let mut entity = commands.entity(mesh);
        match role {
            StageRole::Phantom(PhantomObject { receives, .. }) => {
                let material = if *receives { &shared.receiving } else { &shared.hiding };
                entity.remove::<VirtualMaterials>().insert(MeshMaterial3d(material.clone()));
            }
            StageRole::Virtual if has_material => {
                entity.remove::<MeshMaterial3d<PhantomMaterial>>();
            }
            StageRole::Virtual => {}
        }
    }
}
