//! Extraction of measured grain, and pipeline and uniform of each view that has it.

use super::{
    CameraGrain, GrainMeasurement,
    blur_kernel::{MAX_RADIUS, blur_kernel},
    grain_pipeline::{GrainPipeline, GrainPipelineKey, GrainUniform, upload_tile},
    noise_bands::{BINS, LUMA_WEIGHTS, Variances},
    noise_tile::{OCTAVES, offsets},
};
use crate::camera::{ArCamera, CameraFrame, FrameMapping, MarksReal};
use bevy::{
    camera::{MainPassResolutionOverride, Viewport},
    ecs::entity::EntityHashSet,
    prelude::*,
    render::{
        Extract,
        camera::ExtractedCamera,
        render_resource::{
            CachedRenderPipelineId, PipelineCache, SpecializedRenderPipelines, TextureView, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        sync_world::RenderEntity,
        view::ExtractedView,
    },
};

/// Variance in squared pixels of a pixel's own area, which antialiased edges have already.
const PIXEL_VARIANCE: f32 = 1.0 / 12.0;

/// Grain of the frame that a view shows.
#[derive(Component)]
pub(super) struct ExtractedGrain {
    frame_uv_from_view_uv: Vec4,
    frame_size: Vec2,
    offsets: [[u32; 2]; OCTAVES],
    /// Standard deviation of edges in pixels of the frame.
    edge_width: f32,
    levels: [Vec4; OCTAVES * BINS],
}

type GrainSource = (
    RenderEntity,
    &'static ArCamera,
    &'static Camera,
    &'static CameraFrame,
    Option<&'static CameraGrain>,
    Option<&'static GrainMeasurement>,
);

pub(super) fn extract_grain(
    mut commands: Commands,
    cameras: Extract<Query<GrainSource, With<MarksReal>>>,
    extracted: Query<Entity, With<ExtractedGrain>>,
) {
    let mut current = EntityHashSet::default();
    for (view, ar_camera, camera, frame, grain, measurement) in &cameras {
        let size = frame.pixels.size;
        let Some(mapping) = FrameMapping::frame_uv_from_viewport_uv(camera, ar_camera.fit, size) else {
            continue;
        };
        // Alpha is marked until the component that asks for it is gone.
        let CameraGrain { noise, blur, seed } =
            grain.copied().unwrap_or(CameraGrain { noise: 0.0, blur: 0.0, seed: 0 });
        let variances = measurement.and_then(GrainMeasurement::variances);
        let edge_width = measurement.and_then(|measurement| measurement.edge_width).unwrap_or(0.0);
        commands.entity(view).insert(ExtractedGrain {
            frame_uv_from_view_uv: mapping,
            frame_size: size.as_vec2(),
            offsets: offsets(seed, frame.sequence),
            edge_width: CameraGrain::clamped(blur) * edge_width,
            levels: variances.map_or([Vec4::ZERO; OCTAVES * BINS], |found| levels(found, CameraGrain::clamped(noise))),
        });
        current.insert(view);
    }
    for view in extracted.iter().filter(|view| !current.contains(view)) {
        commands.entity(view).remove::<(ExtractedGrain, PreparedGrain)>();
    }
}

/// Standard deviations of red, green and blue relative to white, and the fraction of each that all three share.
///
/// Luma has the variance Σ (wᵢσᵢ)² of noise that is independent, and (Σ wᵢσᵢ)² of noise that is shared.
fn levels(variances: &Variances, strength: f32) -> [Vec4; OCTAVES * BINS] {
    std::array::from_fn(|i| {
        let variance = variances[i / BINS][i % BINS];
        let deviation = variance.truncate().map(f32::sqrt);
        let weighted = LUMA_WEIGHTS * deviation;
        let (independent, shared) = (weighted.length_squared(), weighted.element_sum().powi(2));
        let fraction = ((variance.w - independent) / (shared - independent).max(1e-6)).clamp(0.0, 1.0);
        (strength * deviation / 255.0).extend(fraction.sqrt())
    })
}

/// Standard deviation of the blur that edges in the view lack, in pixels of the view.
fn missing_blur(edge_width: f32, frame_px_from_view_px: Vec2, is_antialiased: bool) -> f32 {
    let view_px = 1.0 / frame_px_from_view_px.element_product().abs().sqrt().max(1e-3);
    // The frame is magnified with a linear filter, as wide as its pixels.
    let filter = (1.0 - 1.0 / (view_px * view_px)).max(0.0) / 6.0;
    let drawn = if is_antialiased { PIXEL_VARIANCE } else { 0.0 };
    let wanted = if edge_width > 0.0 { view_px * view_px * (edge_width * edge_width + filter) } else { 0.0 };
    (wanted - drawn).max(0.0).sqrt()
}

/// Pipeline and uniform of a view with grain.
#[derive(Component)]
pub(super) struct PreparedGrain {
    pub(super) pipeline: CachedRenderPipelineId,
    pub(super) noise: TextureView,
    pub(super) uniform: UniformBuffer<GrainUniform>,
}

type GrainView = (
    Entity,
    &'static ExtractedGrain,
    &'static ExtractedView,
    &'static ExtractedCamera,
    &'static Msaa,
    Option<&'static MainPassResolutionOverride>,
    Option<&'static mut PreparedGrain>,
);

pub(super) fn prepare_grain(
    mut commands: Commands,
    mut views: Query<GrainView>,
    pipeline: Res<GrainPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<GrainPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut tile: Local<Option<TextureView>>,
) {
    for (entity, grain, view, camera, msaa, resolution, prepared) in &mut views {
        let viewport = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution);
        let whole = || camera.physical_target_size.map(|size| (UVec2::ZERO, size));
        let viewport = viewport.map(|viewport| (viewport.physical_position, viewport.physical_size));
        let Some((place, size)) = viewport.or_else(whole) else { continue };
        let (scale, offset) = (grain.frame_uv_from_view_uv.xy(), grain.frame_uv_from_view_uv.zw());
        let (scale, offset) = (grain.frame_size * scale / size.as_vec2(), grain.frame_size * offset);
        let (weights, radius) = blur_kernel(missing_blur(grain.edge_width, scale, msaa.samples() > 1));
        let weight = |i: usize| weights.get(i).copied().unwrap_or(0.0);
        let uniform = GrainUniform {
            frame_px_from_view_px: Vec4::new(scale.x, scale.y, offset.x, offset.y),
            viewport: IVec4::new(place.x as i32, place.y as i32, size.x as i32, size.y as i32),
            offsets: grain.offsets.map(|[x, y]| UVec4::new(x, y, 0, 0)),
            levels: grain.levels,
            weights: std::array::from_fn(|i| Vec4::from_array(std::array::from_fn(|k| weight(4 * i + k)))),
        };
        let key = GrainPipelineKey { target_format: view.target_format, radius: radius.min(MAX_RADIUS) as u32 };
        let wanted = pipelines.specialize(&pipeline_cache, &pipeline, key);
        if let Some(mut prepared) = prepared {
            // While another radius compiles, the last one goes on.
            if pipeline_cache.get_render_pipeline(wanted).is_some() {
                prepared.pipeline = wanted;
            }
            if *prepared.uniform.get() != uniform {
                prepared.uniform.set(uniform);
                prepared.uniform.write_buffer(&device, &queue);
            }
            continue;
        }
        let noise = tile.get_or_insert_with(|| upload_tile(&device, &queue)).clone();
        let mut buffer = UniformBuffer::from(uniform);
        buffer.set_label(Some("mirrorball_grain_uniform"));
        buffer.write_buffer(&device, &queue);
        commands.entity(entity).insert(PreparedGrain { pipeline: wanted, noise, uniform: buffer });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_is_what_edges_lack_in_pixels_of_the_view() {
        let lacking =
            |width: f32, scale: f32, is_antialiased: bool| missing_blur(width, Vec2::splat(scale), is_antialiased);
        assert_eq!(lacking(0.0, 1.0, true), 0.0);
        assert!((lacking(1.0, 1.0, false) - 1.0).abs() < 1e-6);
        assert!((lacking(1.0, 1.0, true) - (11.0_f32 / 12.0).sqrt()).abs() < 1e-6);
        assert!((lacking(1.0, 0.5, false) - (4.0_f32 + 0.5).sqrt()).abs() < 1e-5, "twice as large and filtered");
        assert!((lacking(1.0, 2.0, false) - 0.5).abs() < 1e-6, "half as large");
    }

    #[test]
    fn gray_noise_is_shared_and_independent_noise_is_not() {
        let of = |variance: Vec4| levels(&[[variance; BINS]; OCTAVES], 1.0)[0];
        assert_eq!(of(Vec4::splat(4.0)), Vec4::new(2.0, 2.0, 2.0, 255.0) / 255.0);
        assert_eq!(of(Vec3::splat(4.0).extend(4.0 * LUMA_WEIGHTS.length_squared())).w, 0.0);
        assert_eq!(of(Vec4::ZERO), Vec4::ZERO);
    }
}
