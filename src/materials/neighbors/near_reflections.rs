//! Twin of the search in `neighbor_cubes.wgsl`: where a reflected ray meets what a cube with distances shows.
//!
//! A place on the ray is p(s) ∝ mix(o, r, s), with the unit vectors o from the center of the cube to the surface and r
//! of the ray: s = 0 is the surface, s = 1 infinitely far away. The ray is behind what the cube shows where the
//! distance of p is larger than the one stored in its direction. Reciprocal distances make that a comparison without
//! infinities, and linear in s for planes, so that the secant method finds desks and boxes at once; the linear search
//! before it finds the first of several hits.

use bevy::prelude::*;

const SEARCHED_INTERVALS: u32 = 4;
const SECANT_STEPS: u32 = 2;

/// Reciprocal distance from the center by direction.
type Distances<'a> = &'a dyn Fn(Vec3) -> f32;

/// Twin of `gap` in `neighbor_cubes.wgsl`.
fn gap(reciprocal: Distances, start: Vec3, dir: Vec3, distance: f32, s: f32) -> f32 {
    let along = start.lerp(dir, s);
    along.length() * distance * reciprocal(along.normalize_or(dir)) - (1.0 - s)
}

/// Twin of `crossing` in `neighbor_cubes.wgsl`.
fn crossing(before: Vec2, after: Vec2) -> f32 {
    let fraction = (-before.y / (after.y - before.y).max(1e-6)).clamp(0.0, 1.0);
    before.x + (after.x - before.x) * fraction
}

/// Direction from the center to what a ray hits. Twin of `hit` in `neighbor_cubes.wgsl`.
fn hit(reciprocal: Distances, place: Vec3, dir: Vec3) -> Vec3 {
    let distance = place.length().max(1e-6);
    let start = place / distance;
    let gap_at = |s: f32| Vec2::new(s, gap(reciprocal, start, dir, distance, s));
    let mut before = gap_at(0.0);
    let mut after = before;
    for i in 1..=SEARCHED_INTERVALS {
        if after.y >= 0.0 {
            break;
        }
        before = after;
        after = gap_at(i as f32 / SEARCHED_INTERVALS as f32);
    }
    for _ in 0..SECANT_STEPS {
        let tried = gap_at(crossing(before, after));
        if tried.y < 0.0 {
            before = tried;
        } else {
            after = tried;
        }
    }
    start.lerp(dir, crossing(before, after)).normalize_or(dir)
}

/// Places on a ball of 4 cm, and directions away from it.
fn rays() -> impl Iterator<Item = (Vec3, Vec3)> {
    let unit = |i: f32, turn: f32| {
        let (y, angle) = (1.0 - 2.0 * ((i + 0.5) / 200.0), i * turn);
        let across = (1.0 - y * y).sqrt();
        Vec3::new(across * angle.cos(), y, across * angle.sin())
    };
    let rays = (0..200).map(move |i| (unit(i as f32, 2.4), unit((i * 77 % 200) as f32, 1.7)));
    rays.filter(|(normal, dir)| normal.dot(*dir) > 0.0).map(|(normal, dir)| (0.04 * normal, dir))
}

#[test]
fn a_desk_is_hit_where_it_is() {
    // 5 cm below the center.
    let desk = |dir: Vec3| (-dir.y).max(0.0) / 0.05;
    for (place, dir) in rays() {
        let found = hit(&desk, place, dir);
        let expected = match dir.y {
            down if down < 0.0 => (place - dir * ((place.y + 0.05) / down)).normalize(),
            _ => dir,
        };
        assert!(found.distance(expected) < 2e-3, "from {place} to {dir}: {found} instead of {expected}");
    }
}

#[test]
fn the_inside_of_a_sphere_is_hit_where_it_is() {
    let sphere = |_: Vec3| 1.0 / 0.1;
    for (place, dir) in rays() {
        let b = place.dot(dir);
        let expected = (place + dir * (-b + (b * b - place.length_squared() + 0.01).sqrt())).normalize();
        let found = hit(&sphere, place, dir);
        assert!(found.distance(expected) < 0.01, "from {place} to {dir}: {found} instead of {expected}");
    }
}

#[test]
fn a_ball_beside_the_mirror_is_hit_where_it_is_and_the_sky_around_it_is_infinitely_far() {
    let (center, radius) = (Vec3::new(0.12, 0.0, 0.0), 0.04);
    let along = |from: Vec3, dir: Vec3| {
        let b = dir.dot(center - from);
        let inside = b * b - (center - from).length_squared() + radius * radius;
        (inside > 0.0 && b > 0.0).then(|| b - inside.sqrt())
    };
    let ball = |dir: Vec3| along(Vec3::ZERO, dir).map_or(0.0, |distance| 1.0 / distance);
    let (mut hits, mut found_hits) = (0, 0);
    for (place, dir) in rays() {
        let found = hit(&ball, place, dir);
        match along(place, dir) {
            // Parts that the center does not see have no distances.
            Some(distance) => {
                hits += 1;
                found_hits += usize::from(found.distance((place + dir * distance).normalize()) < 0.05);
            }
            None if along(Vec3::ZERO, dir).is_none() && ball(found) == 0.0 => assert!(found.distance(dir) < 1e-3),
            None => (),
        }
    }
    assert!(hits >= 3 && found_hits * 10 >= hits * 7, "{found_hits} of {hits}");
}
