// The shadows of one point of a light, as the passes of planar shadows share them.

#define_import_path bevy_mirrorball::shadows::planar::render::planar_view

/// Mirror of `PlanarView` in `planned.rs`.
struct PlanarView {
    clip_from_world: mat4x4f,
    /// Plane of the receiver, above which things cast.
    plane: vec4f,
    /// Fraction of the light that comes from this point, per color.
    weight: vec3f,
}
