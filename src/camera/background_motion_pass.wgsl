// Motion vectors where the background shows the camera frame and nothing else is drawn: at depth 0, which is where this
// triangle lies.

#import bevy_render::view::View
#import bevy_mirrorball::camera::real_motion::motion_of_frame

@group(0) @binding(0) var<uniform> view: View;

@fragment
fn fragment() -> @location(0) vec2f {
    return motion_of_frame(view.clip_from_world, view.unjittered_clip_from_world);
}
