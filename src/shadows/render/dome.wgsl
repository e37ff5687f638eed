// Layout of the dome's views and results, shared by the passes that write them and the shaders that read them.

#define_import_path bevy_mirrorball::shadows::render::dome

/// Mirror of `DomeViewUniform` in `view.rs`. Packed, because every invocation reads one per direction.
struct DomeView {
    /// Right and up vectors of the tile, six components as signed 16-bit fractions. They are unit vectors whose cross
    /// product points towards the light. In perspective, the one along the tile's longer side is shorter.
    axes_low: u32,
    axes_mid: u32,
    axes_high: u32,
    /// 1 ÷ half the width of the view in meters. In perspective: −1 ÷ the tangent of half the field of view.
    scale: f32,
    /// Center of the view in world space; in perspective the position of the light.
    center: vec3f,
    /// Corners in the atlas of the tiles for virtual casters and for phantoms, in tiles: x, y, x, y, eight bits each.
    corners: u32,
    /// Depth in perspective: x ÷ distance + y.
    depth: vec2f,
    /// Radius of a key light's penumbras in tile widths, per unit of depth.
    penumbra_scale: f32,
    /// Distance in meters from a near key light to the position at which its light was measured; 0 for other lights.
    measured_at: f32,
}

/// Axes of a view.
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
    /// Bits: 1 if there are virtual casters in the atlas, 2 if there are phantoms, 4 if the scene has lamps of the
    /// engine.
    scene_flags: u32,
    /// Index of the first key light.
    first_key: u32,
    /// Columns and rows of samples of the camera with a visibility pass.
    visibility_size: vec2u,
    /// Matrix of that camera, without jitter.
    visibility_clip_from_world: mat4x4f,
    /// Viewport of that camera, in pixels: left, top, width, height.
    visibility_viewport: vec4f,
    views: array<DomeView>,
}

/// Light of one direction, packed. `weights_pass.wgsl` writes it.
struct DomeWeight {
    /// Radiance × solid angle in red and green, as 16-bit floats.
    rg: u32,
    /// The same in blue, then the solid angle in steradians.
    b_solid_angle: u32,
    /// Direction with shadow maps that has this rank when they are ordered by their light. In the entry behind the last
    /// direction: the number of directions that are bright enough for a shadow-map lookup.
    ranked: u32,
}

/// Number of weights: for as many directions as a dome can have, for key lights, and the mean below the horizon. Twin
/// of `MAX_WEIGHTS` in `atlas.rs`.
const MAX_WEIGHTS: u32 = 2057u;

/// Maximum number of surfels. Twin of `MAX_SURFELS` in `dome_light.rs`.
const MAX_SURFELS: u32 = 1024u;

/// Disc that sends light to surfaces around it. `surfel_pass.wgsl` writes it.
struct LitSurfel {
    pos_world: vec3f,
    area: f32,
    normal: vec3f,
    /// Packed radiance; see `unpack_radiance`.
    last: u32,
    radiance: vec4u,
}

/// Radiance of a surfel.
struct SurfelRadiance {
    /// What virtual surfaces receive.
    to_virtual: vec3f,
    /// What real surfaces receive besides what they did without virtual things.
    to_real: vec3f,
    /// What real surfaces receive without virtual things, if they do not receive it from the environment.
    real: vec3f,
}

fn pack_radiance(radiance: SurfelRadiance) -> array<u32, 5> {
    let a = radiance.to_virtual;
    let b = radiance.to_real;
    let c = radiance.real;
    return array<u32, 5>(
        pack2x16float(a.rg), pack2x16float(vec2f(a.b, b.r)), pack2x16float(b.gb), pack2x16float(c.rg),
        pack2x16float(vec2f(c.b, 0.0)),
    );
}

fn unpack_radiance(packed: vec4u, last: u32) -> SurfelRadiance {
    let middle = unpack2x16float(packed.y);
    return SurfelRadiance(
        vec3f(unpack2x16float(packed.x), middle.x), vec3f(middle.y, unpack2x16float(packed.z)),
        vec3f(unpack2x16float(packed.w), unpack2x16float(last).x),
    );
}

struct LitSurfels {
    /// The dome's up vector.
    up: vec3f,
    count: u32,
    /// Radiance from below the horizon, which surfels hide. 0 if the dome has shadow maps there.
    hidden: vec3f,
    /// 1 if all phantoms that cast are among the surfels.
    covers_phantoms: u32,
    surfels: array<LitSurfel, MAX_SURFELS>,
}

/// What the passes before all cameras compute.
struct DomeResults {
    weights: array<DomeWeight, MAX_WEIGHTS>,
    lit: LitSurfels,
    /// Depth pyramids of key lights; see `depth_pyramid.wgsl`.
    pyramids: array<f32>,
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

/// Position in a view's tile of an offset from the view's center: xy -1…1 (+y up), z 0…1, larger is nearer to the
/// light.
fn tile_position(axes: Axes, scale: f32, offset: vec3f) -> vec3f {
    let pos = vec3f(dot(axes.right, offset), dot(axes.up, offset), dot(axes.direction, offset)) * scale;
    return vec3f(pos.xy, pos.z * 0.5 + 0.5);
}

/// Homogeneous position in the tile of a view in perspective.
fn near_position(axes: Axes, scale: f32, depth: vec2f, offset: vec3f) -> vec4f {
    let away = -dot(normalize(axes.direction), offset);
    let across = vec2f(dot(axes.right, offset), dot(axes.up, offset)) * -scale;
    return vec4f(across, depth.x + depth.y * away, away);
}

/// Homogeneous position in a view's tile of a world-space position.
fn project(view: DomeView, pos_world: vec3f) -> vec4f {
    let axes = unpack_axes(view.axes_low, view.axes_mid, view.axes_high);
    let offset = pos_world - view.center;
    if view.scale > 0.0 {
        return vec4f(tile_position(axes, view.scale, offset), 1.0);
    }
    return near_position(axes, view.scale, view.depth, offset);
}

/// Corner of a tile, in tiles.
fn tile_corner(corners: u32, kind: u32) -> vec2f {
    return vec2f(vec2u(corners >> (16u * kind), corners >> (16u * kind + 8u)) & vec2u(255u));
}

/// Width of a tile in ordinary tiles.
fn tile_span(key_span: f32, index: u32, first_key: u32) -> f32 {
    return select(1.0, key_span, index >= first_key);
}

/// Texture coordinates in the atlas of a position in a tile.
fn atlas_uv(atlas_tiles: vec2u, corner: vec2f, span: f32, pos_tile: vec2f) -> vec2f {
    return (corner + span * (pos_tile * vec2f(0.5, -0.5) + 0.5)) / vec2f(atlas_tiles);
}
