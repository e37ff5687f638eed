// Layout of the dome's views, shared by the pass that draws shadow maps and by everything that reads them.

#define_import_path bevy_mirrorball::shadows::dome

/// Mirror of `ViewUniform` in extract.rs. Packed: every invocation reads one per direction.
struct DomeView {
    /// Unit vectors to the right and upwards across the tile, six components as signed 16-bit fractions. The direction
    /// towards the light is their cross product.
    axes_low: u32,
    axes_mid: u32,
    axes_high: u32,
    /// 1 ÷ half the width of the tile's view, in metres.
    scale: f32,
    /// Where the view looks at, in the world.
    center: vec3f,
}

/// Unit vectors of a view.
struct Axes {
    right: vec3f,
    up: vec3f,
    /// Towards the light.
    direction: vec3f,
}

/// Mirror of `DomeUniform` in extract.rs.
struct Dome {
    /// Directions with shadow maps, all directions, columns and rows of the atlas.
    counts: vec4u,
    /// Width of a tile and radius of the filter in texels, tangent of a light's angular radius, solid angle of a direction.
    params: vec4f,
    /// The camera whose visibility is in a texture: pixels across one of its samples (0 for no camera). Then 1 if reflections
    /// are occluded, too. Then whether there are virtual casters (1) and phantoms (2) in the atlas.
    served: vec4u,
    /// That camera's matrix, without jitter.
    served_clip_from_world: mat4x4f,
    views: array<DomeView>,
}

/// One direction's light, packed; see weights_pass.wgsl.
struct DomeWeight {
    /// Radiance × solid angle: red and green, then blue, as 16-bit floats.
    rg: u32,
    b: u32,
    /// The direction with shadow maps that comes at this place when they are ordered by their light. Behind the last
    /// direction: how many of them are worth a look.
    ranked: u32,
}

fn unpack_light(weight: DomeWeight) -> vec3f {
    return vec3f(unpack2x16float(weight.rg), unpack2x16float(weight.b).x);
}

fn pack_light(light: vec3f, ranked: u32) -> DomeWeight {
    let stored = min(light, vec3f(65504.0));
    return DomeWeight(pack2x16float(stored.rg), pack2x16float(vec2f(stored.b, 0.0)), ranked);
}

fn unpack_axes(axes_low: u32, axes_mid: u32, axes_high: u32) -> Axes {
    let a = unpack2x16snorm(axes_low);
    let b = unpack2x16snorm(axes_mid);
    let c = unpack2x16snorm(axes_high);
    let right = vec3f(a, b.x);
    let up = vec3f(b.y, c);
    return Axes(right, up, cross(right, up));
}

/// Position in a view's tile of a place relative to the view's center: xy -1…1 (+y up), z 0…1, larger nearer to the light.
fn tile_position(axes: Axes, scale: f32, offset: vec3f) -> vec3f {
    let pos = vec3f(dot(axes.right, offset), dot(axes.up, offset), dot(axes.direction, offset)) * scale;
    return vec3f(pos.xy, pos.z * 0.5 + 0.5);
}

/// Texture coordinates in the atlas of a tile position.
fn atlas_uv(counts: vec4u, tile: u32, pos_tile: vec2f) -> vec2f {
    let corner = vec2f(vec2u(tile % counts.z, tile / counts.z));
    return (corner + pos_tile * vec2f(0.5, -0.5) + 0.5) / vec2f(counts.zw);
}
