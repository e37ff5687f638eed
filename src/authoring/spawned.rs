//! Inserts components on newly spawned glTF nodes.

use super::{
    component::AuthoredComponent,
    error::{ExtrasError, ExtrasPlace, ExtrasWarning, NodeContext, in_lines},
    extras::{names_in, parse_node_extras},
};
use bevy::{
    ecs::system::SystemParam,
    gltf::{GltfExtras, GltfMaterialExtras, GltfMaterialName, GltfMeshExtras, GltfMeshName, GltfSceneExtras},
    prelude::*,
};

/// Errors and warnings of all glTF scenes spawned so far, for tools and tests that should fail on them.
///
/// Each mistake is listed and logged once, however often its scene is spawned.
///
/// ```
/// # use bevy::prelude::*;
/// use bevy_mirrorball::authoring::AuthoringReport;
///
/// fn refuse_faulty_sets(report: Res<AuthoringReport>, mut exit: MessageWriter<AppExit>) {
///     if !report.errors.is_empty() {
///         exit.write(AppExit::error());
///     }
/// }
/// # bevy::ecs::system::assert_is_system(refuse_faulty_sets);
/// ```
#[derive(Resource, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct AuthoringReport {
    /// Mistakes. The components concerned were left out.
    pub errors: Vec<ExtrasError>,
    /// Warnings about extras that are left alone and may have been meant.
    pub warnings: Vec<ExtrasWarning>,
}

impl AuthoringReport {
    /// Clears the report, so that the same mistakes are listed and logged again, for example after a reload.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// File name in messages about extras that do not come from a loaded scene.
const NO_FILE: &str = "(no file)";

/// The file that a spawned entity comes from.
#[derive(SystemParam)]
pub(super) struct SceneFiles<'w, 's> {
    parents: Query<'w, 's, &'static ChildOf>,
    scene_roots: Query<'w, 's, &'static WorldAssetRoot>,
    asset_server: Option<Res<'w, AssetServer>>,
}

impl SceneFiles<'_, '_> {
    fn of(&self, entity: Entity) -> String {
        std::iter::once(entity)
            .chain(self.parents.iter_ancestors(entity))
            .find_map(|ancestor| self.scene_roots.get(ancestor).ok())
            .and_then(|root| self.asset_server.as_ref()?.get_path(root.0.id()))
            .map_or_else(|| NO_FILE.into(), |path| path.without_label().to_string())
    }
}

impl AuthoringReport {
    /// Parses extras, and lists and logs what is wrong with them unless that has been done already.
    fn read(&mut self, json: &str, context: &NodeContext) -> Vec<AuthoredComponent> {
        let mut parsed = parse_node_extras(json, context);
        parsed.errors.retain(|error| !self.errors.contains(error));
        if !parsed.errors.is_empty() {
            error!("{}", in_lines(&parsed.errors));
            self.errors.append(&mut parsed.errors);
        }
        parsed.warnings.retain(|warning| !self.warnings.contains(warning));
        for warning in parsed.warnings {
            warn!("{warning}");
            self.warnings.push(warning);
        }
        parsed.components
    }
}

fn insert(commands: &mut Commands, entity: Entity, components: Vec<AuthoredComponent>) {
    if let Ok(mut entity) = commands.get_entity(entity) {
        for component in components {
            component.insert_into(&mut entity);
        }
    }
}

/// Reads the extras of scenes, materials and nodes that were added since the last run, and inserts their components.
pub(super) fn insert_authored_components(
    mut commands: Commands,
    nodes: Query<(Entity, &GltfExtras, Option<&Name>), Added<GltfExtras>>,
    scenes: Query<(Entity, &GltfSceneExtras, Option<&Name>), Added<GltfSceneExtras>>,
    materials: Query<(Entity, &GltfMaterialExtras, Option<&GltfMaterialName>), Added<GltfMaterialExtras>>,
    files: SceneFiles,
    mut report: ResMut<AuthoringReport>,
) {
    for (entity, extras, name) in &scenes {
        let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
        let context = NodeContext::at(ExtrasPlace::Scene, files.of(entity), name);
        let components = report.read(&extras.value, &context);
        insert(&mut commands, entity, components);
    }
    for (entity, extras, name) in &materials {
        let name = name.map_or_else(|| entity.to_string(), |name| name.0.clone());
        report.read(&extras.value, &NodeContext::at(ExtrasPlace::Material, files.of(entity), name));
    }
    for (entity, extras, name) in &nodes {
        let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
        let components = report.read(&extras.value, &NodeContext::new(files.of(entity), name));
        insert(&mut commands, entity, components);
    }
}

type Primitive = (Entity, &'static GltfMeshExtras, Option<&'static GltfMeshName>, Option<&'static ChildOf>);

/// Reads the extras of meshes. Bevy repeats them on each primitive, below the node that uses the mesh; their components
/// go to that node, unless it has its own.
pub(super) fn insert_mesh_components(
    mut commands: Commands,
    primitives: Query<Primitive, Added<GltfMeshExtras>>,
    nodes: Query<&GltfExtras>,
    files: SceneFiles,
    mut report: ResMut<AuthoringReport>,
) {
    let mut done = Vec::new();
    for (entity, extras, name, parent) in &primitives {
        let node = parent.map_or(entity, ChildOf::parent);
        if done.contains(&node) {
            continue;
        }
        done.push(node);
        let file = files.of(entity);
        let name = name.map_or_else(|| entity.to_string(), |name| name.0.clone());
        let mut components = report.read(&extras.value, &NodeContext::at(ExtrasPlace::Mesh, &*file, name));
        if let Ok(own) = nodes.get(node) {
            let own = names_in(&own.value);
            components.retain(|component| !own.contains(&component.name().to_owned()));
        }
        insert(&mut commands, node, components);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{authoring::AuthoringPlugin, materials::SurfaceStyle, phantom::PhantomObject, tracking::WorldOrigin};

    fn app() -> App {
        let mut app = App::new();
        app.add_plugins(AuthoringPlugin);
        app
    }

    fn extras(json: &str) -> GltfExtras {
        GltfExtras { value: json.into() }
    }

    #[test]
    fn a_faulty_component_is_left_out_and_the_rest_inserted() {
        let mut app = app();
        let json = r#"{"PhantomObject": {"casts": 1}, "WorldOrigin": {}, "Worldorigin": {}}"#;
        let node = app.world_mut().spawn((extras(json), Name::new("table"))).id();
        app.update();

        assert!(app.world().get::<WorldOrigin>(node).is_some());
        assert!(app.world().get::<PhantomObject>(node).is_none());
        let report = app.world().resource::<AuthoringReport>();
        assert_eq!((report.errors.len(), report.warnings.len()), (1, 1));
        assert_eq!(report.errors[0].context, NodeContext::new(NO_FILE, "table"));
        assert_eq!(report.warnings[0].meant, "WorldOrigin");
    }

    #[test]
    fn a_mistake_is_listed_once_until_the_report_is_cleared() {
        let mut app = app();
        let twin = || (extras(r#"{"WorldOrigin": 1, "worldorigin": 1}"#), Name::new("marker"));
        for _ in 0..2 {
            app.world_mut().spawn(twin());
            app.world_mut().spawn(twin());
            app.update();
            let report = app.world().resource::<AuthoringReport>();
            assert_eq!((report.errors.len(), report.warnings.len()), (1, 1));
        }
        app.world_mut().resource_mut::<AuthoringReport>().clear();
        app.world_mut().spawn(twin());
        app.update();
        assert_eq!(app.world().resource::<AuthoringReport>().errors.len(), 1);
    }

    #[test]
    fn components_of_a_mesh_go_to_every_node_that_uses_it() {
        let mut app = app();
        let mesh = || GltfMeshExtras { value: r#"{"PhantomObject": {"casts": false}, "WorldOrigin": {}}"#.into() };
        let plain = app.world_mut().spawn_empty().id();
        let own = app.world_mut().spawn(extras(r#"{"PhantomObject": {"receives": false}}"#)).id();
        for node in [plain, own] {
            for _ in 0..2 {
                app.world_mut().spawn((mesh(), GltfMeshName("Plane".into()), ChildOf(node)));
            }
        }
        app.update();
        let phantom = |app: &App, node| app.world().get::<PhantomObject>(node).copied();
        assert_eq!(phantom(&app, plain), Some(PhantomObject { casts: false, ..default() }));
        assert_eq!(phantom(&app, own), Some(PhantomObject { receives: false, ..default() }), "the node's own counts");
        assert!(app.world().get::<WorldOrigin>(own).is_some());
        assert_eq!(*app.world().resource::<AuthoringReport>(), AuthoringReport::default());
    }

    #[test]
    fn components_on_scenes_and_materials_are_taken_or_named() {
        let mut app = app();
        let value = r#"{"PhantomObject": {}, "SurfaceStyle": "Engine"}"#.to_owned();
        let scene = app.world_mut().spawn((GltfSceneExtras { value: value.clone() }, Name::new("Room"))).id();
        app.world_mut().spawn((GltfMaterialExtras { value }, GltfMaterialName("wood".into())));
        app.update();
        assert_eq!(app.world().get::<SurfaceStyle>(scene), Some(&SurfaceStyle::Engine));
        assert!(app.world().get::<PhantomObject>(scene).is_none());
        let report = app.world().resource::<AuthoringReport>();
        let named: Vec<_> = report.warnings.iter().map(|w| (w.context.place, &*w.context.node, w.meant)).collect();
        let expected = [
            (ExtrasPlace::Scene, "Room", "PhantomObject"),
            (ExtrasPlace::Material, "wood", "PhantomObject"),
            (ExtrasPlace::Material, "wood", "SurfaceStyle"),
        ];
        assert_eq!(named, expected);
    }

    #[test]
    fn what_the_game_changes_later_stays_changed() {
        let mut app = app();
        let node = app.world_mut().spawn(extras(r#"{"PhantomObject": {}}"#)).id();
        app.update();
        let changed = PhantomObject { casts: false, receives: false, ..default() };
        app.world_mut().entity_mut(node).insert(changed);
        app.update();
        assert_eq!(app.world().get::<PhantomObject>(node), Some(&changed));
    }
}
