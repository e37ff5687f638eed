//! Planar shadows on a phantom desk, against the dome and against ray casting.

use crate::{
    desk::{Desk, SKY, Shot, desk_picture},
    ray_truth::rays::{CUBE_EDGE, Errors, Shape, Thing, compare, places, sky, truth},
};
use bevy::prelude::*;
use bevy_mirrorball::{
    environment_map::{EnvironmentCube, EquirectPixels, equirect_direction},
    lighting::RealLight,
    prelude::*,
    shadows::{DomeCoverage, PlanarCasters, PlanarLight, PlanarLights, PlanarShadow, PlanarShadowState, PlanarStandIn},
};
use std::f32::consts::PI;

/// Rounding to 8 bits.
const SAME: u8 = 1;
/// Of the fraction of light, rounded twice to 8 bits.
const ROUNDING: f32 = 0.012;

fn thing(shape: Shape, center: Vec3) -> Thing {
    Thing { shape, center, is_real: false }
}

/// A box and a ball on the desk, and a ball in the air.
fn things() -> Vec<Thing> {
    vec![
        thing(Shape::Block(Vec3::new(0.03, 0.05, 0.04)), Vec3::new(-0.12, 0.05, 0.02)),
        thing(Shape::Ball(0.03), Vec3::new(0.05, 0.03, -0.08)),
        thing(Shape::Ball(0.025), Vec3::new(0.03, 0.12, 0.10)),
    ]
}

/// A desk with virtual things and without a dome.
fn desk_with(things: &[Thing]) -> Option<Desk> {
    let mut desk = Desk::new()?;
    desk.app.world_mut().entity_mut(desk.dome).remove::<ShadowDomeLight>();
    for thing in things {
        desk.add_virtual(thing.mesh(), thing.center);
    }
    Some(desk)
}

fn placed(light: PlanarLight) -> PlanarShadow {
    PlanarShadow { lights: PlanarLights::Placed(vec![light]), ..default() }
}

fn shoot(desk: &mut Desk, shadow: PlanarShadow) -> Shot {
    let receiver = desk.app.world_mut().spawn(shadow).id();
    let shot = desk.shoot();
    desk.app.world_mut().despawn(receiver);
    shot
}

fn dir(x: f32, y: f32, z: f32) -> Dir3 {
    Dir3::from_xyz(x, y, z).expect("not zero")
}

#[test]
fn one_direction_is_that_of_the_dome() {
    let things = things();
    let Some(mut desk) = desk_with(&things) else { return };
    let from = dir(1.0, 0.8, 0.4);
    let planar = shoot(&mut desk, placed(PlanarLight::distant(from, 0.0).with_share(LinearRgba::WHITE)));
    let dome = ShadowDomeLight {
        directions: 1,
        coverage: DomeCoverage::Hemisphere,
        key_lights: 0,
        resolution: 1024,
        surfels: 0,
        ..default()
    };
    let turned = Transform::from_rotation(Quat::from_rotation_arc(Vec3::Y, *from));
    desk.app.world_mut().entity_mut(desk.dome).insert((dome, turned));
    let dome = desk.shoot();
    // Of the pixels that are clear of an edge in both.
    let places: Vec<_> =
        places(&things).into_iter().filter(|place| place.x.abs() < 0.33 && place.z.abs() < 0.21).collect();
    let is_even = |shot: &Shot, place: Vec3| {
        let around = [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z];
        let ratios = around.map(|off| shot.ratio(place + 0.01 * off));
        ratios.iter().all(|ratio| (ratio - ratios[0]).abs() < ROUNDING)
    };
    let even: Vec<_> = places.iter().filter(|place| is_even(&planar, **place) && is_even(&dome, **place)).collect();
    let (mut worst, mut dark) = (0.0f32, 0);
    for place in &even {
        worst = worst.max((planar.ratio(**place) - dome.ratio(**place)).abs());
        dark += usize::from(planar.ratio(**place) < 0.1);
    }
    println!(
        "{} of {} places are clear of edges, {dark} in shadow; worst difference {worst:.4}",
        even.len(),
        places.len()
    );
    assert!(even.len() > places.len() / 2 && dark > 30);
    assert!(worst <= 0.01);
}

/// Fraction of a disc of light that reaches a place, by rays.
fn reaches(things: &[Thing], place: Vec3, center: Vec4, radius: f32) -> f32 {
    const EDGE: u32 = 24;
    let towards = center.truncate().normalize();
    let (right, up) = towards.any_orthonormal_pair();
    let (mut open, mut count) = (0, 0);
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let on_disc = (2.0 * Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / EDGE as f32 - 1.0) * radius;
        if on_disc.length() <= radius {
            let point = center.truncate() + on_disc.x * right + on_disc.y * up - center.w * place;
            count += 1;
            open += u32::from(!things.iter().any(|thing| thing.blocks(place, point.normalize())));
        }
    }
    open as f32 / count as f32
}

#[test]
fn the_soft_shadow_of_a_lamp_is_that_of_rays() {
    let things = things();
    let Some(mut desk) = desk_with(&things) else { return };
    let angular_radius = 5_f32.to_radians();
    for (name, light, center) in [
        ("far lamp", PlanarLight::distant(dir(0.5, 1.0, 0.3), angular_radius), dir(0.5, 1.0, 0.3).extend(0.0)),
        ("near lamp", PlanarLight::point(Vec3::new(0.3, 0.7, 0.2), angular_radius), Vec4::new(0.3, 0.7, 0.2, 1.0)),
    ] {
        let shot = shoot(&mut desk, placed(light.with_share(LinearRgba::WHITE)));
        let radius = angular_radius.tan() * center.truncate().length();
        let truth: Vec<_> = places(&things)
            .into_iter()
            .map(|place| (place, Vec3::splat(reaches(&things, place, center, radius))))
            .collect();
        let shadowed = truth.iter().filter(|(_, open)| open.y < 0.95).count();
        let Errors { rms, worst, rms_in_shadow } = compare(&shot, &truth);
        println!(
            "{name} of 10°: root mean square error {rms:.4}, in shadow {rms_in_shadow:.4} ({shadowed} places), worst {worst:.3}"
        );
        assert!(shadowed > 100, "there are shadows");
        assert!(rms <= 0.01 && rms_in_shadow <= 0.05 && worst <= 0.15);
    }
}

#[test]
fn shadows_under_an_uneven_sky_are_those_of_rays() {
    let things = things();
    let Some(mut desk) = desk_with(&things) else { return };
    desk.forget_light();
    // Gray from above, and twice as much from one side, in another color.
    let colored = |dir: Vec3| Vec3::splat(0.3) + dir.x.max(0.0) * Vec3::new(0.2, 0.6, 1.2);
    let size = UVec2::new(256, 128);
    let uv = |i: u32| (Vec2::new((i % size.x) as f32, (i / size.x) as f32) + 0.5) / size.as_vec2();
    let texels = (0..size.x * size.y).map(|i| colored(equirect_direction(uv(i)))).collect();
    let cube = EquirectPixels { size, texels }.to_cube(CUBE_EDGE, Quat::IDENTITY);
    let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(cube.to_image());
    desk.app.world_mut().spawn(EnvironmentCube(image));
    let truth = truth(&things, &sky(colored));
    for (ambient, goal) in [(32, 0.02), (64, 0.015)] {
        let shot = shoot(&mut desk, PlanarShadow { ambient, ..default() });
        let Errors { rms, worst, rms_in_shadow } = compare(&shot, &truth);
        // Of the color as well: red is hidden more behind things, where blue comes from the side.
        let colors = truth.iter().map(|(place, ratio)| (shot.color_ratio(*place) - ratio).length_squared() / 3.0);
        let all_colors = (colors.sum::<f32>() / truth.len() as f32).sqrt();
        println!(
            "{ambient} directions: root mean square error {rms:.4}, in shadow {rms_in_shadow:.4}, worst {worst:.3}; of all colors {all_colors:.4}"
        );
        assert!(rms <= goal && all_colors <= goal);
    }
    let shot = shoot(&mut desk, PlanarShadow { ambient: 0, ..default() });
    assert!(truth.iter().all(|(place, _)| (shot.ratio(*place) - 1.0).abs() < ROUNDING), "no lamps, no ambient light");
}

#[test]
fn each_light_takes_its_share_of_each_color_and_the_rest_stays() {
    let Some(mut desk) = desk_with(&[thing(Shape::Block(Vec3::new(0.05, 0.02, 0.05)), Vec3::new(0.0, 0.2, 0.0))])
    else {
        return;
    };
    let lights = vec![
        PlanarLight::distant(dir(1.0, 1.0, 0.0), 0.0).with_share(LinearRgba::rgb(0.5, 0.25, 0.0)),
        PlanarLight::distant(dir(-1.0, 1.0, 0.0), 0.0).with_share(LinearRgba::rgb(0.0, 0.25, 0.5)),
    ];
    let both = PlanarShadow { lights: PlanarLights::Placed(lights), ambient: 0, ..default() };
    let shot = shoot(&mut desk, both.clone());
    for (place, expected) in [
        (Vec3::new(-0.2, 0.0, 0.0), [0.5, 0.75, 1.0]),
        (Vec3::new(0.2, 0.0, 0.0), [1.0, 0.75, 0.5]),
        (Vec3::new(0.0, 0.0, 0.2), [1.0; 3]),
    ] {
        let ratio = shot.color_ratio(place);
        println!("{place}: {ratio:.3}, expected {expected:?}");
        assert!(ratio.abs_diff_eq(expected.into(), ROUNDING));
    }
    let weaker = shoot(&mut desk, PlanarShadow { strength: 0.5, ..both });
    let ratio = weaker.color_ratio(Vec3::new(-0.2, 0.0, 0.0));
    assert!(ratio.abs_diff_eq(Vec3::new(0.75, 0.875, 1.0), ROUNDING), "half as deep: {ratio}");
}

#[test]
fn a_real_light_takes_what_it_gives_of_the_measured_light() {
    let Some(mut desk) = desk_with(&[thing(Shape::Block(Vec3::new(0.05, 0.02, 0.05)), Vec3::new(0.0, 0.2, 0.0))])
    else {
        return;
    };
    let direction = dir(1.0, 1.0, 0.0);
    // The room gives π · SKY; the lamp is said to give 0.4 of that at the desk.
    let irradiance = 0.4 * PI * SKY / direction.y;
    let color = LinearRgba::rgb(1.0, 0.5, 0.0);
    let lamp = RealLight {
        id: 7,
        direction: *direction,
        position: None,
        color,
        irradiance,
        angular_radius: 0.02,
        fraction: 0.1,
    };
    desk.app.world_mut().spawn(lamp);
    let shot = shoot(&mut desk, PlanarShadow { ambient: 0, ..default() });
    let ratio = shot.color_ratio(Vec3::new(-0.2, 0.0, 0.0));
    println!("in the lamp's shadow {ratio:.3}");
    assert!(ratio.abs_diff_eq(Vec3::new(0.6, 0.8, 1.0), 0.02));
}

#[test]
fn nothing_above_the_lamp_below_the_desk_or_beside_the_receiver_casts() {
    let block = Shape::Block(Vec3::new(0.03, 0.02, 0.03));
    let lamp = PlanarLight::point(Vec3::new(0.0, 0.3, 0.0), 0.0).with_share(LinearRgba::WHITE);
    for (name, center, is_seen) in [
        ("under the lamp", Vec3::new(0.1, 0.1, 0.0), true),
        ("above the lamp", Vec3::new(0.1, 0.4, 0.0), false),
        ("below the desk", Vec3::new(0.1, -0.1, 0.0), false),
    ] {
        let Some(mut desk) = desk_with(&[thing(block, center)]) else { return };
        let before = desk.shoot();
        let after = shoot(&mut desk, placed(lamp));
        let off = after.difference(&before.0);
        println!("{name}: the picture differs by {off}/255");
        assert_eq!(off > SAME, is_seen);
    }
    // The receiver ends in the middle of the part of the shadow that the block does not hide from the camera.
    let Some(mut desk) = desk_with(&[thing(block, Vec3::new(0.1, 0.1, 0.0))]) else { return };
    let lamp = PlanarLight::distant(dir(0.0, 1.0, 0.0), 0.0).with_share(LinearRgba::WHITE);
    let half = PlanarShadow { half_size: Vec2::new(0.077, 0.5), ..placed(lamp) };
    let wide = shoot(&mut desk, PlanarShadow { casters: PlanarCasters::All, ..placed(lamp) });
    let narrow = shoot(&mut desk, half);
    let shadowed = |shot: &Shot| shot.0.iter().zip(desk_picture()).filter(|(a, b)| a.abs_diff(*b) > 20).count();
    let (wide, narrow) = (shadowed(&wide), shadowed(&narrow));
    println!("{wide} bytes differ with the whole receiver, {narrow} with half of it");
    assert!(narrow < wide);
}

#[test]
fn a_raised_and_turned_receiver_catches_what_is_above_it() {
    let Some(mut desk) = desk_with(&[thing(Shape::Ball(0.03), Vec3::new(-0.1, 0.25, 0.0))]) else { return };
    // A real box 10 cm high, turned.
    let turned = Transform::from_xyz(0.0, 0.1, 0.0).with_rotation(Quat::from_rotation_y(0.6));
    let top = Transform::from_xyz(0.0, 0.05, 0.0).with_rotation(Quat::from_rotation_y(0.6));
    let stand = desk.add(Cuboid::new(0.16, 0.1, 0.16), Vec3::ZERO, PhantomObject::default());
    desk.app.world_mut().entity_mut(stand).insert(top);
    let lamp = PlanarLight::distant(dir(-1.0, 1.5, 0.0), 0.0).with_share(LinearRgba::WHITE);
    let receiver = PlanarShadow { half_size: Vec2::splat(0.08), ..placed(lamp) };
    let entity = desk.app.world_mut().spawn((receiver, turned)).id();
    let shot = desk.shoot();
    // From (−0.1, 0.25) down to 0.1 along (1, −1.5).
    let (below, beside) = (Vec3::new(0.0, 0.1, 0.0), Vec3::new(-0.05, 0.1, 0.04));
    println!("on top of the box {:.3}, beside {:.3}", shot.ratio(below), shot.ratio(beside));
    assert!(shot.ratio(below) < ROUNDING && (shot.ratio(beside) - 1.0).abs() < ROUNDING);
    let world = desk.app.world_mut();
    world.entity_mut(entity).remove::<PlanarShadow>();
    let gone = desk.shoot();
    assert!((gone.ratio(below) - 1.0).abs() < ROUNDING, "taken away: {}", gone.ratio(below));
}

#[test]
fn shadows_are_drawn_again_only_when_something_changes_and_a_stand_in_casts() {
    let block = thing(Shape::Block(Vec3::new(0.02, 0.02, 0.02)), Vec3::new(0.0, 0.2, 0.0));
    let Some(mut desk) = desk_with(&[]) else { return };
    let caster = desk.add_virtual(block.mesh(), block.center);
    let lamp = PlanarLight::distant(dir(1.0, 1.0, 0.0), 0.0).with_share(LinearRgba::WHITE);
    let receiver = desk.app.world_mut().spawn(placed(lamp)).id();
    let place = Vec3::new(-0.2, 0.0, 0.0);
    assert!(desk.shoot().ratio(place) < ROUNDING);
    let state = |desk: &Desk| *desk.app.world().get::<PlanarShadowState>(receiver).expect("required");
    let first = state(&desk);
    assert_eq!((first.lights, first.casters), (1, 1));
    desk.shoot();
    assert_eq!(state(&desk), first, "nothing has changed");
    // Still in the block's own place is something smaller.
    let small = desk.app.world_mut().resource_mut::<Assets<Mesh>>().add(Cuboid::from_length(0.004));
    desk.app.world_mut().entity_mut(caster).insert(PlanarStandIn(small));
    let with_stand_in = desk.shoot();
    assert!((with_stand_in.ratio(place + 0.015 * Vec3::Z) - 1.0).abs() < ROUNDING);
    assert!(state(&desk).drawings > first.drawings);
    desk.app.world_mut().despawn(caster);
    let empty = desk.shoot().difference(&desk_picture());
    assert!(empty <= SAME, "nothing casts: off by {empty}");
}
