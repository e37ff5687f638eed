//! Phantom material: the camera frame under the shadows of virtual objects and the light of virtual lamps.

use super::{
    ClassicMaterial, ImageBasedMaterial, ToonMaterial,
    dome_bindings::{DomeBindings, SurfaceShader, bind_fields, define_dome, define_in_fragment},
    mesh_copy::MeshCopy,
};
use crate::{
    phantom::{PhantomObject, StageRole},
    shadows::{DomeIdentity, DomeTextures, Lamp},
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
/// Each [`ArCamera`](crate::camera::ArCamera) shows phantoms with its own frame, which `phantom_views.rs` binds. Before
/// its first frame, and in ordinary cameras without [`ShowPhantoms`](super::ShowPhantoms), they are not drawn.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct PhantomMaterial {
    frame: FrameBindings,
    dome: DomeBindings,
    receives: bool,
    has_lamps: bool,
}

bind_fields!(PhantomMaterial, PhantomKey, dome: DomeBindings, frame: FrameBindings);

/// Bindings of the camera frame, for views without a frame: those of lamps with shadow maps.
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
pub(super) struct PhantomUniform {
    /// Frame coordinates by place in the view: `frame_uv = view_uv · xy + zw`.
    pub(super) frame_uv_from_view_uv: Vec4,
    /// Frame coordinates by place in the world, homogeneous, which are added.
    pub(super) frame_uv_from_world: Mat4,
    /// Place in the world from which the environment shows what the frame does not; w: 1, or 0 without one, where
    /// phantoms then do not exist.
    pub(super) captured_from: Vec4,
    /// Place of the camera that projects its frame; w: 1 if `captured_from` shows what faces away from it, else 0.
    pub(super) projected_from: Vec4,
    /// Boxes −1…1 from world, of real things that hide others from that camera; zeros for none.
    pub(super) occluders: [Mat4; MAX_OCCLUDERS],
    /// Motion vector of the frame.
    pub(super) motion: Vec2,
    /// Alpha with which phantoms are drawn: 0 where it [tells real from virtual](crate::camera::MarksReal), else 1.
    pub(super) alpha: f32,
}

/// Maximum number of real things that hide others from the camera that projects its frame.
pub(super) const MAX_OCCLUDERS: usize = 8;

impl PhantomUniform {
    /// Mapping of the places in a view.
    pub(super) fn of_view(frame_uv_from_view_uv: Vec4, motion: Vec2) -> Self {
        Self {
            frame_uv_from_view_uv,
            frame_uv_from_world: Mat4::from_cols(Vec4::ZERO, Vec4::ZERO, Vec4::ZERO, Vec4::W),
            captured_from: Vec4::ZERO,
            projected_from: Vec4::ZERO,
            occluders: [Mat4::ZERO; MAX_OCCLUDERS],
            motion,
            alpha: 1.0,
        }
    }
}

/// Pipeline key of phantoms. Flags in the uniform would be enough, but lavapipe recompiles shaders that branch on
/// uniforms in every frame, and keeps them all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PhantomKey {
    receives: bool,
    shader: SurfaceShader,
    has_lamps: bool,
}

impl From<&PhantomMaterial> for PhantomKey {
    fn from(material: &PhantomMaterial) -> Self {
        Self { receives: material.receives, shader: material.dome.shader, has_lamps: material.has_lamps }
    }
}

/// Mapping of every place to the middle of the frame: in the shadow maps of lamps, phantoms are drawn everywhere.
const MIDDLE: Vec4 = Vec4::new(0.0, 0.0, 0.5, 0.5);

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
        define_dome(descriptor, shader, key.mesh_key);
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
    textures: DomeIdentity,
    has_lamps: bool,
}

/// Updates the shared materials when the dome's textures or the presence of lamps changes.
pub(super) fn update_phantom_materials(
    mut shared: ResMut<PhantomMaterials>,
    mut materials: ResMut<Assets<PhantomMaterial>>,
    textures: Res<DomeTextures>,
    lamps: Query<(), Lamp>,
) {
    let sources = PhantomSources { textures: textures.identity(), has_lamps: !lamps.is_empty() };
    if shared.made_from.as_ref() == Some(&sources) {
        return;
    }
    let material = |receives: bool| PhantomMaterial {
        frame: FrameBindings { frame: None, uniform: PhantomUniform::of_view(MIDDLE, Vec2::ZERO) },
        dome: DomeBindings::new(&textures, false),
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

type VirtualMaterials = (
    MeshMaterial3d<StandardMaterial>,
    MeshMaterial3d<ImageBasedMaterial>,
    MeshMaterial3d<ToonMaterial>,
    MeshMaterial3d<ClassicMaterial>,
);

type ChangedRole = (Entity, &'static StageRole, Has<MeshMaterial3d<PhantomMaterial>>);

/// Puts the shared materials on phantoms, and removes them from meshes that became virtual.
pub(super) fn assign_phantom_materials(
    mut commands: Commands,
    shared: Res<PhantomMaterials>,
    meshes: Query<ChangedRole, (Changed<StageRole>, Without<MeshCopy>)>,
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
