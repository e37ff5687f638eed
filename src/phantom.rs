//! Phantoms: stand-ins for real objects.
//!
//! **Enters:** [`PhantomObject`] on meshes or on roots of spawned scenes. **Leaves:** a [`StageRole`] on every mesh
//! entity, from which the later stages know whether the mesh is a stand-in for a real object or a virtual object.

use crate::MirrorballSystems;
use bevy::prelude::*;

/// Stand-in for a real object in the camera frame. It is invisible itself, hides virtual objects behind it, and
/// receives their shadows on the camera frame.
///
/// Add it to an entity with a mesh, or to the root of a spawned scene to make every mesh below the root a phantom.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>) {
/// // the desk: it receives shadows and casts none
/// let desk = Plane3d::default().mesh().size(1.6, 1.2);
/// commands.spawn((PhantomObject { casts: false, ..default() }, Mesh3d(meshes.add(desk))));
/// // a real box, 12 × 6 × 7 cm
/// commands.spawn((
///     PhantomObject::default(),
///     Mesh3d(meshes.add(Cuboid::new(0.12, 0.06, 0.07))),
///     Transform::from_xyz(-0.1, 0.03, 0.2),
/// ));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct PhantomObject {
    /// Whether the phantom casts shadows on virtual objects and other phantoms. Turn it off for supporting planes
    /// such as the desk: the light probe stands on them, so its map already contains their occlusion. Defaults to
    /// `true`.
    pub casts: bool,
    /// Whether the phantom receives shadows of virtual objects. Turn it off for mirrors such as the probe ball.
    /// Defaults to `true`.
    pub receives: bool,
    /// Diffuse reflectance of the matte surface if it is known, linear RGB, each channel above 0 and at most 1. The
    /// brightness of the surface then measures absolute irradiance, which the recovery of clipped lamps uses
    /// ([`lighting`](crate::lighting)). A folded sheet of office paper (`Vec3::splat(0.8)`) with faces towards
    /// different lamps separates their contributions. Values out of range are ignored with a warning. Defaults to
    /// `None`, unknown.
    pub reflectance: Option<Vec3>,
}

impl Default for PhantomObject {
    fn default() -> Self {
        Self { casts: true, receives: true, reflectance: None }
    }
}

/// Role of a mesh, real or virtual. Kept up to date on every mesh entity.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::phantom::StageRole;
/// fn count_virtual(roles: Query<&StageRole>) {
///     info!("{} virtual meshes", roles.iter().filter(|role| **role == StageRole::Virtual).count());
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub enum StageRole {
    /// Virtual object: it is visible, and casts and receives shadows.
    Virtual,
    /// Stand-in for a real object, with the settings of the [`PhantomObject`] on the entity or its nearest ancestor.
    Phantom(PhantomObject),
}

/// Assigns a [`StageRole`] to every mesh.
pub struct PhantomPlugin;

impl Plugin for PhantomPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.add_systems(PostUpdate, assign_roles.in_set(MirrorballSystems::Assign));
    }
}

/// Returns a component of the entity itself or of its nearest ancestor that has it.
pub(crate) fn nearest<'w, C: Component>(
    entity: Entity,
    parents: &Query<&ChildOf>,
    components: &'w Query<&C>,
) -> Option<&'w C> {
    std::iter::once(entity).chain(parents.iter_ancestors(entity)).find_map(|ancestor| components.get(ancestor).ok())
}

type NewOrMoved = (With<Mesh3d>, Or<(Added<Mesh3d>, Changed<ChildOf>)>);

fn assign_roles(
    mut commands: Commands,
    meshes: Query<(Entity, Option<&StageRole>), With<Mesh3d>>,
    fresh: Query<(), NewOrMoved>,
    changed: Query<(), Changed<PhantomObject>>,
    mut removed: RemovedComponents<PhantomObject>,
    parents: Query<&ChildOf>,
    phantoms: Query<&PhantomObject>,
) {
    if fresh.is_empty() && changed.is_empty() && removed.read().count() == 0 {
        return;
    }
    for (mesh, role) in &meshes {
        let wanted = nearest(mesh, &parents, &phantoms).map_or(StageRole::Virtual, |p| StageRole::Phantom(*p));
        if role != Some(&wanted) {
            commands.entity(mesh).insert(wanted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_below_a_phantom_are_phantoms_until_it_is_removed() {
        let mut app = App::new();
        app.add_plugins(PhantomPlugin);
        let root = app.world_mut().spawn(PhantomObject { casts: false, ..default() }).id();
        let below = app.world_mut().spawn((Mesh3d::default(), ChildOf(root))).id();
        let beside = app.world_mut().spawn(Mesh3d::default()).id();
        app.update();
        let role = |app: &App, entity| app.world().get::<StageRole>(entity).copied();
        assert_eq!(role(&app, below), Some(StageRole::Phantom(PhantomObject { casts: false, ..default() })));
        assert_eq!(role(&app, beside), Some(StageRole::Virtual));
        app.world_mut().entity_mut(root).remove::<PhantomObject>();
        app.update();
        assert_eq!(role(&app, below), Some(StageRole::Virtual));
    }
}
