//! A dome of shadow directions colored by the measured environment.
//!
//! **Enters:** the meshes of the stage, the environment cube, a [`ShadowDomeLight`]. **Leaves:** [`DomeTextures`]: one depth
//! atlas and two buffers from which materials compute, per pixel and color channel, which share of the light arrives
//! (`visibility.wgsl`).
//!
//! # How
//! Every direction is an orthographic view fitted to one sphere around all casters, a tile in one depth atlas. Casters are
//! drawn once per mesh, instanced over the directions. Each direction has two tiles: one sees virtual casters, one phantoms,
//! because a real shadow is in the picture already and must not be drawn again.
//!
//! With L(d) = environment radiance × solid angle in direction d, and `V_v`, `V_p` the visibility past virtual casters and
//! phantoms:
//! - a phantom shows `camera × Σ V_v·V_p·L·(n·d)₊ / Σ V_p·L·(n·d)₊`: each light takes away only its own color, what already
//!   lies in a real shadow is not darkened twice, and where nothing virtual is in the way the picture stays untouched;
//! - a virtual surface keeps `Σ V_v·[V_p·L + (1−V_p)·L_p]·(n·d)₊ / Σ L·(n·d)₊` of its diffuse image-based light: a phantom
//!   that hides a direction sends its own light `L_p` instead (the mean of the map below the horizon).
//!
//! Directions below the horizon take part in the sums without shadow maps: what comes from there is the desk's light.
//!
//! # Cost
//! One draw call per caster mesh whatever the number of directions; nothing is redrawn while no caster moves. A phantom's
//! pixel takes one 2 × 2 filtered depth comparison per direction, up to three where it is in shadow; a virtual one two. The
//! weights are summed anew every frame, 25 000 lookups. The atlas has
//! `2 · directions · resolution²` texels of four bytes: 34 MB by default.
//!
//! # Limits
//! Static meshes of triangles: skinned, morphed and alpha-masked casters are drawn in their rest pose and unmasked. One dome
//! at a time.
//!
//! Sources: Supan 2006 (row C8), whose dome subtracts blocked light with one map refreshed per frame.

mod depth_pass;
mod dome;
mod extract;
mod textures;
mod weights_pass;

pub use textures::DomeTextures;

use crate::{MirrorballSystems, stage::StageRole};
use bevy::{
    camera::primitives::Aabb, light::NotShadowCaster, prelude::*, render::RenderApp, shader::load_shader_library,
};
use dome::BoundingSphere;

/// A dome of shadow-casting directions colored by the measured environment; its up axis is the entity's +Y.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands) {
/// commands.spawn(ShadowDomeLight { directions: 128, ..default() });
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct ShadowDomeLight {
    /// Number of directions on the hemisphere, 1…256 (clamped). Each has its own shadow map. Defaults to 64.
    pub directions: u32,
    /// Side of one direction's square shadow map in texels, 32…1024 (clamped; halved until the atlas fits the device).
    /// Defaults to 256.
    pub resolution: u32,
}

impl Default for ShadowDomeLight {
    fn default() -> Self {
        Self { directions: 64, resolution: 256 }
    }
}

impl ShadowDomeLight {
    /// Most directions a dome can have.
    pub const MAX_DIRECTIONS: u32 = 256;

    /// The number of directions within its bounds.
    fn clamped_directions(&self) -> u32 {
        self.directions.clamp(1, Self::MAX_DIRECTIONS)
    }
}

/// Draws and weighs domes of shadow directions.
pub struct ShadowsPlugin;

impl Plugin for ShadowsPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "dome.wgsl");
        load_shader_library!(app, "visibility.wgsl");
        app.register_type::<ShadowDomeLight>().init_resource::<FittedDome>().add_systems(
            PostUpdate,
            (textures::fit_textures.run_if(resource_exists::<DomeTextures>), fit_dome)
                .chain()
                .after(bevy::camera::visibility::VisibilitySystems::CheckVisibility)
                .in_set(MirrorballSystems::Measure),
        );
        extract::build(app);
        depth_pass::build(app);
        weights_pass::build(app);
    }

    fn finish(&self, app: &mut App) {
        if app.get_sub_app(RenderApp).is_some() {
            app.init_resource::<DomeTextures>();
        }
    }
}

/// What the render world has to know of the dome.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
struct FittedDome {
    /// Number of directions with shadow maps; 0 without a dome.
    directions: u32,
    world_from_dome: Quat,
    sphere: Option<BoundingSphere>,
    casters: Vec<Caster>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Caster {
    mesh: AssetId<Mesh>,
    world_from_local: Mat4,
    is_phantom: bool,
}

type CasterItem =
    (&'static Mesh3d, &'static GlobalTransform, &'static Aabb, &'static StageRole, &'static InheritedVisibility);

fn fit_dome(
    mut fitted: ResMut<FittedDome>,
    domes: Query<(&ShadowDomeLight, &GlobalTransform)>,
    meshes: Query<CasterItem, Without<NotShadowCaster>>,
) {
    let Some((dome, transform)) = domes.iter().next() else {
        fitted.set_if_neq(FittedDome::default());
        return;
    };
    let mut casters = Vec::new();
    let mut spheres = Vec::new();
    for (mesh, transform, aabb, role, visibility) in &meshes {
        let is_phantom = match role {
            StageRole::Virtual => false,
            StageRole::Phantom(phantom) if phantom.casts => true,
            StageRole::Phantom(_) => continue,
        };
        if !visibility.get() {
            continue;
        }
        let world_from_local = transform.affine();
        casters.push(Caster { mesh: mesh.id(), world_from_local: world_from_local.into(), is_phantom });
        spheres.push(BoundingSphere {
            center: world_from_local.transform_point3a(aabb.center).into(),
            radius: transform.radius_vec3a(aabb.half_extents),
        });
    }
    let sphere = BoundingSphere::around(&spheres).map(|sphere| sphere.or_keep(fitted.sphere));
    fitted.set_if_neq(FittedDome {
        directions: dome.clamped_directions(),
        world_from_dome: transform.rotation(),
        sphere,
        casters,
    });
}
