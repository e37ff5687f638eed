//! The outline of toon surfaces: the mesh once more, blown up by some pixels, seen from behind.

use super::{
    SurfaceStyle, ToonShaded,
    hull::Hulls,
    toon::ToonMaterial,
    twin::{Dressed, Styles},
};
use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers, VisibilityRange},
    light::{NotShadowCaster, NotShadowReceiver},
    material::OpaqueRendererMethod,
    mesh::{MeshVertexBufferLayoutRef, morph::MeshMorphWeights, skinning::SkinnedMesh},
    pbr::{MaterialPipeline, MaterialPipelineKey},
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{AsBindGroup, Face, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
    shader::ShaderRef,
};

/// The color of an outline. Managed by the crate: use [`ToonStyle::outline_width`](super::ToonStyle::outline_width).
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
#[bind_group_data(OutlineKey)]
pub struct OutlineMaterial {
    #[uniform(0)]
    uniform: OutlineUniform,
    is_inside_out: bool,
}

/// Mirror of `Outline` in outline.wgsl.
#[derive(ShaderType, Clone, Copy, Debug)]
struct OutlineUniform {
    color: Vec4,
    width: f32,
}

/// Which side of the hull is the far one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(C)]
pub struct OutlineKey {
    is_inside_out: bool,
}

impl From<&OutlineMaterial> for OutlineKey {
    fn from(material: &OutlineMaterial) -> Self {
        Self { is_inside_out: material.is_inside_out }
    }
}

impl Material for OutlineMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/outline.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/outline.wgsl".into()
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

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let near_side = if key.bind_group_data.is_inside_out { Face::Back } else { Face::Front };
        descriptor.primitive.cull_mode = Some(near_side);
        Ok(())
    }
}

/// What an outline is made of.
#[derive(Clone, Copy, PartialEq)]
struct OutlineLook {
    color: LinearRgba,
    width: f32,
    is_inside_out: bool,
}

impl OutlineLook {
    /// Equal looks have equal keys.
    fn key(&self) -> ([u32; 4], bool) {
        let Self { color, width, is_inside_out } = *self;
        ([color.red, color.green, color.blue, width].map(f32::to_bits), is_inside_out)
    }

    fn material(&self) -> OutlineMaterial {
        let uniform = OutlineUniform { color: self.color.to_vec4(), width: self.width };
        OutlineMaterial { uniform, is_inside_out: self.is_inside_out }
    }
}

/// The materials in use, one per look; outlines keep them alive.
#[derive(Resource, Default)]
pub(super) struct OutlineMaterials {
    by_look: HashMap<([u32; 4], bool), AssetId<OutlineMaterial>>,
}

/// The outline of its parent; a child entity, so that it moves and goes with it.
#[derive(Component)]
pub(super) struct Outline;

/// On a mesh with an outline.
#[derive(Component)]
pub(super) struct Outlined {
    outline: Entity,
    look: OutlineLook,
    hull: AssetId<Mesh>,
}

type ToonMesh = (
    Entity,
    &'static Mesh3d,
    &'static Dressed<ToonShaded>,
    Option<&'static Outlined>,
    (
        Option<Ref<'static, SkinnedMesh>>,
        Option<Ref<'static, MeshMorphWeights>>,
        Option<Ref<'static, RenderLayers>>,
        Option<Ref<'static, VisibilityRange>>,
        Option<Ref<'static, NoFrustumCulling>>,
    ),
);

/// Gives every opaque toon surface the outline that its style asks for.
pub(super) fn draw_outlines(
    mut commands: Commands,
    mut hulls: ResMut<Hulls>,
    mut looks: ResMut<OutlineMaterials>,
    mut materials: ResMut<Assets<OutlineMaterial>>,
    mut meshes: ResMut<Assets<Mesh>>,
    originals: Res<Assets<StandardMaterial>>,
    toons: Query<ToonMesh, With<MeshMaterial3d<ToonMaterial>>>,
    styles: Styles,
) {
    looks.by_look.retain(|_, material| materials.contains(*material));
    for (mesh, Mesh3d(shape), dressed, outlined, (skin, morph, layers, range, unculled)) in &toons {
        let Some(look) = wanted_look(styles.of(mesh), originals.get(&dressed.original)) else {
            continue;
        };
        let hull = hulls.around(shape, &mut meshes);
        let outline = match outlined {
            Some(Outlined { outline, .. }) => *outline,
            None => commands.spawn((Outline, NotShadowCaster, NotShadowReceiver, ChildOf(mesh))).id(),
        };
        let mut entity = commands.entity(outline);
        if outlined.is_none_or(|outlined| outlined.look != look || outlined.hull != hull.id()) {
            let existing = looks.by_look.get(&look.key()).and_then(|id| materials.get_strong_handle(*id));
            let material = existing.unwrap_or_else(|| materials.add(look.material()));
            looks.by_look.insert(look.key(), material.id());
            let hull_id = hull.id();
            entity.try_insert((Mesh3d(hull), MeshMaterial3d(material)));
            entity.commands().entity(mesh).insert(Outlined { outline, look, hull: hull_id });
        }
        // What moves or shows the mesh moves and shows its outline.
        let is_new = outlined.is_none();
        if let Some(skin) = skin.filter(|skin| is_new || skin.is_changed()) {
            entity.try_insert(SkinnedMesh::clone(&skin));
        }
        if let Some(morph) = morph.filter(|morph| is_new || morph.is_changed()) {
            entity.try_insert(MeshMorphWeights::clone(&morph));
        }
        if let Some(layers) = layers.filter(|layers| is_new || layers.is_changed()) {
            entity.try_insert(RenderLayers::clone(&layers));
        }
        if let Some(range) = range.filter(|range| is_new || range.is_changed()) {
            entity.try_insert(VisibilityRange::clone(&range));
        }
        if unculled.is_some_and(|unculled| is_new || unculled.is_added()) {
            entity.try_insert(NoFrustumCulling);
        }
    }
}

/// Takes outlines away from meshes that are no longer drawn as toons with an outline.
pub(super) fn erase_outlines(
    mut commands: Commands,
    outlined: Query<(Entity, &Outlined, Has<MeshMaterial3d<ToonMaterial>>, Option<&Dressed<ToonShaded>>, Has<Mesh3d>)>,
    originals: Res<Assets<StandardMaterial>>,
    styles: Styles,
) {
    for (mesh, Outlined { outline, .. }, is_toon, dressed, has_shape) in &outlined {
        let original = dressed.and_then(|dressed| originals.get(&dressed.original));
        if !is_toon || !has_shape || wanted_look(styles.of(mesh), original).is_none() {
            commands.entity(*outline).try_despawn();
            commands.entity(mesh).remove::<Outlined>();
        }
    }
}

/// The outline that a style asks for. A hull knows nothing of masks and glass: only opaque surfaces have one.
fn wanted_look(style: SurfaceStyle, original: Option<&StandardMaterial>) -> Option<OutlineLook> {
    let (SurfaceStyle::Toon(toon), Some(original)) = (style, original) else {
        return None;
    };
    let width = toon.visible_outline_width().filter(|_| original.alpha_mode == AlphaMode::Opaque)?;
    let is_inside_out = original.cull_mode == Some(Face::Front);
    Some(OutlineLook { color: toon.outline_color.to_linear().with_alpha(1.0), width, is_inside_out })
}
