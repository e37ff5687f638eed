//! Light probes, domes and planar shadows in extras.

use super::{
    component::{FromExtras, choice},
    fields::Fields,
    number_rules::{FromZero, Positive, Two, Whole},
    rules::{Flag, Word},
};
use crate::{
    probe::{BallSurface, ClipEvidence, ClipRecovery, LightProbeSphere},
    shadows::{
        DomeCoverage, PlanarCasters, PlanarLights, PlanarShadow, ShadowDomeLight, ShadowFilter, VisibilitySamples,
    },
};

impl FromExtras for LightProbeSphere {
    const EXAMPLE: &'static str = r#"{"radius": 0.05, "reflectance": 0.9, "surface": "Mirror"}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let default = Self::default();
        Some(Self {
            radius: fields.optional("radius", Positive::METERS).unwrap_or(default.radius),
            reflectance: fields.optional("reflectance", Positive::FRACTION).unwrap_or(default.reflectance),
            surface: match fields.optional("surface", Word(&["Mirror", "Dielectric"])) {
                Some("Dielectric") => BallSurface::Dielectric,
                _ => default.surface,
            },
        })
    }
}

impl FromExtras for ClipRecovery {
    const EXAMPLE: &'static str = r#"{"is_enabled": true, "paper_reflectance": 0.8, "evidence": "Desk"}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let default = Self::default();
        let evidence = [ClipEvidence::Desk, ClipEvidence::Paper];
        let gain = Positive { max: f32::MAX, unit: None };
        Some(Self {
            is_enabled: fields.optional("is_enabled", Flag).unwrap_or(default.is_enabled),
            paper_reflectance: fields
                .optional("paper_reflectance", Positive::FRACTION)
                .unwrap_or(default.paper_reflectance),
            max_gain: fields.optional("max_gain", gain).unwrap_or(default.max_gain),
            evidence: choice(fields, "evidence", &["Desk", "Paper"], &evidence).unwrap_or(default.evidence),
        })
    }
}

impl FromExtras for ShadowDomeLight {
    const EXAMPLE: &'static str = r#"{"directions": 64, "resolution": 256, "filter": "Gauss"}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        use {DomeCoverage as Coverage, ShadowFilter as Filter, VisibilitySamples as Samples};
        let default = Self::default();
        let all = Whole { min: 1, max: Self::MAX_DIRECTIONS };
        let coverages = [Coverage::Hemisphere, Coverage::Sphere];
        let samples = [Samples::Interleaved, Samples::Half, Samples::Full, Samples::Fragment];
        let soft = Filter::Pcss { angular_radius: 0.1 };
        let filters =
            [Filter::Nearest, Filter::Bilinear, Filter::Gauss, Filter::Pcf9, Filter::Pcf25, Filter::Pcf49, soft];
        let filter_names = &["Nearest", "Bilinear", "Gauss", "Pcf9", "Pcf25", "Pcf49", "Pcss"];
        let mut filter = choice(fields, "filter", filter_names, &filters).unwrap_or(default.filter);
        if let (Filter::Pcss { angular_radius }, Some(given)) =
            (&mut filter, fields.optional("angular_radius", Positive::RADIANS))
        {
            *angular_radius = given;
        }
        Some(Self {
            directions: fields.optional("directions", all).unwrap_or(default.directions),
            coverage: choice(fields, "coverage", &["Hemisphere", "Sphere"], &coverages).unwrap_or(default.coverage),
            key_lights: fields
                .optional("key_lights", Whole { min: 0, max: Self::MAX_KEY_LIGHTS })
                .unwrap_or(default.key_lights),
            resolution: fields.optional("resolution", Whole { min: 32, max: 1024 }).unwrap_or(default.resolution),
            filter,
            samples: choice(fields, "samples", &["Interleaved", "Half", "Full", "Fragment"], &samples)
                .unwrap_or(default.samples),
            refreshed_per_frame: fields
                .optional("refreshed_per_frame", Whole { min: 1, max: Self::MAX_DIRECTIONS })
                .unwrap_or(default.refreshed_per_frame),
            surfels: fields.optional("surfels", Whole { min: 0, max: Self::MAX_SURFELS }).unwrap_or(default.surfels),
            dim_share: fields.optional("dim_share", Positive::FRACTION).unwrap_or(default.dim_share),
            occludes_reflections: fields.optional("occludes_reflections", Flag).unwrap_or(default.occludes_reflections),
        })
    }
}

impl FromExtras for PlanarShadow {
    const EXAMPLE: &'static str = r#"{"half_size": [0.8, 0.6], "lights": 3, "samples": 25}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let default = Self::default();
        let casters = [PlanarCasters::Virtual, PlanarCasters::All];
        Some(Self {
            half_size: fields.optional("half_size", Two(Positive::METERS)).unwrap_or(default.half_size),
            lights: fields
                .optional("lights", Whole { min: 1, max: PlanarLights::MAX })
                .map_or(default.lights, PlanarLights::Real),
            casters: choice(fields, "casters", &["Virtual", "All"], &casters).unwrap_or(default.casters),
            samples: fields.optional("samples", Whole { min: 1, max: Self::MAX_SAMPLES }).unwrap_or(default.samples),
            ambient: fields.optional("ambient", Whole { min: 0, max: Self::MAX_AMBIENT }).unwrap_or(default.ambient),
            resolution: fields
                .optional("resolution", Whole { min: Self::RESOLUTIONS[0], max: Self::RESOLUTIONS[1] })
                .unwrap_or(default.resolution),
            strength: fields.optional("strength", Positive::FRACTION).unwrap_or(default.strength),
            offset: fields.optional("offset", FromZero { max: f32::MAX, unit: "meters" }).unwrap_or(default.offset),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authoring::component::read_value;
    use bevy::math::Vec2;
    use serde_json::{Map, json};

    #[test]
    fn planar_shadows_are_read_with_all_their_fields() {
        let all = json!({"half_size": [0.8, 0.6], "lights": 2, "casters": "All", "samples": 1, "ambient": 0,
            "resolution": 256, "strength": 0.5, "offset": 0.002});
        let expected = PlanarShadow {
            half_size: Vec2::new(0.8, 0.6),
            lights: PlanarLights::Real(2),
            casters: PlanarCasters::All,
            samples: 1,
            ambient: 0,
            resolution: 256,
            strength: 0.5,
            offset: 0.002,
        };
        let read = |value| read_value::<PlanarShadow>("PlanarShadow", &value, &Map::new());
        assert_eq!(read(all), Ok(expected));
        assert_eq!(read(json!({})), Ok(PlanarShadow::default()));
        for wrong in [json!({"half_size": 0.8}), json!({"half_size": [0.8, 0]}), json!({"lights": 17})] {
            let problems = read(wrong).expect_err("a mistake");
            assert_eq!(problems.len(), 1, "{problems:?}");
        }
    }
}
