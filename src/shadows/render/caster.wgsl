// Vertices of casters: their poses, and the holes that alpha masks cut out. What draws casters imports it.

#define_import_path bevy_mirrorball::shadows::render::caster

/// Mirror of `CasterUniform` in `caster_buffers.rs`.
struct Caster {
    world_from_local: mat4x4f,
    /// Rows of the matrix that maps texture coordinates.
    uv_x: vec4f,
    uv_y: vec4f,
    /// 0 for a virtual caster, 1 for a phantom.
    kind: u32,
    first_joint: u32,
    first_morph_weight: u32,
    morph_targets: u32,
    /// First vertex of the mesh in its buffer, to number its vertices from 0.
    first_vertex: u32,
    vertex_count: u32,
    first_morph_displacement: u32,
    /// Minimum alpha of the texture where something is drawn.
    cutoff: f32,
}

/// Mirror of Bevy's `MorphAttributes`.
struct MorphDisplacement {
    position: vec3f,
    normal: vec3f,
    tangent: vec3f,
}

@group(0) @binding(1) var<storage, read> casters: array<Caster>;
@group(0) @binding(3) var<storage, read> joints: array<mat4x4f>;
@group(0) @binding(4) var<storage, read> morph_weights: array<f32>;
#ifdef MORPHED
@group(1) @binding(0) var<storage, read> morph_displacements: array<MorphDisplacement>;
#endif
#ifdef CUT_OUT
@group(#{CUTOUT_GROUP}) @binding(0) var mask_texture: texture_2d<f32>;
@group(#{CUTOUT_GROUP}) @binding(1) var mask_sampler: sampler;
#endif

struct Vertex {
    @builtin(instance_index) instance: u32,
    @builtin(vertex_index) index: u32,
    @location(0) position: vec3f,
#ifdef SKINNED
    @location(1) joint_indices: vec4u,
    @location(2) joint_weights: vec4f,
#endif
#ifdef CUT_OUT
    @location(3) uv: vec2f,
#endif
}

/// Position in world space of a vertex of a caster.
fn world_position(caster: Caster, in: Vertex) -> vec3f {
    var position = in.position;
#ifdef MORPHED
    for (var i = 0u; i < caster.morph_targets; i++) {
        let at = caster.first_morph_displacement + i * caster.vertex_count + in.index - caster.first_vertex;
        position += morph_weights[caster.first_morph_weight + i] * morph_displacements[at].position;
    }
#endif
#ifdef SKINNED
    let world_from_local = in.joint_weights.x * joints[caster.first_joint + in.joint_indices.x]
        + in.joint_weights.y * joints[caster.first_joint + in.joint_indices.y]
        + in.joint_weights.z * joints[caster.first_joint + in.joint_indices.z]
        + in.joint_weights.w * joints[caster.first_joint + in.joint_indices.w];
#else
    let world_from_local = caster.world_from_local;
#endif
    return (world_from_local * vec4f(position, 1.0)).xyz;
}

#ifdef CUT_OUT
/// Texture coordinates of a vertex of a caster in its mask.
fn mask_uv(caster: Caster, in: Vertex) -> vec2f {
    let uv = vec3f(in.uv, 1.0);
    return vec2f(dot(caster.uv_x.xyz, uv), dot(caster.uv_y.xyz, uv));
}

/// Whether there is a hole.
fn is_cut_out(uv: vec2f, cutoff: f32) -> bool {
    return textureSample(mask_texture, mask_sampler, uv).a < cutoff;
}
#endif
