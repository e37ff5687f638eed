//! Waiting for shaders ends with a reason when one of them cannot be compiled.

use crate::gpu;
use bevy::{
    prelude::*,
    render::{
        RenderApp,
        render_resource::{ComputePipelineDescriptor, PipelineCache},
    },
};
use bevy_mirrorball::headless::{self, HeadlessError};

fn settle_with(shader: &'static str) -> Option<Result<(), HeadlessError>> {
    let mut app = gpu::app(|_| ())?;
    let shader = app.world_mut().resource_mut::<Assets<Shader>>().add(Shader::from_wgsl(shader, "trial.wgsl"));
    let cache = app.sub_app(RenderApp).world().resource::<PipelineCache>();
    cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("trial_pipeline".into()),
        shader: shader.clone(),
        entry_point: Some("main".into()),
        ..default()
    });
    let settled = headless::settle(&mut app);
    drop(shader);
    Some(settled)
}

#[test]
fn a_pipeline_that_cannot_be_compiled_is_named_with_the_reason() {
    let mistakes = [
        ("@compute @workgroup_size(1) fn main() { let x = missing_function(); }", "missing_function"),
        ("@compute @workgroup_size(1) fn main() { var x: u32 = 1.5f; }", ""),
        ("this is no shader", ""),
    ];
    for (shader, part) in mistakes {
        let Some(settled) = settle_with(shader) else { return };
        let error = settled.expect_err("it cannot be compiled");
        assert!(matches!(&error, HeadlessError::Pipeline { pipeline, .. } if pipeline == "trial_pipeline"), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn good_pipelines_settle() {
    let Some(settled) = settle_with("@compute @workgroup_size(1) fn main() {}") else { return };
    settled.expect("it compiles");
}
