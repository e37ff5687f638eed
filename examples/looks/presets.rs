//! Looks to start from, one for each thing that the styles can do.

use crate::{
    look::Look,
    ramps::{Ramp, Ramps},
};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Names of all looks, in the order of the gallery.
pub(crate) const NAMES: [&str; 18] = [
    "image-based",
    "engine",
    "gloss map",
    "combined",
    "mixed",
    "lamps",
    "glass",
    "bubble",
    "sphere map",
    "toon",
    "ink",
    "soft",
    "ramps",
    "phong",
    "key",
    "anime",
    "cool to warm",
    "two tone",
];

/// Returns all looks with their names, in the order of the gallery.
pub(crate) fn all() -> impl Iterator<Item = (&'static str, Look)> {
    NAMES.into_iter().filter_map(|name| Some((name, named(name)?)))
}

/// Returns the look of a name.
pub(crate) fn named(name: &str) -> Option<Look> {
    let brown = Color::srgb(0.20, 0.09, 0.06);
    let toon = |toon: ToonStyle| Look { style: SurfaceStyle::Toon(toon), ..default() };
    let classic = |classic: ClassicStyle| Look { style: SurfaceStyle::Classic(classic), ..default() };
    Some(match name {
        // The light of the room, with its shadows.
        "image-based" => Look::default(),
        // The same without shadows on it.
        "engine" => Look { style: SurfaceStyle::Engine, ..default() },
        // The alpha of a texture says where a surface mirrors.
        "gloss map" => classic(ClassicStyle { model: ClassicModel::GlossMap, roughness: Some(0.05), ..default() }),
        // Plastic: diffuse light, a highlight of the strongest lamp, a reflection at grazing angles.
        "combined" => classic(ClassicStyle {
            model: ClassicModel::Combined(CombinedModel { specular: 0.8, reflection: 0.6, ..default() }),
            roughness: Some(0.1),
            fresnel: Some(0.04),
            ..default()
        }),
        // Half of a mirror over paint.
        "mixed" => classic(ClassicStyle {
            model: ClassicModel::Mixed(MixedModel { base: 0.7, diffuse: 0.9, mirror: 0.3 }),
            roughness: Some(0.0),
            ..default()
        }),
        // Lacquer that mirrors lamps and windows only.
        "lamps" => classic(ClassicStyle {
            model: ClassicModel::Combined(CombinedModel { specular: 0.0, reflection: 0.6, ..default() }),
            roughness: Some(0.0),
            reflection_threshold: 0.7,
            ..default()
        }),
        // The room, seen through the surface.
        "glass" => classic(ClassicStyle {
            model: ClassicModel::Combined(CombinedModel {
                diffuse: 0.15,
                specular: 1.5,
                reflection: 0.9,
                exponent: 150.0,
                ..default()
            }),
            roughness: Some(0.0),
            refraction: Some(0.67),
            ..default()
        }),
        // The same through a thin film, with a tint.
        "bubble" => classic(ClassicStyle {
            model: ClassicModel::Combined(CombinedModel { diffuse: 0.3, specular: 1.0, reflection: 0.8, ..default() }),
            roughness: Some(0.0),
            refraction: Some(0.95),
            ..default()
        }),
        // Straight from the ball in the picture.
        "sphere map" => classic(ClassicStyle {
            model: ClassicModel::SphereMap(SphereMapModel { diffuse: 1.0, mirror: 0.3 }),
            ..default()
        }),
        // Three steps of the room's light.
        "toon" => toon(ToonStyle::default()),
        // Two steps, and a thick line.
        "ink" => toon(ToonStyle { bands: 2, highlight: false, outline_width: 3.0, ..default() }),
        // Gradients, light from behind, and a brown line that is thinner with distance.
        "soft" => toon(ToonStyle {
            bands: 4,
            softness: 0.8,
            rim: 0.8,
            outline_width: 0.0,
            outline_meters: 0.001,
            outline_color: brown,
            ..default()
        }),
        // Colors of an artist instead of the room's.
        "ramps" => Look { ramps: Ramps { diffuse: Some(Ramp::Dusk), specular: None }, ..toon(default()) },
        // The room says where the light is, the artist all the rest.
        "phong" => Look {
            ramps: Ramps { diffuse: Some(Ramp::Comic), specular: Some(Ramp::Ring) },
            ..toon(ToonStyle {
                model: ToonModel::Phong(PhongToon { diffuse: 1.2, specular: 0.6, exponent: 12.0 }),
                key: ToonKey::StrongestRealLight,
                ..default()
            })
        },
        // Light from a direction that the artist has chosen.
        "key" => toon(ToonStyle {
            bands: 2,
            key: ToonKey::Direction(Vec3::new(-0.8, 0.5, -0.4)),
            outline_width: 3.0,
            ..default()
        }),
        // As in today's anime games: a cool shadow, a warm line where it begins, light from behind.
        "anime" => Look {
            ramps: Ramps { diffuse: Some(Ramp::Anime), specular: None },
            ..toon(ToonStyle {
                key: ToonKey::StrongestRealLight,
                rim: 0.5,
                outline_width: 1.2,
                outline_color: brown,
                ..default()
            })
        },
        // As of Gooch et al. (1998): shades of technical illustrations, from cool to warm.
        "cool to warm" => Look {
            ramps: Ramps { diffuse: Some(Ramp::CoolToWarm), specular: None },
            ..toon(ToonStyle { key: ToonKey::StrongestRealLight, outline_width: 1.5, ..default() })
        },
        // As of Lake et al. (2000): light or shadow, and nothing between.
        "two tone" => Look {
            ramps: Ramps { diffuse: Some(Ramp::TwoTone), specular: None },
            ..toon(ToonStyle {
                model: ToonModel::Phong(PhongToon { specular: 0.0, ..default() }),
                key: ToonKey::StrongestRealLight,
                ..default()
            })
        },
        _ => return None,
    })
}
