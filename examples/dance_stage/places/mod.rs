//! Places to dance in without any camera: a stone circle in the evening, and the court of a university.
//!
//! A [`Place`] enters. Its scene, its lamps, and a camera with its sky as light and background leave. The scenes are in
//! meters and true to scale (`scripts/make_stonehenge.py`, `scripts/make_campus.py`), so the dancer is as tall as a
//! person here. Light comes from three sources, each counted once: the sky without its sun, by [`LiveEnvironment`]; the
//! sun, by a lamp of Bevy's that casts shadows; and the spot light of the scene, if it has one. Or all of it comes from
//! the room that a camera measures ([`room`]).

mod lamps;
mod room;
mod scenery;
mod sky;
mod view_point;

pub(crate) use scenery::Scenery;

use crate::{dancer::Dancer, support::asset_path};
use bevy::{asset::AssetPath, camera::ShadowLodOrigin, gltf::GltfLoaderSettings, prelude::*};
use bevy_mirrorball::prelude::*;
use std::path::PathBuf;

/// Ratio of a person's height to that of the dancer on a desk, 1.7 m to 15 cm.
const GROWTH: f32 = 1.7 / 0.15;

/// A place of its own, with sky and sun.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// The monument in the evening, moody and in natural colors.
    Stonehenge,
    /// A court between angular buildings by day, drawn as a toon.
    Campus,
}

impl Place {
    pub(crate) const ALL: [Self; 2] = [Self::Stonehenge, Self::Campus];

    /// Name on the command line, and of the thing whose style can be switched.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Stonehenge => "stonehenge",
            Self::Campus => "campus",
        }
    }

    /// The glTF file of the scene.
    pub(crate) fn file(self) -> PathBuf {
        asset_path(&format!("scenes/{}.glb", self.name()))
    }

    /// Style of the place and of who dances there.
    fn style(self) -> SurfaceStyle {
        match self {
            Self::Stonehenge => SurfaceStyle::ImageBased,
            Self::Campus => crate::stage::toon(),
        }
    }
}

/// Puts the dancer into a place, and lights it.
pub(crate) struct PlacePlugin {
    pub place: Place,
    /// Whether a room lights it.
    pub has_room: bool,
}

impl Plugin for PlacePlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.place)
            .add_systems(Update, (dress_dancers, lamps::choose_casters, view_point::fit_lenses));
        if self.has_room {
            app.add_systems(Update, (room::light_by_room, room::put_out_spots));
        } else {
            app.insert_resource(lamps::shadow_map()).add_systems(Update, (enlarge_dancers, lamps::prepare_spots));
        }
    }
}

/// Marks the root of a place's scene.
#[derive(Component)]
pub(crate) struct PlaceRoot;

/// Loads and spawns the scene of a place, on the desk of a room if there is one. Its cameras stay in the file: there is
/// one of the game's own.
pub(crate) fn spawn(
    world: &mut World,
    place: Place,
    scene: AssetPath<'static>,
    desk: Option<AssetPath<'static>>,
) -> Handle<WorldAsset> {
    let assets = world.resource::<AssetServer>().clone();
    let builder = assets.load_builder();
    let scene = builder.with_settings(|settings: &mut GltfLoaderSettings| settings.load_cameras = false).load(scene);
    let root = (PlaceRoot, ShadowLodOrigin, Name::new(place.name()), place.style(), WorldAssetRoot(scene.clone()));
    let mut root = world.spawn(root);
    if let Some(desk) = desk {
        root.insert(room::DESK_FROM_PLACE);
        room::spawn_desk(world, assets.load(desk));
    }
    scene
}

/// Lets dancers be as tall as a person.
fn enlarge_dancers(mut dancers: Query<&mut Transform, Added<Dancer>>) {
    for mut transform in &mut dancers {
        transform.scale *= GROWTH;
    }
}

/// Lets dancers stand on the ground, and be toons among toons.
fn dress_dancers(place: Res<Place>, mut dancers: Query<(&mut Transform, &mut SurfaceStyle), Added<Dancer>>) {
    for (mut transform, mut style) in &mut dancers {
        transform.translation = Vec3::ZERO;
        if let toon @ SurfaceStyle::Toon(_) = place.style() {
            *style = toon;
        }
    }
}
