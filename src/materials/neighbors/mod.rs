//! Neighbors in mirrors: what polished virtual objects reflect beside the room, namely the virtual objects around them
//! and the real things, each from where the mirror is.
//!
//! **Enters:** virtual meshes that reflect at least a tenth of the light and have a perceptual roughness below 0.6, the
//! frame of the [`ArCamera`](crate::camera::ArCamera) and the environment. **Leaves:** a
//! [`SceneProbe`](crate::prefilter::SceneProbe) of each, whose filtered cube an
//! [`ImageBasedMaterial`](super::ImageBasedMaterial) reflects in place of the environment within the bounds of the
//! mesh.
//! Diffuse light stays that of the room, which the shadow dome divides already.
//!
//! # Faces
//! A probe renders the scene from the center of the mesh. The mesh itself is seen from inside there and not drawn,
//! because its back faces are culled. [Phantoms](crate::phantom::PhantomObject) show the camera's frame under virtual
//! shadows ([`ShowPhantoms`](super::ShowPhantoms)) and, where that shows nothing of them, what the light probe saw in
//! their direction.
//!
//! # Parallax
//! A cube is correct only at its center, and neighbors are near. The alpha of its texels is the reciprocal distance of
//! what they show, so that a reflected ray can be followed from the surface to what it hits; there the cube is read
//! (Szirmay-Kalos, Aszódi, Lazányi and Premecz 2005, *Approximate Ray-Tracing on the GPU with Distance Impostors*).
//! `near_reflections.rs` says how. The cubes are in a storage buffer, because no texture is left in a fragment
//! (crate documentation), and because they are needed where Bevy has no reflection probes, too.
//!
//! # Cost
//! Nothing while nothing changes: writing equal transforms is no change. After a change of a transform, mesh, material,
//! light, pose, frame or environment, [`NeighborReflections::faces_per_frame`] faces are rendered per frame until all
//! are up to date, and each finished probe is filtered once. With several mirrors each is rendered twice, so that they
//! show each other.
//!
//! # Limits
//! Only surfaces of [`SurfaceStyle::ImageBased`](super::SurfaceStyle::ImageBased) in scenes with a
//! [`ShadowDomeLight`](crate::shadows::ShadowDomeLight) do it, for opaque things seen from outside that are
//! about as wide as high. Rings, plates, poles, clear coats and anisotropic metals mirror the room. Real mirrors do not
//! reflect virtual objects. What hides behind a real thing from the camera is covered with the picture of that thing.
//! Other mirrors within the bounds of one reflect its cube too.

mod choose_mirrors;
mod mirror_bounds;
#[cfg(test)]
mod near_reflections;
mod neighbor_cubes;
mod neighbor_probe;
mod pack_pass;
mod schedule_faces;
mod watch_changes;

pub(super) use mirror_bounds::is_mirror;
pub(super) use neighbor_cubes::NeighborCubes;

use crate::{MirrorballSystems, environment_map::PendingCubes, prefilter::place_faces};
use bevy::{asset::embedded_asset, prelude::*, render::storage::ShaderBuffer, shader::load_shader_library};

/// Setting of reflections of neighbors in polished virtual objects.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::materials::NeighborReflections;
/// # let mut app = App::new();
/// // sharper mirrors that keep up with faster objects
/// app.insert_resource(NeighborReflections { faces_per_frame: 6, edge: 256, ..default() });
/// ```
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct NeighborReflections {
    /// Maximum number of mirrors, 0 (mirrors show the room only) to 8. The largest in the picture come first. Defaults
    /// to 4.
    pub max_probes: u32,
    /// Maximum number of faces rendered per frame, of all mirrors together, when something has changed; 0 keeps the
    /// reflections as they are. A mirror has six faces. Defaults to 1.
    pub faces_per_frame: u32,
    /// Edge length of a face in texels, 16 to 256, rounded up to a power of two. Defaults to 128.
    pub edge: u32,
}

impl Default for NeighborReflections {
    fn default() -> Self {
        Self { max_probes: 4, faces_per_frame: 1, edge: 128 }
    }
}

/// Keeps a mesh, or all meshes below the root of a spawned scene, from reflecting its neighbors: it reflects the room
/// only. A [`LightProbe`] of the game that contains the center of a mesh has the same effect on that mesh.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # use bevy_mirrorball::materials::NoNeighborReflections;
/// # fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>) {
/// commands.spawn((Mesh3d(meshes.add(Sphere::new(0.1))), NoNeighborReflections));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct NoNeighborReflections;

pub(super) fn build(app: &mut App) {
    load_shader_library!(app, "cube_layout.wgsl");
    load_shader_library!(app, "neighbor_cubes.wgsl");
    load_shader_library!(app, "near_reflections.wgsl");
    embedded_asset!(app, "pack_pass.wgsl");
    app.init_resource::<NeighborReflections>().init_resource::<PendingCubes>().add_systems(
        PostUpdate,
        (
            choose_mirrors::choose_mirrors,
            neighbor_probe::place_probes,
            neighbor_probe::show_phantoms_in_faces,
            watch_changes::watch_changes,
            schedule_faces::schedule_faces,
            neighbor_cubes::fit_cubes,
        )
            .chain()
            .run_if(resource_exists::<NeighborCubes>)
            .after(MirrorballSystems::Dress)
            .after(TransformSystems::Propagate)
            .before(place_faces),
    );
    watch_changes::build(app);
}

/// Adds what needs the renderer.
pub(super) fn finish(app: &mut App) {
    if app.world().contains_resource::<Assets<ShaderBuffer>>() {
        app.init_resource::<NeighborCubes>();
    }
    pack_pass::build(app);
}
