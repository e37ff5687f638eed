//! Triangulation of lights from their mirror images in two balls.
//!
//! Two balls mirror a distant light from the same direction and a near light from directions that intersect. The
//! comparison uses the frame itself: the center of the pixels in each ball that are brighter than white paper could be.

use super::{
    desk_frame::{DeskFrame, MirrorBall},
    detect_lights::DetectedLight,
    radiance_cells::{BallInFrame, CELLS_PER_EDGE},
    regions::{Region, connected_groups},
    solved_light::SolvedLight,
};
use crate::probe::{BallView, EDGE_MARGIN_PIXELS};
use glam::{Vec2, Vec3};

/// Angle between samples of the sky around a light, radians.
const STEP: f32 = 0.006;
/// Margin of the sampled area beyond a light's radius, radians.
const MARGIN: f32 = 0.06;
/// Largest angle between the directions from two balls to a light, radians. Reached by lights at a third of a meter.
const MAX_PARALLAX: f32 = 0.5;
/// Uncertainty of the center of an image, pixels.
const CENTROID_SIGMA_PIXELS: f32 = 0.3;
/// Smallest parallax, in units of its uncertainty, at which a position is estimated.
const MIN_PARALLAX_SIGMAS: f32 = 3.0;
/// Largest angle at which rays of the same light pass each other, in units of its uncertainty.
const MAX_MISS_SIGMAS: f32 = 4.0;

/// Image of a light in a ball.
#[derive(Clone, Copy)]
struct LightImage {
    /// Point of the ball, world space.
    origin: Vec3,
    /// Direction to the light, world space, unit.
    dir: Vec3,
    /// Uncertainty of the direction, radians.
    sigma: f32,
}

impl DeskFrame {
    /// Lights of a solution for this frame, strongest first: [`SolvedLight::lights`] with the positions that a second
    /// ball reveals.
    pub fn lights(&self, solved: &SolvedLight) -> Vec<DetectedLight> {
        let mut lights = solved.lights();
        triangulate(self, &mut lights);
        lights
    }
}

/// Sets the position of lights that two balls show from different directions.
fn triangulate(desk: &DeskFrame, lights: &mut [DetectedLight]) {
    let mut placed = vec![None; lights.len()];
    for other in &desk.other_balls {
        let candidates = bright_directions(desk, other);
        for (light, place) in lights.iter().zip(&mut placed) {
            let Some(first) = light_image(desk, &desk.ball, light.direction, light.angular_radius + MARGIN) else {
                continue;
            };
            // Of several lights, the one whose ray passes this ray most closely counts.
            let intersections = candidates.iter().filter(|dir| dir.angle_between(light.direction) < MAX_PARALLAX);
            let intersections = intersections.filter_map(|dir| {
                let second = light_image(desk, other, *dir, light.angular_radius + MARGIN)?;
                intersect(first, second)
            });
            let best = intersections
                .min_by(|a, b| a.miss.total_cmp(&b.miss))
                .filter(|intersection| intersection.miss < MAX_MISS_SIGMAS);
            if let Some(intersection) = best {
                *place = intersection.position.or(*place);
            }
        }
    }
    for (light, place) in lights.iter_mut().zip(placed) {
        if let Some(position) = place {
            light.position = Some(position);
            light.direction = (position - desk.ball.center).normalize_or(light.direction);
        }
    }
}

/// Directions to the centers of what a ball shows brighter than white.
fn bright_directions(desk: &DeskFrame, ball: &MirrorBall) -> Vec<Vec3> {
    let Some(view) = BallView::new(desk.camera_from_world.transform_point3(ball.center), ball.radius) else {
        return Vec::new();
    };
    let sky = BallInFrame::new(desk.posed_frame(), ball, &view).radiance_cells(CELLS_PER_EDGE);
    let white = 0.95 / desk.ball.reflectance.max(ball.reflectance);
    let bright: Vec<usize> = (0..sky.len()).filter(|&i| sky[i].seen.max_element() >= white).collect();
    let weight = |i: usize| sky[i].solid_angle;
    connected_groups(&bright, &sky).into_iter().map(|cells| Region::new(cells, &sky, &weight).dir_world).collect()
}

/// Closest approach of two rays.
struct Intersection {
    /// Angle at which the rays pass each other, in units of its uncertainty.
    miss: f32,
    /// Position; `None` if the rays are parallel within their uncertainty.
    position: Option<Vec3>,
}

fn intersect(a: LightImage, b: LightImage) -> Option<Intersection> {
    let between = b.origin - a.origin;
    let cos = a.dir.dot(b.dir);
    let sigma = (a.sigma * a.sigma + b.sigma * b.sigma).sqrt();
    // The baseline and the rays span the plane in which a light's distance causes parallax.
    let parallax = a.dir.angle_between(b.dir);
    let normal = a.dir.cross(between).normalize_or_zero();
    let miss = b.dir.dot(normal).abs() / sigma;
    let sin_squared = 1.0 - cos * cos;
    if parallax < MIN_PARALLAX_SIGMAS * sigma || sin_squared < 1e-9 {
        return Some(Intersection { miss, position: None });
    }
    let along_a = (between.dot(a.dir) - between.dot(b.dir) * cos) / sin_squared;
    let along_b = (between.dot(a.dir) * cos - between.dot(b.dir)) / sin_squared;
    let middle = 0.5 * (a.origin + along_a * a.dir + b.origin + along_b * b.dir);
    (along_a > 0.0 && along_b > 0.0).then_some(Intersection { miss, position: Some(middle) })
}

/// Center of what is brighter than white around a direction.
fn light_image(desk: &DeskFrame, ball: &MirrorBall, dir_world: Vec3, reach: f32) -> Option<LightImage> {
    let view = BallView::new(desk.camera_from_world.transform_point3(ball.center), ball.radius)?;
    let ball_in_frame = BallInFrame::new(desk.posed_frame(), ball, &view);
    let edge_angle = view.edge_angle(&desk.intrinsics, EDGE_MARGIN_PIXELS);
    let white = 0.98 / desk.ball.reflectance;
    let steps = (reach / STEP).ceil() as i32;
    let mut dir = dir_world;
    // The window moves to the center that it finds.
    for _ in 0..3 {
        let (right, up) = dir.any_orthonormal_pair();
        let mut sum = Vec3::ZERO;
        for y in -steps..=steps {
            for x in -steps..=steps {
                let across = Vec2::new(x as f32, y as f32) * STEP;
                if across.length() > reach {
                    continue;
                }
                let at = (dir + across.x * right + across.y * up).normalize();
                let brightness = ball_in_frame.radiance(at, edge_angle)?.max_element();
                // Clamped at the level where the bright ball clips, so that both balls show the same shape.
                sum += at * (brightness / white - 0.5).clamp(0.0, 0.5);
            }
        }
        dir = sum.try_normalize()?;
    }
    let world_from_camera = desk.camera_from_world.inverse();
    let dir_camera = desk.camera_from_world.transform_vector3(dir);
    let point_camera = view.surface_point(dir_camera, edge_angle);
    let angle = (-view.center_camera).angle_between(dir_camera);
    let per_pixel = 2.0 / (view.radius_pixels(&desk.intrinsics) * (0.5 * angle).cos().max(0.05));
    Some(LightImage {
        origin: world_from_camera.transform_point3(point_camera),
        dir,
        sigma: CENTROID_SIGMA_PIXELS * per_pixel,
    })
}
