//! The examples that write pictures, each run once and small, and something true of each picture.

use crate::built_example::{self, scratch};
use bevy::math::{IVec2, UVec2, Vec3};
use bevy_mirrorball::camera::{FramePixels, srgb_to_linear};
use std::path::Path;

/// Parts of messages that a user would take for trouble.
const TROUBLE: [&str; 3] = ["WARN", "panicked", "alidation"];

/// Runs an example, and returns what it printed, or `None` where it cannot run.
pub(crate) fn run(name: &str, arguments: &[&str]) -> Option<String> {
    let output = built_example::run(name, arguments)?;
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{name}: {said}");
    assert!(!TROUBLE.iter().any(|word| said.contains(word)), "{name}: {said}");
    Some(said)
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("the target folder has a printable name")
}

pub(crate) fn open(path: &Path) -> FramePixels {
    FramePixels::open(path).expect("written")
}

/// Positions in a rectangle.
pub(crate) fn places(size: UVec2) -> impl Iterator<Item = (i32, i32)> + Clone {
    (0..size.y as i32).flat_map(move |y| (0..size.x as i32).map(move |x| (x, y)))
}

fn luminance(picture: &FramePixels, at: IVec2) -> f32 {
    picture.linear(at.x, at.y).dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Numbers of pixels of two rectangles of a picture that differ by more than 20/255, in the second brighter and darker.
fn changed(picture: &FramePixels, [one, two]: [IVec2; 2], size: UVec2) -> [usize; 2] {
    let step = |(x, y): (i32, i32)| {
        let green = |corner: IVec2| i32::from(picture.rgb8(corner.x + x, corner.y + y)[1]);
        green(two) - green(one)
    };
    [places(size).filter(|at| step(*at) > 20).count(), places(size).filter(|at| step(*at) < -20).count()]
}

#[test]
fn eight_cases_leaves_what_is_real_and_adds_what_is_virtual() {
    const SHRINK: i32 = 4;
    let (corner, part, margin) = (IVec2::new(200, 190) / SHRINK, UVec2::new(430, 290) / SHRINK as u32, 8);
    let out = scratch("eight_cases.png");
    if run("eight_cases", &["--shrink", "4", "--out", text(&out)]).is_none() {
        return;
    }
    let sheet = open(&out);
    let cell = part.as_ivec2() + margin;
    assert_eq!(sheet.size.as_ivec2(), IVec2::new(4, 2) * cell + IVec2::splat(margin));
    let case = |i: i32| IVec2::splat(margin) + IVec2::new(i % 4, i / 4) * cell;

    // Everything real: the photograph, of which a pixel shows the middle of 4 × 4.
    let photo = FramePixels::open("assets/desk/photo.jpg").expect("shipped");
    let worst = places(part).map(|(x, y)| {
        let four = [(1, 1), (2, 1), (1, 2), (2, 2)].map(|(dx, dy)| {
            let at = SHRINK * (corner + IVec2::new(x, y)) + IVec2::new(dx, dy);
            photo.rgb8(at.x, at.y).map(srgb_to_linear)
        });
        let shown = sheet.rgb8(case(0).x + x, case(0).y + y).map(srgb_to_linear);
        (0..3).map(|c| (four.iter().map(|rgb| rgb[c]).sum::<f32>() / 4.0 - shown[c]).abs()).fold(0.0, f32::max)
    });
    let worst = worst.fold(0.0, f32::max);
    assert!(worst <= 0.02, "the photograph has changed by {worst} in linear light");

    // By bits: virtual plate, virtual can, virtual lamp.
    let from_photo = |i: i32| changed(&sheet, [case(0), case(i)], part);
    println!("brighter and darker pixels of each case: {:?}", (1..8).map(from_photo).collect::<Vec<_>>());
    let [plate, _] = from_photo(1);
    assert!(plate > 60, "the white plate is missing: {plate} pixels are brighter");
    let yellow = |i: i32| {
        let is_yellow = |(x, y): &(i32, i32)| {
            let [red, green, blue] = sheet.rgb8(case(i).x + x, case(i).y + y).map(i32::from);
            red > 90 && green > 60 && 2 * blue < green
        };
        places(part).filter(is_yellow).count()
    };
    assert!(yellow(2) > yellow(0) + 60, "the yellow can is missing: {} and {} pixels", yellow(2), yellow(0));
    let [lit, _] = from_photo(4);
    assert!(lit > 100, "the lamp does not shine: {lit} pixels are brighter");
    // The virtual can stands in the light of the lamp: less is lit behind it.
    let [_, shadowed] = changed(&sheet, [case(4), case(6)], part);
    assert!(shadowed > 60, "the can throws no shadow of the lamp: {shadowed} pixels are darker");
}

#[cfg(feature = "egui")]
#[test]
fn shadow_lab_throws_shadows_of_cars_that_drive() {
    let out = scratch("shadow_lab");
    let options = ["--headless", "--frames", "2", "--size", "128x72", "--directions", "32", "--out", text(&out)];
    if run("shadow_lab", &options).is_none() {
        return;
    }
    let [first, second] = [0, 1].map(|i| open(&out.join(format!("frame_{i:04}.png"))));
    assert_eq!(first.size, UVec2::new(128, 72));
    let differ = places(first.size).filter(|(x, y)| first.rgb8(*x, *y) != second.rgb8(*x, *y)).count();
    let clear = places(first.size).filter(|(x, y)| first.rgb8(*x, *y) == [158, 173, 191]).count();
    // Gray surfaces: in the light, and in the shadow of the lamp.
    let grays: Vec<f32> = places(first.size)
        .filter(|(x, y)| {
            let rgb = first.rgb8(*x, *y);
            rgb != [158, 173, 191] && rgb.iter().max().zip(rgb.iter().min()).is_some_and(|(max, min)| max - min < 60)
        })
        .map(|(x, y)| luminance(&first, IVec2::new(x, y)))
        .collect();
    let brightest = grays.iter().copied().fold(0.0, f32::max);
    let shadowed = grays.iter().filter(|light| **light < 0.5 * brightest).count();
    println!("{differ} pixels move, {clear} show no surface, {shadowed} of {} gray ones are in shadow", grays.len());
    assert!(differ > 100, "nothing drives: {differ}");
    assert!(grays.len() > 2000 && shadowed > 200, "{shadowed} of {} pixels", grays.len());
}

#[test]
fn live_environment_mirrors_its_sky_in_smooth_spheres_and_not_in_rough_ones() {
    let out = scratch("live_environment");
    if run("live_environment", &["--headless", "--frames", "3", "--out", text(&out)]).is_none() {
        return;
    }
    let [first, last] = [0, 2].map(|i| open(&out.join(format!("frame_{i:04}.png"))));
    assert_eq!(first.size, UVec2::new(480, 240));
    // Metal spheres in the back row, from smooth to rough, where the camera sees them.
    let focal = 120.0 / (std::f32::consts::FRAC_PI_8).tan();
    let eye = Vec3::new(0.0, 0.9, 4.4);
    let view = bevy::math::Mat4::look_at_rh(eye, Vec3::new(0.0, 0.2, 0.0), Vec3::Y);
    let contrast = |column: i32| {
        let place = view.transform_point3(Vec3::new(column as f32 - 2.0, 0.75, -0.5));
        let middle =
            IVec2::new(240, 120) + (focal * place.truncate() / -place.z * bevy::math::Vec2::new(1.0, -1.0)).as_ivec2();
        let reach = (0.6 * 0.45 * focal / -place.z) as i32;
        let lights = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| IVec2::new(dx, dy)));
        let lights: Vec<f32> = lights.map(|offset| luminance(&first, middle + offset)).collect();
        let mean = lights.iter().sum::<f32>() / lights.len() as f32;
        let square = lights.iter().map(|light| (light - mean).powi(2)).sum::<f32>() / lights.len() as f32;
        square.sqrt() / mean
    };
    let (smooth, rough) = (contrast(0), contrast(4));
    let moved = places(first.size).filter(|(x, y)| first.rgb8(*x, *y) != last.rgb8(*x, *y)).count();
    println!("contrast {smooth:.3} in a smooth sphere, {rough:.3} in a rough one; {moved} pixels move");
    assert!(smooth > 1.5 * rough && rough > 0.0, "{smooth} and {rough}");
    assert!(moved > 1000, "the sun does not move: {moved} pixels");
}

#[test]
fn real_lights_draws_arrows_on_the_recorded_desk_and_finds_more_light_when_it_recovers_it() {
    let out = scratch("real_lights.png");
    let Some(said) = run("real_lights", &["--picture", "20", "--out", text(&out)]) else { return };
    let picture = open(&out);
    assert_eq!(picture.size, UVec2::new(1280, 480));
    let (clipped, recovered) = said.split_once("recovered:").expect("both halves are announced");
    // "… 12.3 % of all light" of the strongest light, which comes first.
    let strongest = |half: &str| -> f32 {
        let percent = half.split(" % of all light").next().and_then(|text| text.rsplit(' ').next());
        percent.and_then(|number| number.parse().ok()).expect("a light is described")
    };
    println!("strongest light: {} % clipped, {} % recovered", strongest(clipped), strongest(recovered));
    assert!(strongest(recovered) > strongest(clipped), "{said}");
    let photo = FramePixels::open("assets/desk_clip/frame_020.jpg").expect("shipped");
    for (name, left) in [("clipped", 0), ("recovered", 640)] {
        let step = |(x, y): (i32, i32)| {
            (0..3).map(|c| picture.rgb8(left + x, y)[c].abs_diff(photo.rgb8(x, y)[c])).max().unwrap_or(0)
        };
        let different = places(photo.size).filter(|at| step(*at) > 30).count();
        println!("{name}: {different} pixels show something else");
        assert!((300..60_000).contains(&different), "{name}: {different} pixels of arrows and labels");
        assert!([(4, 475), (635, 475)].into_iter().all(|at| step(at) <= 1), "{name}: the picture changed");
    }
}
