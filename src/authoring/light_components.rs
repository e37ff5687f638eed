//! Light probes and domes in extras.

use super::{
    component::{FromExtras, choice},
    fields::Fields,
    number_rules::{Positive, Whole},
    rules::{Flag, Word},
};
use crate::{
    probe::{BallSurface, ClipEvidence, ClipRecovery, LightProbeSphere},
    shadows::{DomeCoverage, ShadowDomeLight, ShadowFilter, VisibilitySamples},
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
