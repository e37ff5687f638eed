// Back faces of a mesh, enlarged by a number of pixels and meters, in one color; by less while the outline fades
// (`fade_tag` in `mesh_copy.rs`). Skins and morphs as in mesh.wgsl of
// bevy_pbr.
//
// Definitions: MASKED: an alpha mask cuts out parts. MASK_UV_B: it lies on the second coordinates of textures.

#import bevy_pbr::{
    forward_io::{FragmentOutput, Vertex, VertexOutput},
    mesh_bindings::mesh,
    mesh_functions,
    mesh_view_bindings::view,
    morph,
    pbr_functions::main_pass_post_lighting_processing,
    pbr_types::{STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT, pbr_input_new},
    skinning,
    view_transformations::position_world_to_clip,
}

/// Mirror of `OutlineUniform` in `outline_material.rs`.
struct Outline {
    /// Linear RGB, alpha 1.
    color: vec4f,
    /// Widths in pixels and in meters, which add up.
    pixels: f32,
    meters: f32,
    /// Alpha of the base color, and that below which the mask cuts out.
    alpha: f32,
    cutoff: f32,
    uv_transform: mat3x3f,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> outline: Outline;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var mask: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var mask_sampler: sampler;

/// Depth by which the hull lies behind the surface, as a fraction of the distance, so that it does not cover thin
/// two-sided objects.
const HULL_DEPTH_OFFSET: f32 = 1e-3;
/// Smallest length of a projected normal, in pixels; shorter ones point at the camera or away from it.
const MIN_NORMAL_LENGTH: f32 = 1e-6;

#ifdef VERTEX_NORMALS
fn normal_of(vertex: Vertex) -> vec3f {
    return vertex.normal;
}
#else
/// Without normals there is no outline.
fn normal_of(vertex: Vertex) -> vec3f {
    return vec3f(0.0);
}
#endif

#ifdef MORPH_TARGETS
fn morphed(vertex: Vertex) -> array<vec3f, 2> {
    var shape = array(vertex.position, normal_of(vertex));
    let index = vertex.index - mesh[vertex.instance_index].first_vertex_index;
    for (var i = 0u; i < morph::layer_count(vertex.instance_index); i++) {
        let weight = morph::weight_at(i, vertex.instance_index);
        shape[0] += weight * morph::morph_position(index, i, vertex.instance_index);
        shape[1] += weight * morph::morph_normal(index, i, vertex.instance_index);
    }
    return shape;
}
#else
/// Position and normal.
fn morphed(vertex: Vertex) -> array<vec3f, 2> {
    return array(vertex.position, normal_of(vertex));
}
#endif

#ifdef SKINNED
fn in_world(vertex: Vertex, shape: array<vec3f, 2>) -> array<vec3f, 2> {
    let world_from_local = skinning::skin_model(vertex.joint_indices, vertex.joint_weights, vertex.instance_index);
    let pos = mesh_functions::mesh_position_local_to_world(world_from_local, vec4f(shape[0], 1.0));
    return array(pos.xyz, skinning::skin_normals(world_from_local, shape[1]));
}
#else
fn in_world(vertex: Vertex, shape: array<vec3f, 2>) -> array<vec3f, 2> {
    let world_from_local = mesh_functions::get_world_from_local(vertex.instance_index);
    let pos = mesh_functions::mesh_position_local_to_world(world_from_local, vec4f(shape[0], 1.0));
    return array(pos.xyz, mesh_functions::mesh_normal_local_to_world(shape[1], vertex.instance_index));
}
#endif

@vertex
fn vertex(in: Vertex) -> VertexOutput {
    let shape = in_world(in, morphed(in));
    let left = 1.0 - unpack2x16unorm(mesh_functions::get_tag(in.instance_index)).x;
    let along_normal = shape[1] * inverseSqrt(max(dot(shape[1], shape[1]), MIN_NORMAL_LENGTH));
    let pos_clip = position_world_to_clip(shape[0] + along_normal * (outline.meters * left));
    let normal_clip = view.clip_from_world * vec4f(shape[1], 0.0);
    // Motion of the projected point when the point moves along the normal.
    let motion = (normal_clip.xy * pos_clip.w - pos_clip.xy * normal_clip.w) * view.main_pass_viewport.zw;
    let pixels = outline.pixels * left;
    let offset = motion / max(length(motion), MIN_NORMAL_LENGTH) * pixels * 2.0 / view.main_pass_viewport.zw;

    var out: VertexOutput;
    out.position = vec4f(pos_clip.xy + offset * pos_clip.w, pos_clip.z * (1.0 - HULL_DEPTH_OFFSET), pos_clip.w);
    out.world_position = vec4f(shape[0], 1.0);
    out.world_normal = shape[1];
#ifdef VERTEX_UVS_A
    out.uv = in.uv;
#endif
#ifdef VERTEX_UVS_B
    out.uv_b = in.uv_b;
#endif
    return out;
}

#ifdef MASKED
/// Discards what an alpha mask cuts out of the surface.
fn cut_out(in: VertexOutput) {
#ifdef MASK_UV_B
    let uv = in.uv_b;
#else
    let uv = in.uv;
#endif
    let alpha = outline.alpha * textureSample(mask, mask_sampler, (outline.uv_transform * vec3f(uv, 1.0)).xy).a;
    if alpha < outline.cutoff {
        discard;
    }
}
#else
fn cut_out(in: VertexOutput) {}
#endif

@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    cut_out(in);
    var pbr_input = pbr_input_new();
    pbr_input.world_position = in.world_position;
    pbr_input.frag_coord = in.position;
    pbr_input.material.flags |= STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT;
    return FragmentOutput(main_pass_post_lighting_processing(pbr_input, outline.color));
}
