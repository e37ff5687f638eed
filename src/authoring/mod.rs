//! glTF extras → components.
//!
//! **Enters:** glTF scenes whose nodes carry *extras* (custom properties in Blender and other tools) named like this
//! crate's components. **Leaves:** those components on the spawned entities, and an [`AuthoringReport`] of what was wrong.
//! An artist so authors the whole set in the modeling tool: where the marker lies, where the ball stands, which meshes
//! stand for real things.
//!
//! | extras of a node | component |
//! |---|---|
//! | `{"MarkerAnchor": {"id": 0, "size": 0.1, "family": "tag36h11"}}` | [`MarkerAnchor`]; `id` and `size` are mandatory |
//! | `{"WorldOrigin": {}}` | [`WorldOrigin`] |
//! | `{"LightProbeSphere": {"radius": 0.05, "reflectance": 0.9, "surface": "Mirror"}}` | [`LightProbeSphere`]; or `"Dielectric"` |
//! | `{"PhantomObject": {"casts": true, "receives": true, "reflectance": 0.8}}` | [`PhantomObject`]; the reflectance, where known, may be `[r, g, b]`, linear |
//! | `{"ShadowDomeLight": {"directions": 64, "filter": "Gauss"}}`, all its fields | [`ShadowDomeLight`] |
//! | `{"SurfaceStyle": "Toon"}`, `"ImageBased"` or `"Engine"` | [`SurfaceStyle`] of the node and all below it |
//! | `{"SurfaceStyle": {"Toon": {"bands": 4, "highlight": true, "outline_width": 2, "outline_color": "#000000"}}}` | the same with details |
//!
//! One node may have several. A field that is left out takes the component's default; the tag family is optional and only
//! `tag36h11` is accepted. Colors are sRGB. Lengths are in metres, in the node's own frame of reference: the node's scale is
//! not applied.
//!
//! # What is checked
//! Unknown fields, values of the wrong type and values outside the documented range are errors that name file, node,
//! component, field, what was found and what to do. The component with the error is left out, everything else is spawned. Extras
//! with other names belong to other tools and are left alone; one that is nearly a component's name gives a warning.
//!
//! # When
//! [`AuthoringPlugin`] looks at new [`GltfExtras`] once a frame in `SpawnScene`, after Bevy has spawned the scenes: the
//! components are there before transforms are propagated in the same frame. Bevy puts the extras of mesh primitives and
//! lights on entities of their own; they are read by the same rules. Tools that want to check a file without an app call
//! [`read_scene_components`], which sees the extras of nodes.
//!
//! # Adding a component
//! One name in the list and one `FromExtras` block in `component.rs`. A component may also be written as a plain string.
//!
//! [`GltfExtras`]: bevy::gltf::GltfExtras
//! [`MarkerAnchor`]: crate::tracking::MarkerAnchor
//! [`WorldOrigin`]: crate::tracking::WorldOrigin
//! [`LightProbeSphere`]: crate::probe::LightProbeSphere
//! [`PhantomObject`]: crate::phantom::PhantomObject
//! [`ShadowDomeLight`]: crate::shadows::ShadowDomeLight
//! [`SurfaceStyle`]: crate::materials::SurfaceStyle

mod closest_name;
mod component;
mod error;
mod extras;
mod fields;
mod rules;
mod scene_file;
mod spawned;

pub use component::AuthoredComponent;
pub use error::{AuthoringError, ExtrasError, ExtrasProblem, ExtrasWarning, NodeContext};
pub use extras::{ParsedExtras, parse_node_extras};
pub use scene_file::{NodeComponents, read_scene_components};
pub use spawned::AuthoringReport;

use bevy::{
    app::{SceneSpawnerSystems, SpawnScene},
    prelude::*,
};

/// Turns the extras of spawned glTF nodes into components; see the [module](self).
///
/// ```
/// use bevy::{gltf::GltfExtras, prelude::*};
/// use bevy_mirrorball::{authoring::AuthoringPlugin, probe::LightProbeSphere};
///
/// let mut app = App::new();
/// app.add_plugins(AuthoringPlugin);
/// // Bevy does this for every node of a glTF scene:
/// let ball = app.world_mut().spawn(GltfExtras { value: r#"{"LightProbeSphere": {"radius": 0.04}}"#.into() }).id();
/// app.update();
/// assert_eq!(app.world().get::<LightProbeSphere>(ball).map(|ball| ball.radius), Some(0.04));
/// ```
pub struct AuthoringPlugin;

impl Plugin for AuthoringPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<AuthoringReport>().add_systems(
            SpawnScene,
            spawned::insert_authored_components
                .after(SceneSpawnerSystems::WorldInstanceSpawn)
                .after(SceneSpawnerSystems::SceneSpawn),
        );
    }
}
