//! A dark ball beside the bright one: the same picture at a shorter exposure (Karlsson & Selegård 2005, 3.1.6).

use super::{
    desk_picture::DeskPicture,
    ray_cast::sphere_is_hit,
    regions::Region,
    sky::{BallPicture, SKY_EDGE, SkyCell},
};
use crate::probe::{BallView, EDGE_MARGIN_PIXELS};
use bevy::{math::DVec3, prelude::*};

/// What a darker ball says of a piece of the sky that the bright one shows clipped: radiance · steradian per channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DarkReading {
    pub region: usize,
    /// Light of the piece in the darker ball.
    pub energy: DVec3,
    /// Per channel, whether the darker ball clips there too or shows a part only: then it is that much light or more.
    pub is_bound: [bool; 3],
    /// Extra radiance of each of the region's cells, if both balls show the light in the same place: then it is far away.
    pub shape: Option<Vec<f32>>,
}

/// A ball at most this bright compared with the other tells more of lamps than that one.
const DARKER: f32 = 0.5;
/// Lamps as near as half a metre move this much from ball to ball, radians.
const FARTHEST: f32 = 0.3;
/// Clipped light in the darker ball below this share of all does not count.
const CLIPPED_SHARE: f32 = 0.02;
/// Where the darker ball shows less of a region's solid angle, the region has more light than that.
const LEAST_COVERAGE: f32 = 0.8;

/// So much of a light that is far away is where the bright ball has it.
const LEAST_IN_PLACE: f32 = 0.7;

/// Reads the clipped pieces of the sky in all balls that are darker.
pub(super) fn read_dark_balls(picture: &DeskPicture, sky: &[SkyCell], regions: &[Region]) -> Vec<DarkReading> {
    let darker = |reflectance: f32| reflectance < DARKER * picture.ball.reflectance;
    let balls = picture.other_balls.iter().filter(|ball| darker(ball.reflectance));
    balls.flat_map(|ball| read_dark_ball(picture, ball, sky, regions)).collect()
}

fn read_dark_ball(
    picture: &DeskPicture,
    ball: &super::MirrorBall,
    sky: &[SkyCell],
    regions: &[Region],
) -> Vec<DarkReading> {
    let Some(view) = BallView::new(picture.camera_from_world.transform_point3(ball.center), ball.radius) else {
        return Vec::new();
    };
    let dark = BallPicture::new(picture, ball, &view).sky(SKY_EDGE);
    let edge_angle = view.edge_angle(&picture.intrinsics, EDGE_MARGIN_PIXELS);
    let to_camera = (Vec3::from(picture.camera_from_world.inverse().translation) - ball.center).normalize_or_zero();
    let is_shown = |dir: Vec3| {
        let is_hidden = |other: &super::MirrorBall| {
            let from_surface = other.center - ball.center - ball.radius * (dir + to_camera).normalize_or_zero();
            sphere_is_hit(from_surface, other.radius, dir) || sphere_is_hit(from_surface, other.radius, to_camera)
        };
        dir.angle_between(to_camera) < edge_angle
            && !std::iter::once(&picture.ball)
                .chain(&picture.other_balls)
                .any(|other| other.center != ball.center && is_hidden(other))
    };
    // What is brighter than white in the dark ball is what the bright one clips; lamps that are near stand elsewhere in it.
    let white = 1.0 / picture.ball.reflectance;
    let mut sums = vec![(Vec3::ZERO, Vec3::ZERO); regions.len()];
    for cell in dark.iter().filter(|cell| cell.seen.max_element() >= white && is_shown(cell.dir_world)) {
        let distance = |region: &Region| {
            let nearest = region.cells.iter().map(|&i| sky[i].dir_world.distance_squared(cell.dir_world));
            nearest.fold(f32::INFINITY, f32::min)
        };
        let nearest = regions.iter().enumerate().map(|(r, region)| (r, distance(region)));
        let nearest = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, d)| *d < FARTHEST * FARTHEST);
        if let Some((r, _)) = nearest {
            sums[r].0 += cell.solid_angle * cell.seen;
            sums[r].1 += cell.solid_angle * (cell.clipped + cell.limited);
        }
    }
    let is_covered = |region: &Region| {
        let shown = region.cells.iter().map(|&i| &sky[i]).filter(|cell| is_shown(cell.dir_world));
        shown.map(|cell| cell.solid_angle).sum::<f32>() >= LEAST_COVERAGE * region.solid_angle
    };
    let readings = sums.into_iter().zip(regions).enumerate().map(|(region, ((energy, clipped), cells))| {
        let is_bound = |c| clipped[c] > CLIPPED_SHARE * energy[c] || !is_covered(cells);
        let extra = |&i: &usize| (dark[i].seen - sky[i].seen).element_sum().max(0.0);
        let in_place: f32 = cells.cells.iter().map(|&i| sky[i].solid_angle * dark[i].seen.element_sum()).sum();
        let is_in_place = in_place >= LEAST_IN_PLACE * energy.element_sum() && is_covered(cells);
        let shape: Vec<f32> = cells.cells.iter().map(extra).collect();
        let has_shape = is_in_place && shape.iter().any(|extra| *extra > 0.0);
        DarkReading {
            region,
            energy: energy.as_dvec3(),
            is_bound: std::array::from_fn(is_bound),
            shape: has_shape.then_some(shape),
        }
    });
    readings.collect()
}
