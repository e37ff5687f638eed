//! Inserts components on newly spawned glTF nodes.

use super::{
    error::{ExtrasError, ExtrasWarning, NodeContext, in_lines},
    extras::parse_node_extras,
};
use bevy::{gltf::GltfExtras, prelude::*};

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
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct AuthoringReport {
    /// Mistakes. The components concerned were left out.
    pub errors: Vec<ExtrasError>,
    /// Warnings about extras whose names resemble those of components.
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

/// Reads the extras that were added since the last run and inserts their components.
pub(super) fn insert_authored_components(
    mut commands: Commands,
    spawned: Query<(Entity, &GltfExtras, Option<&Name>), Added<GltfExtras>>,
    parents: Query<&ChildOf>,
    scene_roots: Query<&WorldAssetRoot>,
    asset_server: Option<Res<AssetServer>>,
    mut report: ResMut<AuthoringReport>,
) {
    for (entity, extras, name) in &spawned {
        let file = std::iter::once(entity)
            .chain(parents.iter_ancestors(entity))
            .find_map(|ancestor| scene_roots.get(ancestor).ok())
            .and_then(|root| asset_server.as_ref()?.get_path(root.0.id()))
            .map_or_else(|| NO_FILE.into(), |path| path.without_label().to_string());
        let node = name.map_or_else(|| entity.to_string(), ToString::to_string);
        let mut parsed = parse_node_extras(&extras.value, &NodeContext::new(file, node));

        parsed.errors.retain(|error| !report.errors.contains(error));
        if !parsed.errors.is_empty() {
            error!("{}", in_lines(&parsed.errors));
            report.errors.append(&mut parsed.errors);
        }
        parsed.warnings.retain(|warning| !report.warnings.contains(warning));
        for warning in parsed.warnings {
            warn!("{warning}");
            report.warnings.push(warning);
        }
        if let Ok(mut entity) = commands.get_entity(entity) {
            for component in parsed.components {
                component.insert_into(&mut entity);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{authoring::AuthoringPlugin, phantom::PhantomObject, tracking::WorldOrigin};

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
