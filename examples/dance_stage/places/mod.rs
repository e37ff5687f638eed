//! Places to dance in without any camera: a stone circle in the evening, and the court of a university.
//!
//! A [`Place`] enters. Its scene, its lamps, and a camera with its sky as light and background leave. The scenes are in
//! meters and true to scale (`scripts/make_stonehenge.py`, `scripts/make_campus.py`), so the dancer is as tall as a
//! person here. Light comes from three sources, each counted once: the sky without its sun, by [`LiveEnvironment`]; the
//! sun, by a lamp of Bevy's that casts shadows; and the spot light of the scene, if it has one.

mod lamps;
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
pub(crate) struct PlacePlugin(pub Place);

impl Plugin for PlacePlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.0).insert_resource(lamps::shadow_map()).add_systems(
            Update,
            (enlarge_dancers, lamps::choose_casters, lamps::prepare_spots, view_point::fit_lenses),
        );
    }
}

/// Marks the root of a place's scene.
#[derive(Component)]
pub(crate) struct PlaceRoot;

/// Loads and spawns the scene of a place. Its cameras stay in the file: there is one of the game's own.
pub(crate) fn spawn(world: &mut World, place: Place, scene: AssetPath<'static>) -> Handle<WorldAsset> {
    let builder = world.resource::<AssetServer>().load_builder();
    let scene = builder.with_settings(|settings: &mut GltfLoaderSettings| settings.load_cameras = false).load(scene);
    world.spawn((PlaceRoot, ShadowLodOrigin, Name::new(place.name()), place.style(), WorldAssetRoot(scene.clone())));
    scene
}

/// Lets dancers be as tall as a person, stand on the ground, and be toons among toons.
fn enlarge_dancers(place: Res<Place>, mut dancers: Query<(&mut Transform, &mut SurfaceStyle), Added<Dancer>>) {
    for (mut transform, mut style) in &mut dancers {
        *transform = Transform::from_scale(Vec3::splat(GROWTH));
        if let toon @ SurfaceStyle::Toon(_) = place.style() {
            *style = toon;
        }
    }
}
