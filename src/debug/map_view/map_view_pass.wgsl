// Equirectangular image of one level of a cube map: columns from −Z towards +X, rows from +Y down.

#import bevy_mirrorball::environment_map::cubemap::sample_faces

/// Mirror of `ShownUniform` in `map_view_pipeline.rs`.
struct Shown {
    /// Mip level of the map.
    level: u32,
    /// 1 to show alpha instead of color.
    alpha: f32,
}

@group(0) @binding(0) var map: texture_2d_array<f32>;
@group(0) @binding(1) var<uniform> shown: Shown;
@group(0) @binding(2) var image: texture_storage_2d<rgba16float, write>;

const PI: f32 = 3.14159265358979;

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(image);
    if any(id.xy >= size) {
        return;
    }
    let angles = PI * vec2f(2.0, 1.0) * (vec2f(id.xy) + 0.5) / vec2f(size);
    let dir = vec3f(sin(angles.x) * sin(angles.y), cos(angles.y), -cos(angles.x) * sin(angles.y));
    let value = sample_faces(map, dir * vec3f(1.0, 1.0, -1.0), shown.level);
    let color = mix(value.rgb, vec3f(value.a), shown.alpha);
    textureStore(image, id.xy, vec4f(clamp(color, vec3f(0.0), vec3f(1.0)), 1.0));
}
