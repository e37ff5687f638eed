// Key light of toon surfaces: the direction that their bands follow, where it is not that of all light together.
//
// Definitions: KEY_REAL_LIGHT: it is the strongest real light. KEY_DIRECTION: the author's direction.

#define_import_path bevy_mirrorball::materials::toon::key_light

#ifdef KEY_REAL_LIGHT
#import bevy_mirrorball::materials::strongest_light::strongest_light
#endif
#ifdef KEY_DIRECTION
#import bevy_mirrorball::materials::toon::toon_bindings::toon
#endif

/// A chosen key light.
struct KeyLight {
    /// Towards the light.
    dir: vec3f,
    /// 0: the prevailing light counts, 1: this one.
    weight: f32,
}

fn key_light() -> KeyLight {
#ifdef KEY_REAL_LIGHT
    return KeyLight(strongest_light.key_direction, strongest_light.key_weight);
#else
#ifdef KEY_DIRECTION
    return KeyLight(toon.key_direction, 1.0);
#else
    return KeyLight(vec3f(0.0), 0.0);
#endif
#endif
}
