//! Order of the stages within a frame.

use crate::device;
use bevy::{
    asset::io::embedded::EmbeddedAssetRegistry,
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        RenderApp,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

/// Stages of one frame, in this order.
///
/// Deferred commands of a stage are applied before the next one runs.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballSystems {
    /// `PreUpdate`: feeds are opened, and the newest frame of each is received ([`camera`](crate::camera)). Where
    /// markers are tracked, the frame waits for its pose.
    Poll,
    /// `PreUpdate`: markers are detected, the camera or the anchors move, and the frame in which they were detected is
    /// released ([`tracking`](crate::tracking)).
    Track,
    /// `PreUpdate`: textures and projections are matched to the frame that is shown ([`camera`](crate::camera)).
    Show,
    /// `PreUpdate`: new probes and cameras get the environment cube ([`probe`](crate::probe)).
    Allocate,
    /// `PreUpdate`: maps and lights are matched to the sources of environments ([`prefilter`](crate::prefilter)).
    Follow,
    /// `PostUpdate`: meshes are marked as phantoms or virtual ([`phantom`](crate::phantom)).
    Assign,
    /// `PostUpdate`: materials are matched to roles and styles ([`materials`](crate::materials)). They read no light
    /// here, and what they spawn has to exist before Bevy checks visibility and collects changed assets, so they come
    /// first.
    Dress,
    /// `PostUpdate`, after transform propagation: probes are measured, which depends on poses
    /// ([`probe`](crate::probe)).
    Measure,
    /// `PostUpdate`: clipped light is recovered, lights are detected and tracked ([`lighting`](crate::lighting)).
    Light,
    /// `PostUpdate`: the dome and its key lights are matched to casters and lights ([`shadows`](crate::shadows)).
    Shade,
}

/// Sets of passes in the render graph, in this order, for other passes to be ordered by. All run before the cameras'
/// own passes.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballPasses {
    /// Environment cubes are written ([`unwrap`](crate::unwrap)).
    WriteCubes,
    /// Environment cubes are read: maps are filtered ([`prefilter`](crate::prefilter)), and the directions of the
    /// dome get their weights ([`shadows`](crate::shadows)).
    ReadCubes,
}

/// What is said when the plugins are added in another order.
const RIGHT_ORDER: &str =
    "add Bevy's plugins first, then this crate's: app.add_plugins((DefaultPlugins, MirrorballPlugins))";

/// Panics with the right order if a plugin that needs assets when it is built is added before Bevy's.
pub(crate) fn require_assets(app: &App, plugin: &str) {
    let has_assets = app.world().contains_resource::<EmbeddedAssetRegistry>();
    assert!(has_assets, "{plugin} was added before Bevy's AssetPlugin: {RIGHT_ORDER}");
}

/// Panics with the right order if the renderer was added after the first plugin of this crate, which would then not
/// draw.
struct OrderCheck {
    had_renderer: bool,
}

impl Plugin for OrderCheck {
    fn build(&self, _: &mut App) {}

    fn finish(&self, app: &mut App) {
        let is_late = !self.had_renderer && app.get_sub_app(RenderApp).is_some();
        assert!(!is_late, "a plugin of bevy_mirrorball was added before Bevy's RenderPlugin: {RIGHT_ORDER}");
    }
}

/// Orders the sets of a frame, and notices when the graphics device is lost. Every plugin that uses a set calls this,
/// so that each plugin can be used alone.
pub(crate) fn configure(app: &mut App) {
    use MirrorballSystems::{Allocate, Assign, Dress, Follow, Light, Measure, Poll, Shade, Show, Track};
    device::notice_loss(app);
    app.configure_sets(PreUpdate, (Poll, Track, Show, Allocate, Follow).chain())
        .configure_sets(PostUpdate, (Assign, Dress, Measure, Light, Shade).chain())
        .configure_sets(PostUpdate, (Measure, Light, Shade).after(TransformSystems::Propagate));
    if !app.is_plugin_added::<OrderCheck>() {
        let had_renderer = app.get_sub_app(RenderApp).is_some();
        app.add_plugins(OrderCheck { had_renderer });
    }
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        let passes = (MirrorballPasses::WriteCubes, MirrorballPasses::ReadCubes).chain();
        render_app.configure_sets(RenderGraph, passes.in_set(RenderGraphSystems::Render).before(camera_driver));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{camera::CameraPlugin, materials::MaterialsPlugin, shadows::ShadowsPlugin};
    use bevy::app::SubApp;

    #[test]
    #[should_panic(expected = "ShadowsPlugin was added before Bevy's AssetPlugin: add Bevy's plugins first")]
    fn shadows_before_the_engine_say_the_right_order() {
        App::new().add_plugins(ShadowsPlugin);
    }

    #[test]
    #[should_panic(expected = "add Bevy's plugins first, then this crate's: app.add_plugins((DefaultPlugins, Mirror")]
    fn materials_before_the_engine_say_the_right_order() {
        App::new().add_plugins(MaterialsPlugin);
    }

    #[test]
    #[should_panic(expected = "before Bevy's RenderPlugin: add Bevy's plugins first")]
    fn cameras_before_the_renderer_say_the_right_order() {
        let mut app = App::new();
        app.add_plugins(CameraPlugin);
        app.insert_sub_app(RenderApp, SubApp::new());
        app.finish();
    }

    #[test]
    fn a_program_without_a_renderer_needs_none() {
        let mut app = App::new();
        app.add_plugins(CameraPlugin);
        app.finish();
    }
}
