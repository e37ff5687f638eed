//! What every compute pass of the crate begins and ends with.

use bevy::render::{
    diagnostic::RecordDiagnostics,
    render_resource::{ComputePass, ComputePassDescriptor},
    renderer::RenderContext,
};

/// Edge of a two-dimensional workgroup in threads, as in the shaders.
const WORKGROUP_EDGE: u32 = 8;

/// Number of workgroups that cover some texels along one axis.
pub(crate) fn workgroups(texels: u32) -> u32 {
    texels.div_ceil(WORKGROUP_EDGE)
}

/// Encodes one compute pass. Debuggers and the diagnostics of GPU times show it under its label.
pub(crate) fn compute_pass(ctx: &mut RenderContext, label: &'static str, encode: impl FnOnce(&mut ComputePass)) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let descriptor = ComputePassDescriptor { label: Some(label), timestamp_writes: None };
    let mut pass = ctx.command_encoder().begin_compute_pass(&descriptor);
    let span = diagnostics.pass_span(&mut pass, label);
    encode(&mut pass);
    span.end(&mut pass);
}
