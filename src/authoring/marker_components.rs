//! Markers in extras, and the filter of their poses.

use super::{
    component::{FromExtras, choice},
    fields::Fields,
    number_rules::{FromZero, Positive, Whole},
    rules::Flag,
};
use crate::tracking::{FilterUse, MarkerAnchor, MarkerFamily, PoseFilter, VirtualButton, WorldOrigin};
use bevy::math::Vec2;
use std::time::Duration;

/// Names of the marker families.
pub(super) const FAMILIES: [&str; MarkerFamily::ALL.len()] = {
    let mut names = [""; MarkerFamily::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = MarkerFamily::ALL[i].name();
        i += 1;
    }
    names
};

impl FromExtras for MarkerAnchor {
    const EXAMPLE: &'static str = r#"{"id": 0, "size": 0.1}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let family = choice(fields, "family", &FAMILIES, &MarkerFamily::ALL).unwrap_or_default();
        let id = fields.required("id", Whole { min: 0, max: family.marker_count() - 1 });
        let size = fields.required("size", Positive::METERS);
        Some(Self::new(id?, size?).with_family(family))
    }
}

impl FromExtras for PoseFilter {
    const EXAMPLE: &'static str = r#"{"filter": "Live", "min_cutoff": 1, "lost_after": 0.5}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let default = Self::default();
        let uses = [FilterUse::Live, FilterUse::Always, FilterUse::Never];
        let seconds = || FromZero { max: 3600.0, unit: "seconds" };
        let gain = FromZero { max: 1e6, unit: "Hz per radian per second" };
        Some(Self {
            filter: choice(fields, "filter", &["Live", "Always", "Never"], &uses).unwrap_or(default.filter),
            min_cutoff: fields.optional("min_cutoff", Positive::HERTZ).unwrap_or(default.min_cutoff),
            speed_gain: fields.optional("speed_gain", gain).unwrap_or(default.speed_gain),
            speed_cutoff: fields.optional("speed_cutoff", Positive::HERTZ).unwrap_or(default.speed_cutoff),
            jump: fields.optional("jump", Positive::RADIANS).unwrap_or(default.jump),
            found_after: fields.optional("found_after", seconds()).map_or(default.found_after, Duration::from_secs_f32),
            lost_after: fields.optional("lost_after", seconds()).map_or(default.lost_after, Duration::from_secs_f32),
            predict: fields.optional("predict", Flag).unwrap_or(default.predict),
        })
    }
}

impl FromExtras for WorldOrigin {
    const EXAMPLE: &'static str = "{}";

    fn from_fields(_: &mut Fields) -> Option<Self> {
        Some(Self)
    }
}

impl FromExtras for VirtualButton {
    const EXAMPLE: &'static str = r#"{"width": 0.06, "height": 0.04}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let width = fields.required("width", Positive::METERS);
        let height = fields.required("height", Positive::METERS);
        Some(Self::new(Vec2::new(width?, height?)))
    }
}
