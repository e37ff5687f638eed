// Soft edges where a phantom is in front of a virtual object. A pixel on either side of such an edge is blended with
// the colors of the other side, weighted by the fraction of a disc around the pixel that the other side covers.

#import bevy_render::view::View
#import bevy_mirrorball::shadows::render::samples::{IS_VIRTUAL, first_sample, world_position}

/// Mirror of `SoftEdgesUniform` in `soft_edges_pipeline.rs`.
struct SoftEdges {
    /// Radius of the disc, in pixels.
    radius: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var rendered: texture_2d<f32>;
#ifdef MULTISAMPLED
@group(0) @binding(2) var depths: texture_depth_multisampled_2d;
@group(0) @binding(3) var normals: texture_multisampled_2d<f32>;
#else
@group(0) @binding(2) var depths: texture_depth_2d;
@group(0) @binding(3) var normals: texture_2d<f32>;
#endif
@group(0) @binding(4) var<uniform> edges: SoftEdges;

const SAMPLES: i32 = 32;
/// Rows of the matrix that rotates by the golden angle.
const GOLDEN_TURN: vec4f = vec4f(-0.737369, -0.675490, 0.675490, -0.737369);
/// Smallest depth of a virtual point behind the surface of a phantom that makes an edge, as a fraction of the
/// distance to the camera.
const MIN_DEPTH_STEP: f32 = 2e-3;

#ifdef MULTISAMPLED
/// Position within the pixel at which the prepass sampled the surface.
fn sample_position() -> vec2f {
    return first_sample(textureNumSamples(depths));
}
#else
fn sample_position() -> vec2f {
    return first_sample(1u);
}
#endif

/// Surface in the prepass at a pixel.
struct Surface {
    pos_world: vec3f,
    normal: vec3f,
    is_virtual: bool,
    is_phantom: bool,
}

fn surface_at(pixel: vec2i) -> Surface {
    let depth = textureLoad(depths, pixel, 0);
    let facing = textureLoad(normals, pixel, 0);
    let is_virtual = abs(facing.a - IS_VIRTUAL) < 0.1;
    return Surface(
        world_position(view.world_from_clip, view.main_pass_viewport, vec2f(pixel) + sample_position(), depth),
        normalize(facing.xyz * 2.0 - 1.0), depth > 0.0 && is_virtual, depth > 0.0 && !is_virtual,
    );
}

/// Whether the surface of a phantom is between the camera and a virtual point, and not below or beside it.
fn is_before(phantom: Surface, behind: Surface) -> bool {
    let height = dot(behind.pos_world - phantom.pos_world, phantom.normal);
    return phantom.is_phantom && behind.is_virtual
        && height < -MIN_DEPTH_STEP * distance(view.world_position, phantom.pos_world);
}

@fragment
fn soften(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let last = vec2i(textureDimensions(rendered)) - 1;
    let color = textureLoad(rendered, pixel, 0);
    let here = surface_at(pixel);
    if !(here.is_virtual || here.is_phantom) {
        return color;
    }
    var other = vec4f(0.0);
    var count = 0.0;
    var turned = vec2f(1.0, 0.0);
    for (var i = 0; i < SAMPLES; i++) {
        let offset = turned * (edges.radius * sqrt((f32(i) + 0.5) / f32(SAMPLES)));
        let neighbor = clamp(vec2i(floor(position.xy + offset)), vec2i(0), last);
        let there = surface_at(neighbor);
        if is_before(here, there) || is_before(there, here) {
            other += textureLoad(rendered, neighbor, 0);
            count += 1.0;
        }
        turned = vec2f(dot(turned, GOLDEN_TURN.xy), dot(turned, GOLDEN_TURN.zw));
    }
    // Alpha too, which may tell real from virtual.
    return mix(color, other / max(count, 1.0), count / f32(SAMPLES));
}
