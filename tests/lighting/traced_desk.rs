//! Ray-traced pictures of a desk under any sky and any lamps, with what is known of them: a marker's paper, mirrored
//! balls, folded paper.

use crate::sphere::upper_hemisphere;
use bevy::{math::Affine3A, prelude::*};
use bevy_mirrorball::{
    camera::{FramePixels, Intrinsics},
    lighting::solver::{BracketedExposure, DeskFrame, MirrorBall, Paper, PhantomSolid},
    probe::BallSurface,
};
use std::{f32::consts::PI, sync::Arc};

/// A glowing ball.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamp {
    pub position: Vec3,
    pub radius: f32,
    /// Relative to the sky's; the picture is exposed for the paper.
    pub radiance: Vec3,
}

impl Lamp {
    /// So far away that it is the same from everywhere on the desk.
    pub(crate) fn far(direction: Vec3, angular_radius: f32, radiance: Vec3) -> Self {
        const FAR: f32 = 300.0;
        Self { position: FAR * direction.normalize(), radius: FAR * angular_radius.sin(), radiance }
    }

    fn is_hit(&self, origin: Vec3, dir: Vec3) -> bool {
        sphere_distance(self.position - origin, self.radius, dir).is_some()
    }

    /// Irradiance at a point, with the shadows of balls and paper.
    fn irradiance(&self, desk: &TracedDesk, point: Vec3, normal: Vec3) -> Vec3 {
        let to_lamp = self.position - point;
        let distance = to_lamp.length();
        let (dir, sin) = (to_lamp / distance, self.radius / distance);
        let (right, up) = dir.any_orthonormal_pair();
        let solid_angle = 2.0 * PI * (1.0 - (1.0 - sin * sin).sqrt());
        // Wide ones have noise in the place of bands: the pattern of rays turns from point to point.
        let samples = if sin > 0.2 { 48 } else { 12 };
        let turn = if sin > 0.2 { 1e4 * (173.0 * point.x + 311.0 * point.z).sin() } else { 0.0 };
        let lit: f32 = (0..samples)
            .map(|i| {
                let (s, c) = (i as f32 * 2.399_963 + turn).sin_cos();
                let r = sin * ((i as f32 + 0.5) / samples as f32).sqrt();
                let dir = (dir + right * (r * c) + up * (r * s)).normalize();
                if desk.is_hidden(point, dir) { 0.0 } else { dir.dot(normal).max(0.0) }
            })
            .sum();
        self.radiance * (solid_angle * lit / samples as f32)
    }
}

/// A sheet folded into a roof.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tent {
    /// Below the middle of its ridge, on the desk.
    pub foot: Vec3,
    /// Along the ridge, horizontal.
    pub ridge: Vec3,
    /// Length of the ridge, half of the width, height.
    pub size: Vec3,
    pub reflectance: f32,
}

impl Tent {
    fn triangles(&self) -> Vec<[Vec3; 3]> {
        let along = 0.5 * self.size.x * self.ridge.normalize();
        let (across, up) = (self.size.y * self.ridge.normalize().cross(Vec3::Y), self.size.z * Vec3::Y);
        let face = |side: f32| {
            let (a, b) = (self.foot + side * across - along, self.foot + side * across + along);
            let (c, d) = (self.foot + up + along, self.foot + up - along);
            [[a, b, c], [a, c, d]]
        };
        [face(1.0), face(-1.0)].concat()
    }

    /// The phantom that stands for it.
    pub(crate) fn solid(&self, is_known: bool) -> PhantomSolid {
        let mut solid = PhantomSolid::from_triangles(self.triangles()).expect("a roof");
        solid.reflectance = is_known.then_some(Vec3::splat(self.reflectance));
        solid
    }
}

/// What is pictured: an endless gray desk at y = 0 with the marker's sheet at the origin, and what stands on it.
#[derive(Clone)]
pub(crate) struct TracedDesk<'a> {
    /// Radiance of the sky by direction, without the lamps.
    pub sky: &'a dyn Fn(Vec3) -> Vec3,
    pub lamps: Vec<Lamp>,
    pub balls: Vec<MirrorBall>,
    pub tents: Vec<Tent>,
    pub eye: Vec3,
    pub target: Vec3,
    /// Radiance of the paper in the picture, its brightest channel, camera units.
    pub paper: f32,
    /// Fraction of light that the marker's black square reflects.
    pub ink: f32,
    pub size: UVec2,
}

/// So far from the marker that its shadow and its mirror light do not reach the paper.
pub(crate) const BALL: MirrorBall =
    MirrorBall { center: Vec3::new(0.30, 0.05, 0.05), radius: 0.05, reflectance: 0.9, surface: BallSurface::Mirror };
const PAPER_REFLECTANCE: f32 = 0.8;
const DESK_REFLECTANCE: f32 = 0.3;

impl<'a> TracedDesk<'a> {
    pub(crate) fn new(sky: &'a dyn Fn(Vec3) -> Vec3) -> Self {
        Self {
            sky,
            lamps: Vec::new(),
            balls: vec![BALL],
            tents: Vec::new(),
            eye: Vec3::new(-0.05, 0.36, -0.42),
            target: Vec3::new(0.15, 0.02, 0.02),
            paper: 0.7,
            ink: 0.04,
            size: UVec2::new(480, 270),
        }
    }

    fn is_hidden(&self, point: Vec3, dir: Vec3) -> bool {
        self.balls.iter().any(|ball| sphere_distance(ball.center - point, ball.radius, dir).is_some())
            || self.tents.iter().any(|tent| triangle_hit(&tent.triangles(), point, dir).is_some())
    }

    /// Scene radiance × this = camera units.
    pub(crate) fn exposure(&self) -> f32 {
        let white = self.sky_irradiance(Vec3::Y, Vec3::ZERO) + self.lamp_irradiance(Vec3::ZERO, Vec3::Y);
        self.paper * PI / (PAPER_REFLECTANCE * white.max_element())
    }

    fn lamp_irradiance(&self, point: Vec3, normal: Vec3) -> Vec3 {
        self.lamps.iter().map(|lamp| lamp.irradiance(self, point + 1e-4 * normal, normal)).sum()
    }

    fn sky_irradiance(&self, normal: Vec3, desk: Vec3) -> Vec3 {
        let count = 100_000;
        let (right, up) = normal.any_orthonormal_pair();
        let dirs = upper_hemisphere(count).map(|d| (right * d.x + normal * d.y + up * d.z, d.y));
        let light = |dir: Vec3| if dir.y > 0.0 { (self.sky)(dir) } else { desk };
        dirs.map(|(dir, cosine)| light(dir) * cosine).sum::<Vec3>() * (2.0 * PI / count as f32)
    }

    /// Radiance · steradian of the sky without lamps within an angle of a direction, mean of the channels.
    pub(crate) fn sky_around(&self, towards: Vec3, angle: f32) -> f32 {
        let count = 100_000;
        let near = upper_hemisphere(count).filter(|dir| dir.angle_between(towards) < angle);
        near.map(|dir| (self.sky)(dir).element_sum() / 3.0).sum::<f32>() * (2.0 * PI / count as f32)
    }

    /// Irradiance ÷ π at the marker for a normal, from the upper half of the sky, unshadowed, in camera units.
    pub(crate) fn irradiance_from_above(&self, normal: Vec3) -> Vec3 {
        let lamps = self.lamps.iter().map(|lamp| lamp.irradiance(self, Vec3::new(0.0, 1e-4, 0.0), normal));
        (self.sky_irradiance(normal, Vec3::ZERO) + lamps.sum::<Vec3>()) * (self.exposure() / PI)
    }

    fn intrinsics(&self) -> Intrinsics {
        let focal = Vec2::splat(1.025 * self.size.x as f32);
        Intrinsics::new(focal, self.size.as_vec2() / 2.0, self.size)
    }

    fn pose(&self) -> Transform {
        Transform::from_translation(self.eye).looking_at(self.target, Vec3::Y)
    }

    /// The picture; known is what `picture` says.
    pub(crate) fn picture(&self) -> DeskFrame {
        DeskFrame {
            frame: Arc::new(self.frame(1.0)),
            intrinsics: self.intrinsics(),
            camera_from_world: self.pose().compute_affine().inverse(),
            ball: self.balls[0],
            other_balls: self.balls[1..].to_vec(),
            bracketed_exposures: Vec::new(),
            papers: vec![Paper { world_from_marker: Affine3A::IDENTITY, size: 0.1, reflectance: PAPER_REFLECTANCE }],
            phantoms: Arc::default(),
            max_gain: 1000.0,
        }
    }

    /// The same at a shorter exposure.
    pub(crate) fn shorter(&self, exposure: f32) -> BracketedExposure {
        BracketedExposure::new(self.frame(exposure), exposure)
    }

    /// What the sensor gathers in an exposure, 1 being the picture's.
    fn frame(&self, exposure: f32) -> FramePixels {
        const SUBPIXELS: u32 = 4;
        let (size, intrinsics, pose) = (self.size, self.intrinsics(), self.pose());
        let exposure = exposure * self.exposure();
        let open = self.sky_irradiance(Vec3::Y, Vec3::ZERO);
        let far_desk = (open + self.lamp_irradiance(Vec3::new(0.0, 0.0, 50.0), Vec3::Y)) * (DESK_REFLECTANCE / PI);
        let faces: Vec<(Tent, Vec<[Vec3; 3]>)> = self.tents.iter().map(|tent| (*tent, tent.triangles())).collect();
        let mut by_normal: Vec<(Vec3, Vec3)> = Vec::new();
        for (_, triangles) in &faces {
            for [a, b, c] in triangles {
                let normal = (*b - *a).cross(*c - *a).normalize();
                let normal = if normal.y < 0.0 { -normal } else { normal };
                by_normal.push((normal, self.sky_irradiance(normal, far_desk)));
            }
        }
        let radiance = |ray: Vec3| {
            let ball = self.balls.iter().filter_map(|ball| {
                sphere_distance(ball.center - self.eye, ball.radius, ray).map(|distance| (distance, ball))
            });
            if let Some((distance, ball)) = ball.min_by(|a, b| a.0.total_cmp(&b.0)) {
                let point = self.eye + distance * ray;
                let normal = (point - ball.center).normalize();
                return ball.surface.reflectance_at(ball.reflectance, -ray.dot(normal))
                    * self.seen(point, ray.reflect(normal), far_desk);
            }
            let tent = faces.iter().filter_map(|(tent, triangles)| {
                triangle_hit(triangles, self.eye, ray).map(|(distance, normal)| (distance, normal, tent))
            });
            if let Some((distance, normal, tent)) = tent.min_by(|a, b| a.0.total_cmp(&b.0)) {
                let sky = by_normal.iter().find(|(known, _)| known.distance(normal) < 1e-3).map_or(open, |sky| sky.1);
                let lit = sky + self.lamp_irradiance(self.eye + distance * ray, normal);
                return lit * (tent.reflectance / PI);
            }
            if ray.y >= 0.0 {
                return self.seen(self.eye, ray, far_desk);
            }
            let point = self.eye - ray * (self.eye.y / ray.y);
            let reflectance = match point.x.abs().max(point.z.abs()) {
                ..0.05 => self.ink,
                0.05..0.0625 => PAPER_REFLECTANCE,
                _ => DESK_REFLECTANCE,
            };
            (open + self.lamp_irradiance(point, Vec3::Y)) * (reflectance / PI)
        };
        let rgba = (0..size.x * size.y).flat_map(|i| {
            let corner = Vec2::new((i % size.x) as f32, (i / size.x) as f32);
            let ray = |inside: Vec2| pose.rotation * intrinsics.ray(corner + inside);
            let is_at_ball = self.balls.iter().any(|ball| {
                sphere_distance(ball.center - self.eye, 1.05 * ball.radius, ray(Vec2::splat(0.5))).is_some()
            });
            let edge = if is_at_ball { SUBPIXELS } else { 1 };
            let rays = (0..edge * edge)
                .map(|k| radiance(ray((Vec2::new((k % edge) as f32, (k / edge) as f32) + 0.5) / edge as f32)));
            // The sensor clips what has been gathered, not rays: a sun smaller than a pixel clips it.
            let mean = (exposure * rays.sum::<Vec3>() / (edge * edge) as f32).min(Vec3::ONE);
            let srgb = Color::linear_rgb(mean.x, mean.y, mean.z).to_srgba().to_u8_array();
            [srgb[0], srgb[1], srgb[2], 255]
        });
        FramePixels::new(size, rgba.collect()).expect("four bytes a pixel")
    }

    /// Light that arrives from a direction, balls aside.
    fn seen(&self, from: Vec3, dir: Vec3, desk: Vec3) -> Vec3 {
        match self.lamps.iter().find(|lamp| lamp.is_hit(from, dir)) {
            Some(lamp) if dir.y > 0.0 => lamp.radiance,
            _ if dir.y > 0.0 => (self.sky)(dir),
            _ => desk,
        }
    }
}

fn sphere_distance(center: Vec3, radius: f32, dir: Vec3) -> Option<f32> {
    let along = center.dot(dir);
    let inside = along * along - center.length_squared() + radius * radius;
    (inside > 0.0 && along > 0.0).then(|| along - inside.sqrt())
}

/// Nearest triangle: distance and normal towards the ray's origin.
fn triangle_hit(triangles: &[[Vec3; 3]], origin: Vec3, dir: Vec3) -> Option<(f32, Vec3)> {
    let hits = triangles.iter().filter_map(|[a, b, c]| {
        let normal = (*b - *a).cross(*c - *a).normalize();
        let distance = (*a - origin).dot(normal) / dir.dot(normal);
        let point = origin + distance * dir;
        let is_left = |from: Vec3, to: Vec3| (to - from).cross(point - from).dot(normal) >= 0.0;
        let is_inside = distance > 1e-4 && is_left(*a, *b) && is_left(*b, *c) && is_left(*c, *a);
        is_inside.then(|| (distance, if normal.dot(dir) > 0.0 { -normal } else { normal }))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}
