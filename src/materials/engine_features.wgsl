// Parts of the engine's StandardMaterial shader (pbr.wgsl) around the shading, for shaders that shade in its place:
// crossfading of visibility ranges, clustered decals and order-independent transparency. And what copies of meshes need
// that fade out.
//
// Definitions: FADES: the mesh is such a copy.

#define_import_path bevy_mirrorball::materials::engine_features

#import bevy_pbr::{
    decal::clustered::apply_decals,
    forward_io::{FragmentOutput, VertexOutput},
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::{alpha_discard, main_pass_post_lighting_processing},
    pbr_types::{
        PbrInput, STANDARD_MATERIAL_FLAGS_ALPHA_MODE_OPAQUE, STANDARD_MATERIAL_FLAGS_ALPHA_MODE_RESERVED_BITS,
    },
}
#ifdef VISIBILITY_RANGE_DITHER
#import bevy_pbr::pbr_functions::visibility_range_dither
#endif
#ifdef FADES
#import bevy_pbr::mesh_functions::get_tag
#endif
#ifdef OIT_ENABLED
#import bevy_core_pipeline::oit::oit_draw
#endif

#ifdef VISIBILITY_RANGE_DITHER
/// Discards the fragments that another level of detail draws.
fn crossfade(in: VertexOutput) {
    visibility_range_dither(in.position, in.visibility_range_dither);
}
#else
fn crossfade(in: VertexOutput) {}
#endif

#ifdef FADES
/// How much of the mesh is gone, and below which alpha its mask cuts out, as `fade_tag` in `mesh_copy.rs` packs it.
fn fade_of(in: VertexOutput) -> vec2f {
    return unpack2x16unorm(get_tag(in.instance_index));
}

/// Base color under the alpha mode of the original.
fn masked_color(in: VertexOutput, surface: PbrInput) -> vec4f {
    let color = surface.material.base_color;
    if color.a < fade_of(in).y {
        discard;
    }
    return vec4f(color.rgb, 1.0);
}

/// Color of which a part is gone.
fn faded(in: VertexOutput, color: vec4f) -> vec4f {
    return vec4f(color.rgb, 1.0 - fade_of(in).x);
}
#else
/// Base color under the alpha mode.
fn masked_color(in: VertexOutput, surface: PbrInput) -> vec4f {
    return alpha_discard(surface.material, surface.material.base_color);
}

fn faded(in: VertexOutput, color: vec4f) -> vec4f {
    return color;
}
#endif

/// Surface at a fragment, with its decals. Discards what its alpha mask cuts out.
fn surface_of(in: VertexOutput, is_front: bool) -> PbrInput {
    return finished_surface(in, sampled_surface(in, is_front));
}

/// Surface at a fragment with the alpha of its textures, whatever its alpha mode.
fn sampled_surface(in: VertexOutput, is_front: bool) -> PbrInput {
    crossfade(in);
    return pbr_input_from_standard_material(in, is_front);
}

/// The same under its alpha mode, with its decals.
fn finished_surface(in: VertexOutput, sampled: PbrInput) -> PbrInput {
    var surface = sampled;
    surface.material.base_color = masked_color(in, surface);
    apply_decals(&surface);
    return surface;
}

#ifdef OIT_ENABLED
/// Output of a fragment after shading. Transparent ones are drawn later, sorted by depth.
fn output_of(in: VertexOutput, surface: PbrInput, shaded: vec4f) -> FragmentOutput {
    let color = main_pass_post_lighting_processing(surface, faded(in, shaded));
    let alpha_mode = surface.material.flags & STANDARD_MATERIAL_FLAGS_ALPHA_MODE_RESERVED_BITS;
    if alpha_mode != STANDARD_MATERIAL_FLAGS_ALPHA_MODE_OPAQUE {
        oit_draw(surface.frag_coord, color);
        discard;
    }
    return FragmentOutput(color);
}
#else
/// Output of a fragment after shading.
fn output_of(in: VertexOutput, surface: PbrInput, shaded: vec4f) -> FragmentOutput {
    return FragmentOutput(main_pass_post_lighting_processing(surface, faded(in, shaded)));
}
#endif
