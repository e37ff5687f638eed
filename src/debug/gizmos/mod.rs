//! Gizmos: what the crate knows of the real scene, as lines in the picture of every camera.

mod draw;

use bevy::{
    gizmos::{
        AppGizmoBuilder, GizmoPlugin,
        config::{GizmoConfig, GizmoConfigGroup, GizmoConfigStore},
    },
    light::LightPlugin,
    prelude::*,
};

use crate::MirrorballSystems;

/// Gizmos of this crate, a [`GizmoConfigGroup`]. Off until the game enables the group. Its fields choose what is drawn
/// then; all are `true` by default.
///
/// Lines are drawn over everything (`depth_bias` −1) by Bevy's gizmo renderer, which is among its default features
/// (`bevy_gizmos_render`). Without it nothing is drawn.
///
/// ```
/// # use bevy::prelude::*;
/// use bevy_mirrorball::debug::MirrorballGizmos;
///
/// fn toggle_gizmos(keys: Res<ButtonInput<KeyCode>>, mut store: ResMut<GizmoConfigStore>) {
///     if keys.just_pressed(KeyCode::KeyG) {
///         let (config, gizmos) = store.config_mut::<MirrorballGizmos>();
///         config.enabled ^= true;
///         gizmos.dome = false;
///     }
/// }
/// # bevy::ecs::system::assert_is_system(toggle_gizmos);
/// ```
#[derive(Reflect, GizmoConfigGroup, Clone, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct MirrorballGizmos {
    /// Squares and axes (x red, y green, z blue) of [`MarkerAnchor`](crate::tracking::MarkerAnchor)s, and squares of
    /// their [`MarkerBoard`](crate::tracking::MarkerBoard)s. Green: detected in the newest frame; yellow: held; gray:
    /// searched for; red: lost.
    pub markers: bool,
    /// Outlines of [`LightProbeSphere`](crate::probe::LightProbeSphere)s as each [`ArCamera`](crate::camera::ArCamera)
    /// sees them. They should surround the ball in the frame. Cyan while the ball is in view, otherwise gray.
    pub balls: bool,
    /// Arrows from [`RealLight`](crate::lighting::RealLight)s to the ball, in the light's color. The longer, the more
    /// light comes from it; labels have its number and its fraction of all light. Where the position of a light is
    /// known, a sphere is drawn there.
    pub lights: bool,
    /// Directions of the [`ShadowDomeLight`](crate::shadows::ShadowDomeLight) around all casters: from blue over red
    /// to yellow for those with the most light, gray as long as that is not read back from the GPU, which it is only
    /// while shadow maps have to be redrawn. Key lights are white.
    pub dome: bool,
    /// Bounding boxes of [`PhantomObject`](crate::phantom::PhantomObject)s, in magenta. They should surround the real
    /// things.
    pub phantoms: bool,
}

impl Default for MirrorballGizmos {
    fn default() -> Self {
        Self { markers: true, balls: true, lights: true, dome: true, phantoms: true }
    }
}

/// Draws [`MirrorballGizmos`] while that group is enabled. In a program without Bevy's [`GizmoPlugin`] it does nothing.
pub struct MirrorballGizmosPlugin;

impl Plugin for MirrorballGizmosPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        // With this crate in the program, lights have gizmos too. A game that picks its plugins one by one need not
        // know that.
        if app.is_plugin_added::<LightPlugin>() && !app.is_plugin_added::<GizmoPlugin>() {
            app.add_plugins(GizmoPlugin);
        }
        if !app.is_plugin_added::<GizmoPlugin>() {
            return;
        }
        let store = app.world().get_resource::<GizmoConfigStore>();
        // what the game has configured before stays
        if store.is_none_or(|store| store.get_config::<MirrorballGizmos>().is_none()) {
            let config = GizmoConfig { enabled: false, depth_bias: -1.0, ..default() };
            app.insert_gizmo_config(MirrorballGizmos::default(), config);
        }
        let draw = (draw::markers, draw::balls, draw::lights, draw::dome, draw::phantoms);
        app.add_systems(PostUpdate, draw.after(MirrorballSystems::Shade).run_if(are_enabled));
    }
}

fn are_enabled(store: Res<GizmoConfigStore>) -> bool {
    store.get_config::<MirrorballGizmos>().is_some_and(|(config, _)| config.enabled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::mesh::MeshPlugin;

    #[test]
    fn without_the_engines_gizmos_nothing_happens() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, MirrorballGizmosPlugin));
        app.finish();
        app.update();
        assert!(!app.world().contains_resource::<GizmoConfigStore>());
    }

    #[test]
    fn the_group_is_off_unless_the_game_has_said_otherwise() {
        let app = |before: fn(&mut App)| {
            let mut app = App::new();
            app.add_plugins((MinimalPlugins, AssetPlugin::default(), MeshPlugin, GizmoPlugin));
            before(&mut app);
            app.add_plugins(MirrorballGizmosPlugin);
            app.finish();
            app.update();
            let (config, group) = app.world().resource::<GizmoConfigStore>().config::<MirrorballGizmos>();
            (config.enabled, group.clone())
        };
        assert_eq!(app(|_| ()), (false, MirrorballGizmos::default()));
        let no_dome = MirrorballGizmos { dome: false, ..default() };
        let configured = app(|app| {
            app.insert_gizmo_config(MirrorballGizmos { dome: false, ..default() }, GizmoConfig::default());
        });
        assert_eq!(configured, (true, no_dome));
    }
}
