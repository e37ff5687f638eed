//! The plan of one receiver: what is drawn for which light.

use super::{
    super::{bounding_sphere::BoundingSphere, casters::Caster},
    ambient,
    light_points::{LightShare, LocalLight, lights_above},
    planar_shadow::{PlanarLights, PlanarShadow},
    planned::{PlanarPlan, PlanarScene, PlanarView, PlannedLight},
    projection::planar_projection,
    window::Window,
};
use crate::median::median_by;
use bevy::prelude::*;

/// Fraction of the distance between the shadows of two neighboring points of a light by which they are blurred.
const BLUR: f32 = 0.6;
/// Sine of the elevation below which directions of the rest of the light do not count for the reach of shadows. They
/// give a sixteenth of an even sky's light.
const MIN_AMBIENT_SINE: f32 = 0.25;

/// A receiver without its scale.
pub(super) struct ReceiverPlace {
    pub(super) world_from_local: Isometry3d,
    pub(super) half_size: Vec2,
}

impl ReceiverPlace {
    pub(super) fn new(transform: &GlobalTransform, shadow: &PlanarShadow) -> Option<Self> {
        let (scale, rotation, translation) = transform.to_scale_rotation_translation();
        let half_size = shadow.half_size * scale.abs().xz();
        let is_finite = rotation.is_finite() && translation.is_finite() && half_size.is_finite();
        let world_from_local = Isometry3d::new(translation, rotation);
        (is_finite && half_size.min_element() > 0.0).then_some(Self { world_from_local, half_size })
    }

    pub(super) fn plan(
        &self,
        receiver: Entity,
        shadow: &PlanarShadow,
        (texture, edge): (AssetId<Image>, u32),
        casters: Vec<Caster>,
        scene: &PlanarScene,
    ) -> PlanarPlan {
        let normal = self.world_from_local.rotation * Vec3::Y;
        let local_from_world = self.world_from_local.inverse();
        let local_from_world_matrix =
            Mat4::from_rotation_translation(local_from_world.rotation, local_from_world.translation.into());
        let environment = scene
            .environment(self.world_from_local.rotation)
            .filter(|_| matches!(shadow.lights, PlanarLights::Real(_)));
        let lights = lights_above(&shadow.lights, scene.lights.iter(), &local_from_world, environment.is_some());
        let spheres = casters.iter().map(|caster| BoundingSphere {
            center: local_from_world.transform_point(caster.sphere.center).into(),
            ..caster.sphere
        });
        // Of most things: the blur is the same everywhere, and small things show it more than the wall beside them.
        let mut heights: Vec<f32> = spheres.clone().map(|sphere| sphere.center.y.max(0.0)).collect();
        let height = median_by(&mut heights, f32::total_cmp).unwrap_or_default();
        let mut sources: Vec<Source> =
            lights.iter().map(|light| Source::light(light, shadow.samples, height)).collect();
        let rest = LightShare::rest(&lights, environment.is_some());
        let ambient = if rest.is_nothing() { 0 } else { shadow.ambient.min(PlanarShadow::MAX_AMBIENT) };
        if ambient > 0 {
            sources.push(Source::ambient(rest, ambient, height));
        }
        let projections = |source: &Source| -> Vec<Mat4> {
            source.points.iter().map(|point| planar_projection(Vec4::Y, *point)).collect()
        };
        let reaching = sources.iter().flat_map(|source| source.points.iter().filter(|point| source.reaches(**point)));
        let reaching: Vec<Mat4> = reaching.map(|point| planar_projection(Vec4::Y, *point)).collect();
        let widest = sources.iter().map(|source| source.blur).fold(0.0, f32::max);
        let margin = 3.0 * widest + self.half_size.max_element() / edge as f32;
        let window = Window::around(spheres.filter(reaches_above), &reaching, margin, self.half_size);
        let mut views = Vec::new();
        let mut planned = Vec::new();
        if let Some(window) = window {
            let lift = if shadow.offset.is_finite() { shadow.offset.max(0.0) } else { 0.0 };
            let plane = normal.extend(-normal.dot(self.world_from_local.translation.into()) - lift);
            let texels = 0.5 * edge as f32 / window.half_size;
            for source in &sources {
                let weight = Vec3::splat(1.0 / source.points.len() as f32);
                views.extend(projections(source).into_iter().map(|projection| {
                    let onto_texture = window.clip_from_local() * projection;
                    let clip_from_world = onto_texture * local_from_world_matrix;
                    PlanarView { clip_from_world, plane, weight }
                }));
                let light_views = source.points.len() as u32;
                planned.push(PlannedLight { views: light_views, share: source.share, blur: source.blur * texels });
            }
        }
        PlanarPlan {
            receiver,
            texture,
            edge,
            casters,
            views,
            lights: planned,
            environment,
            ambient: if window.is_some() { ambient } else { 0 },
            cones: lights.iter().map(|light| light.cone).collect(),
            strength: if shadow.strength.is_finite() { shadow.strength.clamp(0.0, 1.0) } else { 1.0 },
            window,
        }
    }
}

/// Points from which light comes.
struct Source {
    /// Positions and 1, or directions and 0.
    points: Vec<Vec4>,
    share: LightShare,
    /// Standard deviation in meters.
    blur: f32,
    is_ambient: bool,
}

impl Source {
    fn light(light: &LocalLight, samples: u32, height: f32) -> Self {
        let points = light.points(samples);
        let blur = blur(light, points.len(), height);
        Self { points, share: light.share, blur, is_ambient: false }
    }

    /// Light from all around.
    fn ambient(share: LightShare, count: u32, height: f32) -> Self {
        Self {
            points: ambient::directions(count).map(|direction| direction.extend(0.0)).collect(),
            share,
            blur: ambient::blur(count, height),
            is_ambient: true,
        }
    }

    /// Whether the shadows of a point count for the part of the receiver that has shadows: those of low directions
    /// reach far and are faint.
    fn reaches(&self, point: Vec4) -> bool {
        !self.is_ambient || point.y > MIN_AMBIENT_SINE
    }
}

/// Whether anything of a sphere is above the receiver.
fn reaches_above(sphere: &BoundingSphere) -> bool {
    sphere.center.y + sphere.radius > 0.0
}

/// Returns the standard deviation of the blur that joins the shadows of a light's points, in meters, for things at a
/// height.
fn blur(light: &LocalLight, points: usize, height: f32) -> f32 {
    if points < 2 {
        return 0.0;
    }
    let is_near = light.center.w > 0.0;
    let distance = if is_near { light.center.truncate().length() } else { 1.0 };
    let sine = light.center.y / distance;
    // Near lights magnify.
    let height = if is_near { height * light.center.y / (light.center.y - height).max(0.5 * height) } else { height };
    2.0 * BLUR * height * light.tangent_radius / (sine * (points as f32).sqrt())
}
