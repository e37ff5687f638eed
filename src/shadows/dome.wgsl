// Layout of the dome's views, shared by the pass that draws shadow maps and by everything that reads them.

#define_import_path bevy_mirrorball::shadows::dome

/// Mirror of `ViewUniform` in extract.rs. Each row maps a world position (metres): dot(row.xyz, pos) + row.w.
struct DomeView {
    /// -1…1 across the tile, to the right.
    right: vec4f,
    /// -1…1 across the tile, upwards.
    up: vec4f,
    /// 0…1, larger is nearer to the light.
    depth: vec4f,
    /// Unit vector towards the light; w the size of a shadow map texel in metres.
    direction: vec4f,
}

/// Mirror of `DomeUniform` in extract.rs.
struct Dome {
    /// Directions with shadow maps, all directions, columns and rows of the atlas.
    counts: vec4u,
    /// Width of a tile and radius of the filter in texels, tangent of a light's angular radius, solid angle of a direction.
    params: vec4f,
    /// The camera whose visibility is in a texture: pixels across one of its samples (0 for no camera). Then 1 if reflections
    /// are occluded, too; the rest unused.
    served: vec4u,
    /// That camera's matrix, without jitter.
    served_clip_from_world: mat4x4f,
    views: array<DomeView>,
}

/// Position in a view's tile: xy -1…1 (+y up), z depth.
fn view_position(view: DomeView, pos_world: vec3f) -> vec3f {
    return vec3f(
        dot(view.right.xyz, pos_world) + view.right.w,
        dot(view.up.xyz, pos_world) + view.up.w,
        dot(view.depth.xyz, pos_world) + view.depth.w,
    );
}

/// Texture coordinates in the atlas of a tile position.
fn atlas_uv(counts: vec4u, tile: u32, pos_tile: vec2f) -> vec2f {
    let corner = vec2f(vec2u(tile % counts.z, tile / counts.z));
    return (corner + pos_tile * vec2f(0.5, -0.5) + 0.5) / vec2f(counts.zw);
}
