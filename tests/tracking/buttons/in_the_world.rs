//! Buttons as components: on a sheet that the plugin tracks, in frames of a camera.

use super::dots::DotGrid;
use crate::{
    lens::LENS,
    scripted_desk::{Desk, SIZE, first_view, seen},
};
use bevy::prelude::*;
use bevy_mirrorball::{camera::FramePixels, prelude::*};
use std::time::Duration;

const FIELD: Vec2 = Vec2::new(0.08, 0.06);
/// Middles of two buttons, in the frame of the marker.
const PLACES: [Vec2; 2] = [Vec2::new(-0.06, 0.11), Vec2::new(0.06, 0.11)];

/// The sheet as the camera sees it, in a light of 0…1, with a finger across some of the fields.
fn picture(light: f32, covered: &[usize]) -> FramePixels {
    let marker_from_camera = first_view().inverse();
    let eye = Vec3::from(marker_from_camera.translation);
    let grid = DotGrid::new(FIELD);
    let dots: Vec<Vec2> = grid.centers().collect();
    let reflectance = |at: Vec2| {
        let in_field = PLACES.iter().position(|place| (2.0 * (at - place)).abs().cmple(FIELD).all());
        let Some(field) = in_field else { return 0.8 };
        let at = at - PLACES[field];
        match covered.contains(&field) && at.x.abs() < 0.009 && at.y > -0.01 {
            true => 0.35,
            false if dots.iter().any(|dot| dot.distance(at) < grid.dot_radius()) => 0.05,
            false => 0.8,
        }
    };
    let pixel = |i: u32| {
        let value: f32 = (0..9)
            .map(|part| {
                let offset = Vec2::new((part % 3) as f32 + 0.5, (part / 3) as f32 + 0.5) / 3.0;
                let pixel = UVec2::new(i % LENS.size.x, i / LENS.size.x).as_vec2() + offset;
                let ray = marker_from_camera.rotation * LENS.ray(pixel);
                light * reflectance((eye - ray * (eye.y / ray.y)).xz()) / 9.0
            })
            .sum();
        let byte = (255.0 * Srgba::gamma_function_inverse(value)) as u8;
        [byte, byte, byte, 255]
    };
    FramePixels::new(LENS.size, (0..LENS.size.element_product()).flat_map(pixel).collect()).expect("fits")
}

/// Events of a button: whether it was covered, and when.
#[derive(Resource, Default)]
struct Events(Vec<(Entity, bool, Duration)>);

#[test]
fn a_button_tells_when_it_is_covered_and_uncovered() {
    let mut desk = Desk::new();
    let camera = desk.camera;
    desk.app.init_resource::<Events>();
    desk.app
        .add_observer(|on: On<ButtonCovered>, mut events: ResMut<Events>| events.0.push((on.entity, true, on.at)))
        .add_observer(|on: On<ButtonUncovered>, mut events: ResMut<Events>| events.0.push((on.entity, false, on.at)));
    let sheet = desk.spawn((MarkerAnchor::new(3, SIZE), WorldOrigin));
    let buttons = PLACES.map(|place| {
        desk.spawn((VirtualButton::new(FIELD), Transform::from_xyz(place.x, 0.0, place.y), ChildOf(sheet)))
    });
    let marker = [seen(3, first_view())];
    let show = |desk: &mut Desk, light: f32, covered: &[usize]| {
        desk.show_pixels_to(camera, &marker, picture(light, covered));
        buttons.map(|button| desk.get::<VirtualButtonState>(button))
    };
    let free = show(&mut desk, 0.5, &[]);
    assert_eq!(free.map(|state| state.is_covered), [Some(false); 2], "{free:?}");
    // A lamp is switched off.
    show(&mut desk, 0.15, &[]);
    assert!(desk.app.world().resource::<Events>().0.is_empty());
    let pressed = show(&mut desk, 0.15, &[1]);
    assert_eq!(pressed.map(|state| state.is_pressed()), [false, true]);
    assert!((0.1..0.4).contains(&pressed[1].coverage), "{pressed:?}");
    let events = desk.app.world().resource::<Events>().0.clone();
    let [(button, true, at)] = events[..] else { panic!("{events:?}") };
    // The marker was seen at frames 2 and 3, 40 ms apart.
    assert!(button == buttons[1] && pressed[1].changed_at == Some(at));
    assert!(at > Duration::from_millis(80) && at <= Duration::from_millis(120), "{at:?}");
    // In the dark nobody knows, and both lights change nothing.
    show(&mut desk, 0.002, &[]);
    assert!(desk.get::<VirtualButtonState>(buttons[1]).is_pressed());
    show(&mut desk, 0.9, &[]);
    let events = &desk.app.world().resource::<Events>().0;
    assert!(matches!(events[..], [_, (button, false, _)] if button == buttons[1]), "{events:?}");
}

#[test]
fn a_button_whose_sheet_is_not_seen_knows_nothing() {
    let mut desk = Desk::new();
    let camera = desk.camera;
    let sheet = desk.spawn(MarkerAnchor::new(3, SIZE));
    let button = desk.spawn((VirtualButton::default(), ChildOf(sheet)));
    desk.show_pixels_to(camera, &[], picture(0.5, &[0, 1]));
    assert_eq!(desk.get::<VirtualButtonState>(button), VirtualButtonState::default());
}
