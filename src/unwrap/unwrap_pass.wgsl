// Frame → environment cube: each texel gets what the frame shows in its direction, merged with its history.
//
// BALL: the frame shows a mirrored ball. FISHEYE, EQUIRECT: it is taken that way. None of them: it is a cropped
// sphere map.

#import bevy_mirrorball::unwrap::bindings::cube
#import bevy_mirrorball::unwrap::history::merged
#ifdef BALL
#import bevy_mirrorball::unwrap::ball::observe
#else
#import bevy_mirrorball::unwrap::lens::observe
#endif

@compute @workgroup_size(8, 8, 1)
fn unwrap_frame(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(cube);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let step = 2.0 / f32(size.x);
    let seen = observe(id.z, (vec2f(id.xy) + 0.5) * step - 1.0, step);
    textureStore(cube, id.xy, id.z, merged(seen, id.xy, id.z));
}
