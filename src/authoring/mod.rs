//! Authoring: components from glTF extras.
//!
//! **Enters:** glTF scenes whose nodes have *extras* (custom properties in Blender and other tools) named after this
//! crate's components. **Leaves:** those components on the spawned entities, and an [`AuthoringReport`] of all
//! mistakes. Artists can thus author the whole set in the modeling tool: where the marker lies, where the ball stands,
//! and which meshes represent real objects.
//!
//! | extras of a node | component |
//! |---|---|
//! | `{"MarkerAnchor": {"id": 0, "size": 0.1, "family": "tag36h11"}}` | [`MarkerAnchor`]; `id` and `size` are mandatory |
//! | `{"MarkerBoard": {"grid": {"columns": 3, "rows": 2, "spacing": 0.13}}}`, see [below](self#boards) | [`MarkerBoard`], beside a `MarkerAnchor` |
//! | `{"PoseFilter": {"filter": "Live", "min_cutoff": 1, "lost_after": 0.5}}`, all its fields, times in seconds | [`PoseFilter`], beside a `MarkerAnchor` |
//! | `{"WorldOrigin": {}}` | [`WorldOrigin`] |
//! | `{"VirtualButton": {"width": 0.06, "height": 0.04}}`, in meters | [`VirtualButton`], below a `MarkerAnchor` |
//! | `{"LightProbeSphere": {"radius": 0.05, "reflectance": 0.9, "surface": "Mirror"}}` | [`LightProbeSphere`]; or `"Dielectric"` |
//! | `{"ClipRecovery": {"is_enabled": true, "paper_reflectance": 0.8, "max_gain": 1000, "evidence": "Desk"}}` | [`ClipRecovery`], beside a `LightProbeSphere`; or `"Paper"` |
//! | `{"PhantomObject": {"casts": true, "receives": true, "reflectance": 0.8}}` | [`PhantomObject`]; the reflectance is optional and may be `[r, g, b]`, linear |
//! | `{"ShadowDomeLight": {"directions": 64, "filter": "Gauss"}}`, all its fields | [`ShadowDomeLight`] |
//! | `{"PlanarShadow": {"half_size": [0.8, 0.6], "lights": 3, "casters": "Virtual", "samples": 25, "ambient": 32, "resolution": 512, "strength": 1, "offset": 0.001}}` | [`PlanarShadow`](crate::shadows::PlanarShadow) in the plane of the node's x and z; or `"All"` |
//! | `{"SurfaceStyle": "Toon"}`, `"Classic"`, `"ImageBased"` or `"Engine"` | [`SurfaceStyle`] of the node and its descendants |
//! | `{"SurfaceStyle": {"Toon": {"bands": 4, "key": "StrongestRealLight", "softness": 0, "highlight": true, "rim": 0, "outline_width": 2, "outline_meters": 0, "outline_color": "#000000"}}}`; `"key": "Direction"` with `"key_direction": [0, 1, 0]`; `"model": "Phong"` with `"diffuse"`, `"specular"` and `"exponent"` | the same with details |
//! | `{"SurfaceStyle": {"Classic": {"model": "Combined", "specular": 0.5, "exponent": 50, "fresnel": 0.04}}}`, or `"GlossMap"`, `"Mixed"` or `"SphereMap"`, each with its coefficients | the same; all fields of [`ClassicStyle`](crate::materials::ClassicStyle) |
//! | `{"StyleFade": {"seconds": 0.5}}`, 0…60 | [`StyleFade`](crate::materials::StyleFade) of the node and its descendants |
//! | `{"MeasuredLightWeight": {"weight": 0.2}}`, 0…1 | [`MeasuredLightWeight`](crate::materials::MeasuredLightWeight) of the node and its descendants |
//!
//! One node may have several components. Omitted fields take the component's default. The tag family is optional;
//! [`MarkerFamily`] lists them. Colors are sRGB. Lengths are in meters, in the node's own frame of reference; the
//! node's scale is not applied.
//!
//! # Boards
//! The further markers of a [`MarkerBoard`] are given by a layout with the constructors' names, or one by one. Family
//! and size are those of the anchor unless said otherwise:
//!
//! | field of `MarkerBoard` | markers |
//! |---|---|
//! | `"grid": {"columns": 3, "rows": 2, "spacing": 0.13}` | [`MarkerBoard::grid`] |
//! | `"around_ball": {"x": 0.17, "z": 0.01, "radius": 0.05}` | [`MarkerBoard::around_ball`] |
//! | `"box_sides": {"box_size": [0.2, 0.12, 0.15], "size": 0.08}` | [`MarkerBoard::box_sides`]; `size` is optional |
//! | `"markers": [{"id": 5, "position": [0.13, 0, 0]}, …]` | each with its `id` and `position`, optionally `size`, `family` and `rotation_degrees` |
//!
//! A `position` is in the frame of the anchor's marker: +x to the right, +y out of the paper, +z to the bottom edge, as
//! in the exported file (Blender's own axes are others: its z is y here, its y is −z). `rotation_degrees` turns about
//! the fixed axes x, y and z, in this order; `[90, 0, 0]` faces the bottom edge, as the front of a box does. In
//! Blender the easiest property is a text with the whole object; see
//! [`parse_node_extras`].
//!
//! # Where they may stand
//! On nodes (objects in Blender), and on meshes (the data of an object), whose components go to every node that uses
//! the mesh; where the node has the same component, the node's counts. From a scene only `ShadowDomeLight`,
//! `SurfaceStyle`, `StyleFade` and `MeasuredLightWeight` are taken, which then apply to all of it. Other components on
//! a scene, and all on a material, give a warning.
//!
//! # What is checked
//! Unknown fields, values of the wrong type and values outside the documented range are errors. Their messages name
//! file, node, component, field, the value found and how to correct it. A component with an error is left out;
//! everything else is spawned. Extras with other names belong to other tools and are ignored; a name that resembles
//! that of a component gives a warning.
//!
//! # When
//! [`AuthoringPlugin`] reads new [`GltfExtras`] and their kin once per frame in `SpawnScene`, after Bevy has spawned
//! the scenes, so that the components exist before transforms are propagated in the same frame. Bevy puts the extras of
//! mesh primitives and lights on entities of their own; the same rules apply to them. Tools that check a file without
//! an app call [`read_scene_components`].
//!
//! # Adding a component
//! Add its name to the list and an implementation of `FromExtras` to one of the files `…_components.rs`. A component
//! can also be authored as a plain string, and be made of another one in the same extras, as boards are.
//!
//! [`GltfExtras`]: bevy::gltf::GltfExtras
//! [`MarkerAnchor`]: crate::tracking::MarkerAnchor
//! [`MarkerBoard`]: crate::tracking::MarkerBoard
//! [`MarkerBoard::grid`]: crate::tracking::MarkerBoard::grid
//! [`MarkerBoard::around_ball`]: crate::tracking::MarkerBoard::around_ball
//! [`MarkerBoard::box_sides`]: crate::tracking::MarkerBoard::box_sides
//! [`PoseFilter`]: crate::tracking::PoseFilter
//! [`ClipRecovery`]: crate::probe::ClipRecovery
//! [`MarkerFamily`]: crate::tracking::MarkerFamily
//! [`WorldOrigin`]: crate::tracking::WorldOrigin
//! [`VirtualButton`]: crate::tracking::VirtualButton
//! [`LightProbeSphere`]: crate::probe::LightProbeSphere
//! [`PhantomObject`]: crate::phantom::PhantomObject
//! [`ShadowDomeLight`]: crate::shadows::ShadowDomeLight
//! [`SurfaceStyle`]: crate::materials::SurfaceStyle

mod closest_name;
mod component;
mod error;
mod extras;
mod fields;
mod light_components;
mod marker_board;
mod marker_components;
mod number_rules;
mod rules;
mod scene_file;
mod spawned;
mod surface_components;

pub use component::AuthoredComponent;
pub use error::{AuthoringError, ExtrasError, ExtrasPlace, ExtrasProblem, ExtrasWarning, NodeContext};
pub use extras::{ParsedExtras, parse_node_extras};
pub use scene_file::{NodeComponents, read_scene_components};
pub use spawned::AuthoringReport;

use bevy::{
    app::{SceneSpawnerSystems, SpawnScene},
    prelude::*,
};

/// Inserts the components in the extras of spawned glTF nodes; see the [module](self).
///
/// ```
/// use bevy::{gltf::GltfExtras, prelude::*};
/// use bevy_mirrorball::{authoring::AuthoringPlugin, probe::LightProbeSphere};
///
/// let mut app = App::new();
/// app.add_plugins(AuthoringPlugin);
/// // Bevy does this for every node with extras in a glTF scene:
/// let ball = app.world_mut().spawn(GltfExtras { value: r#"{"LightProbeSphere": {"radius": 0.04}}"#.into() }).id();
/// app.update();
/// assert_eq!(app.world().get::<LightProbeSphere>(ball).map(|ball| ball.radius), Some(0.04));
/// ```
pub struct AuthoringPlugin;

impl Plugin for AuthoringPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<AuthoringReport>().add_systems(
            SpawnScene,
            (spawned::insert_authored_components, spawned::insert_mesh_components)
                .chain()
                .after(SceneSpawnerSystems::WorldInstanceSpawn)
                .after(SceneSpawnerSystems::SceneSpawn),
        );
    }
}
