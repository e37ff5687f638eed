//! Times that the passes of the dome take on the GPU.

use super::dome_light::DomeState;
use bevy::{
    diagnostic::{DiagnosticPath, DiagnosticsStore},
    platform::time::Instant,
    prelude::*,
};
use std::time::Duration;

/// Milliseconds of each part of the dome on the GPU, in the last frame that the GPU has reported. 0 for a part that has
/// not run for a second, as shadow maps do where nothing moves, and for all parts without Bevy's
/// [`RenderDiagnosticsPlugin`](bevy::render::diagnostic::RenderDiagnosticsPlugin) and on devices without timestamps.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct DomeTimes {
    /// Drawing casters into shadow maps, and the depth pyramids of key lights.
    pub shadow_maps: f32,
    /// Summing the environment's light over the cells of directions.
    pub weights: f32,
    /// Lighting the surfels that send bounced light.
    pub surfels: f32,
    /// Looking up shadow maps and summing the light that arrives, for the camera with a visibility pass. What materials
    /// add to the main pass is not part of this.
    pub visibility: f32,
}

const DEPTH: DiagnosticPath = DiagnosticPath::const_new("render/mirrorball_shadows_depth/elapsed_gpu");
const PYRAMIDS: DiagnosticPath = DiagnosticPath::const_new("render/mirrorball_shadows_depth_pyramid/elapsed_gpu");
const WEIGHTS: DiagnosticPath = DiagnosticPath::const_new("render/mirrorball_shadows_weights/elapsed_gpu");
const SURFELS: DiagnosticPath = DiagnosticPath::const_new("render/mirrorball_shadows_surfels/elapsed_gpu");
const VISIBILITY: DiagnosticPath = DiagnosticPath::const_new("render/mirrorball_shadows_visibility/elapsed_gpu");
/// Time after which a measurement is of a pass that no longer runs.
const MAX_AGE: Duration = Duration::from_secs(1);

pub(super) fn report_pass_times(diagnostics: Option<Res<DiagnosticsStore>>, mut domes: Query<&mut DomeState>) {
    let Some(mut state) = diagnostics.as_ref().and_then(|_| domes.iter_mut().next()) else {
        return;
    };
    let now = Instant::now();
    let time = |path: &DiagnosticPath| {
        let measured = diagnostics.as_ref()?.get(path)?.measurement()?;
        (now.saturating_duration_since(measured.time) < MAX_AGE).then_some(measured.value as f32)
    };
    let sum = |paths: &[&DiagnosticPath]| paths.iter().filter_map(|path| time(path)).sum();
    let times = DomeTimes {
        shadow_maps: sum(&[&DEPTH, &PYRAMIDS]),
        weights: sum(&[&WEIGHTS]),
        surfels: sum(&[&SURFELS]),
        visibility: sum(&[&VISIBILITY]),
    };
    if state.milliseconds != times {
        state.milliseconds = times;
    }
}
