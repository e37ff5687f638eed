// Layout of the dome's views, shared by the pass that draws shadow maps and by everything that reads them.

#define_import_path bevy_mirrorball::shadows::render::dome

/// Mirror of `DomeViewUniform` in `view.rs`. Packed: every invocation reads one per direction.
struct DomeView {
    /// Vectors to the right and upwards across the tile, six components as signed 16-bit fractions. Unit vectors whose cross
    /// product points towards the light; of a spot only as long as the tile's shape asks for.
    axes_low: u32,
    axes_mid: u32,
    axes_high: u32,
    /// 1 ÷ half the width of the tile's view, in metres. Below 0 for a spot: −1 ÷ the tangent of half its field of view.
    scale: f32,
    /// Where the view looks at, in the world; of a spot where it is.
    center: vec3f,
    /// Of the tiles for virtual casters and phantoms in the atlas, in tiles: x, y, x, y, eight bits each.
    corners: u32,
    /// Of a spot: its depth is the first ÷ distance + the second.
    depth: vec2f,
    /// Of a key light: radius of penumbras in tile widths, per unit of depth.
    penumbra_scale: f32,
    /// Of a key light that is near: metres from it to where its light was measured; 0 for others.
    measured_at: f32,
}

/// Unit vectors of a view.
struct Axes {
    right: vec3f,
    up: vec3f,
    /// Towards the light.
    direction: vec3f,
}

/// Mirror of `DomeUniform` in `prepare_views.rs`.
struct Dome {
    /// Number of shadow maps: those of directions, then those of key lights.
    shadow_map_count: u32,
    /// Number of all directions: those with shadow maps, key lights, and those below the horizon.
    direction_count: u32,
    /// Columns and rows of the atlas in tiles.
    atlas_tiles: vec2u,
    /// Width of a tile in texels.
    tile_resolution: f32,
    /// Radius of the filter in texels.
    filter_radius: f32,
    /// Tangent of the angular radius of a direction's light.
    tangent_radius: f32,
    /// Width of a key light's tile in ordinary tiles.
    key_span: f32,
    /// Pixels across one sample of the camera with a visibility pass; 0 without such a camera.
    sample_pixels: u32,
    /// 1 if reflections are occluded, too; otherwise 0.
    occludes_reflections: u32,
    /// Bits: 1 if there are virtual casters in the atlas, 2 if there are phantoms, 4 if the scene has lamps of the engine.
    scene_flags: u32,
    /// Index of the first key light.
    first_key: u32,
    /// Columns and rows of samples of the camera with a visibility pass.
    visibility_size: vec2u,
    /// Matrix of that camera, without jitter.
    visibility_clip_from_world: mat4x4f,
    views: array<DomeView>,
}

/// One direction's light, packed; see weights_pass.wgsl.
struct DomeWeight {
    /// Radiance × solid angle: red and green, then blue and the solid angle in steradian, as 16-bit floats.
    rg: u32,
    b_solid_angle: u32,
    /// The direction with shadow maps that comes at this place when they are ordered by their light. Behind the last
    /// direction: how many of them are worth a look.
    ranked: u32,
}

fn unpack_light(weight: DomeWeight) -> vec3f {
    return vec3f(unpack2x16float(weight.rg), unpack2x16float(weight.b_solid_angle).x);
}

fn unpack_solid_angle(weight: DomeWeight) -> f32 {
    return unpack2x16float(weight.b_solid_angle).y;
}

fn pack_light(light: vec3f, solid_angle: f32, ranked: u32) -> DomeWeight {
    let stored = min(light, vec3f(65504.0));
    return DomeWeight(pack2x16float(stored.rg), pack2x16float(vec2f(stored.b, solid_angle)), ranked);
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

/// Position in a view's tile of a place in the world, still to be divided by w.
fn project(view: DomeView, pos_world: vec3f) -> vec4f {
    let axes = unpack_axes(view.axes_low, view.axes_mid, view.axes_high);
    let offset = pos_world - view.center;
    if view.scale > 0.0 {
        return vec4f(tile_position(axes, view.scale, offset), 1.0);
    }
    let away = -dot(normalize(axes.direction), offset);
    let across = vec2f(dot(axes.right, offset), dot(axes.up, offset)) * -view.scale;
    return vec4f(across, view.depth.x + view.depth.y * away, away);
}

/// Corner of a tile, in tiles.
fn tile_corner(corners: u32, kind: u32) -> vec2f {
    return vec2f(vec2u(corners >> (16u * kind), corners >> (16u * kind + 8u)) & vec2u(255u));
}

/// Width of a tile in ordinary ones.
fn tile_span(key_span: f32, index: u32, first_key: u32) -> f32 {
    return select(1.0, key_span, index >= first_key);
}

/// Texture coordinates in the atlas of a position in a tile.
fn atlas_uv(atlas_tiles: vec2u, corner: vec2f, span: f32, pos_tile: vec2f) -> vec2f {
    return (corner + span * (pos_tile * vec2f(0.5, -0.5) + 0.5)) / vec2f(atlas_tiles);
}
