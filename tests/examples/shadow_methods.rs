//! The methods of `shadow_lab` and of `composite` beside the dome.

use crate::{
    built_example::scratch,
    picture_writers::{open, places, run, text},
};
use bevy_mirrorball::camera::FramePixels;

/// Draws the room of the lab in the shadows of a method.
fn draw(method: &str) -> Option<FramePixels> {
    let out = scratch(&format!("shadow_methods_{method}"));
    let options = ["--headless", "--frames", "1", "--size", "160x90", "--method", method, "--out", text(&out)];
    run("shadow_lab", &options)?;
    Some(open(&out.join("frame_0000.png")))
}

/// Number of pixels that are darker than in another picture by a tenth and by a third.
fn darker(picture: &FramePixels, reference: &FramePixels) -> [usize; 2] {
    let sum = |picture: &FramePixels, x, y| picture.rgb8(x, y).iter().map(|value| u32::from(*value)).sum::<u32>();
    [9, 6].map(|tenths| {
        places(picture.size).filter(|(x, y)| 10 * sum(picture, *x, *y) < tenths * sum(reference, *x, *y)).count()
    })
}

#[test]
fn planar_shadows_of_the_lab_are_hard_or_soft_and_those_of_the_map_fall_on_walls_too() {
    let Some(bright) = draw("none") else { return };
    let [hard, soft, map] =
        ["planar", "soft-planar", "map"].map(|method| darker(&draw(method).expect("it drew one"), &bright));
    println!("darker by a tenth and by a third: planar {hard:?}, soft {soft:?}, map {map:?}");
    assert!(hard[0] > 150, "the sign and the cars throw shadows: {hard:?}");
    assert!(soft[0] > hard[0] && soft[1] > hard[1], "soft ones are wider, and deeper below things: {soft:?}");
    assert!(map[0] > 150, "Bevy's light throws shadows: {map:?}");
}

#[test]
fn planar_shadows_fall_onto_a_photographed_desk() {
    let compose = |method: &str| {
        let out = scratch(&format!("desk_{method}.png"));
        let desk = ["--frame", "assets/desk/photo.jpg", "--intrinsics", "601.83,601.83,320,240"];
        let rest = ["--scene", "assets/desk/desk.glb", "--shadows", method, "--out", text(&out)];
        run("composite", &[&desk[..], &rest].concat())?;
        Some(open(&out))
    };
    let Some(bright) = compose("none") else { return };
    let [hard, soft, dome] =
        ["planar", "soft-planar", "dome"].map(|method| darker(&compose(method).expect("it composed one"), &bright));
    println!("darker by a tenth and by a third: planar {hard:?}, soft {soft:?}, dome {dome:?}");
    assert!(soft[0] > 500 && hard[0] < soft[0], "planar {hard:?}, soft {soft:?}, dome {dome:?}");
    assert!(soft[0] < 2 * dome[0] && 2 * soft[0] > dome[0], "as much as under the dome: {soft:?}, {dome:?}");
}
