//! What is to be drawn for each receiver, in the main world.

use super::{
    super::{
        bounding_sphere::BoundingSphere,
        casters::{Caster, Casters},
    },
    light_points::{LightShare, LocalLight, lights_above},
    planar_shadow::{PlanarCasters, PlanarLights, PlanarShadow, PlanarShadowState, PlanarStandIn},
    projection::planar_projection,
    window::Window,
};
use crate::{camera::ArCamera, lighting::RealLight, prefilter::EnvironmentState};
use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::RenderLayers,
    ecs::{query::QueryData, system::SystemParam},
    image::ImageSampler,
    light::EnvironmentMapLight,
    prelude::*,
    render::{
        extract_resource::ExtractResource,
        render_resource::{Extent3d, ShaderType, TextureDimension, TextureFormat, TextureUsages},
    },
};

/// Fraction of the distance between the shadows of two neighboring points of a light by which they are blurred.
const BLUR: f32 = 0.6;

/// Mirror of `PlanarView` in `planar_mask_pass.wgsl`: the shadows of one point of a light.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PlanarView {
    clip_from_world: Mat4,
    /// Plane of the receiver, above which things cast.
    plane: Vec4,
    /// Fraction of the light that comes from this point.
    weight: f32,
}

/// A light's share of a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlannedLight {
    /// Number of its views, which follow those of the light before.
    pub(super) views: u32,
    pub(super) share: LightShare,
    /// Standard deviation of the blur along the columns and rows of the texture, in texels.
    pub(super) blur: Vec2,
}

/// The filtered environment that tells how much light there is in all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlannedEnvironment {
    pub(super) diffuse_map: AssetId<Image>,
    /// Normal of the receiver in the frame of the map.
    pub(super) normal: Vec3,
    /// How often the map was filtered, so that a new one changes the plan.
    refreshes: u64,
}

/// The shadows of one receiver.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::shadows) struct PlanarPlan {
    pub(super) receiver: Entity,
    pub(super) texture: AssetId<Image>,
    pub(super) edge: u32,
    pub(super) casters: Vec<Caster>,
    pub(super) views: Vec<PlanarView>,
    pub(super) lights: Vec<PlannedLight>,
    pub(super) environment: Option<PlannedEnvironment>,
    pub(super) strength: f32,
    window: Option<Window>,
}

/// All receivers with the numbers of their drawings, which change with what they show.
#[derive(Resource, ExtractResource, Clone, Debug, Default, PartialEq)]
pub(in crate::shadows) struct PlanarPlans(pub(super) Vec<(u32, PlanarPlan)>);

/// The texture with the fraction of light that is left, and where it lies on the receiver.
#[derive(Component, Clone, Debug, PartialEq)]
pub(crate) struct PlanarTexture {
    pub(crate) image: Handle<Image>,
    edge: u32,
    /// Pose of the receiver.
    pub(crate) world_from_local: Isometry3d,
    /// Half of the receiver's extents along x and z in meters.
    pub(crate) half_size: Vec2,
    /// Center and half of the extents of the part that the texture covers, in meters; of no extent without shadows.
    pub(crate) window: [Vec2; 2],
    pub(crate) offset: f32,
}

#[derive(QueryData)]
#[query_data(mutable)]
pub(in crate::shadows) struct ReceiverData {
    entity: Entity,
    shadow: &'static PlanarShadow,
    transform: &'static GlobalTransform,
    visibility: &'static InheritedVisibility,
    layers: Option<&'static RenderLayers>,
    texture: Option<&'static mut PlanarTexture>,
    state: &'static mut PlanarShadowState,
}

/// What lights the receivers.
#[derive(SystemParam)]
pub(in crate::shadows) struct PlanarScene<'w, 's> {
    lights: Query<'w, 's, &'static RealLight>,
    environments: Query<'w, 's, (&'static EnvironmentMapLight, Option<&'static EnvironmentState>), With<ArCamera>>,
    maps: Query<'w, 's, (&'static EnvironmentMapLight, Option<&'static EnvironmentState>), With<Camera3d>>,
    stand_ins: Query<'w, 's, &'static PlanarStandIn>,
}

impl PlanarScene<'_, '_> {
    fn environment(&self, normal: Vec3) -> Option<PlannedEnvironment> {
        let (map, state) = self.environments.iter().chain(&self.maps).next()?;
        let refreshes = match state {
            Some(EnvironmentState::Live { refreshes, .. }) => u64::from(*refreshes),
            _ => 0,
        };
        let normal = map.rotation.inverse() * normal;
        Some(PlannedEnvironment { diffuse_map: map.diffuse_map.id(), normal, refreshes })
    }

    /// Replaces the mesh of a caster by its stand-in.
    fn simplify(&self, caster: &mut Caster) {
        if let Ok(PlanarStandIn(mesh)) = self.stand_ins.get(caster.entity) {
            caster.mesh = mesh.id();
            caster.joints.clear();
            caster.morph_weights.clear();
            caster.alpha_mask = None;
        }
    }
}

/// Follows receivers, lights and casters.
pub(in crate::shadows) fn plan_shadows(
    mut commands: Commands,
    mut plans: ResMut<PlanarPlans>,
    mut images: ResMut<Assets<Image>>,
    mut receivers: Query<ReceiverData>,
    mut casters: Casters,
    scene: PlanarScene,
) {
    if receivers.is_empty() {
        plans.set_if_neq(default());
        return;
    }
    let mut now = Vec::new();
    for mut receiver in &mut receivers {
        let is_seen = receiver.visibility.get() && receiver.shadow.half_size.min_element() > 0.0;
        let Some(place) = ReceiverPlace::new(receiver.transform, receiver.shadow).filter(|_| is_seen) else {
            continue;
        };
        let edge = receiver.shadow.resolution.clamp(32, 2048);
        let texture = match &receiver.texture {
            Some(texture) if texture.edge == edge => texture.image.clone(),
            _ => images.add(ratio_image(edge)),
        };
        let mut casters = casters.gather(receiver.layers);
        casters.retain(|caster| !caster.is_phantom || receiver.shadow.casters == PlanarCasters::All);
        casters.iter_mut().for_each(|caster| scene.simplify(caster));
        let plan = place.plan(receiver.entity, receiver.shadow, (texture.id(), edge), casters, &scene);
        let (lights, count) = (plan.lights.len() as u32, plan.casters.len() as u32);
        let before = plans.0.iter().find(|(_, before)| before.receiver == plan.receiver);
        let drawing = match before {
            Some((drawing, before)) if *before == plan => *drawing,
            Some((drawing, _)) => drawing.wrapping_add(1),
            None => receiver.state.drawings.wrapping_add(1),
        };
        receiver.state.set_if_neq(PlanarShadowState { lights, casters: count, drawings: drawing });
        let window = plan.window.map_or([Vec2::ZERO; 2], |window| [window.center, window.half_size]);
        let ReceiverPlace { world_from_local, half_size } = place;
        let offset = receiver.shadow.offset;
        let texture = PlanarTexture { image: texture, edge, world_from_local, half_size, window, offset };
        match receiver.texture {
            Some(mut last) => {
                last.set_if_neq(texture);
            }
            None => {
                commands.entity(receiver.entity).insert(texture);
            }
        }
        now.push((drawing, plan));
    }
    plans.set_if_neq(PlanarPlans(now));
}

/// A receiver without its scale.
struct ReceiverPlace {
    world_from_local: Isometry3d,
    half_size: Vec2,
}

impl ReceiverPlace {
    fn new(transform: &GlobalTransform, shadow: &PlanarShadow) -> Option<Self> {
        let (scale, rotation, translation) = transform.to_scale_rotation_translation();
        let half_size = shadow.half_size * scale.abs().xz();
        let is_finite = rotation.is_finite() && translation.is_finite() && half_size.is_finite();
        let world_from_local = Isometry3d::new(translation, rotation);
        (is_finite && half_size.min_element() > 0.0).then_some(Self { world_from_local, half_size })
    }

    fn plan(
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
        let environment = scene.environment(normal).filter(|_| matches!(shadow.lights, PlanarLights::Real(_)));
        let lights = lights_above(&shadow.lights, scene.lights.iter(), &local_from_world, environment.is_some());
        let points: Vec<Vec<Vec4>> = lights.iter().map(|light| light.points(shadow.samples)).collect();
        let projections: Vec<Mat4> = points.iter().flatten().map(|point| planar_projection(Vec4::Y, *point)).collect();
        let spheres = casters.iter().map(|caster| BoundingSphere {
            center: local_from_world.transform_point(caster.sphere.center).into(),
            ..caster.sphere
        });
        let height = spheres.clone().map(|sphere| sphere.center.y.max(0.0)).sum::<f32>() / casters.len().max(1) as f32;
        let blurs: Vec<f32> = lights.iter().zip(&points).map(|(light, p)| blur(light, p.len(), height)).collect();
        let margin = 3.0 * blurs.iter().copied().fold(0.0, f32::max) + self.half_size.max_element() / edge as f32;
        let window = Window::around(spheres.filter(reaches_above), &projections, margin, self.half_size);
        let mut views = Vec::new();
        let mut planned = Vec::new();
        if let Some(window) = window {
            let lift = if shadow.offset.is_finite() { shadow.offset.max(0.0) } else { 0.0 };
            let plane = normal.extend(-normal.dot(self.world_from_local.translation.into()) - lift);
            let mut projections = projections.into_iter();
            for ((light, points), blur) in lights.iter().zip(&points).zip(blurs) {
                let weight = 1.0 / points.len() as f32;
                views.extend(projections.by_ref().take(points.len()).map(|projection| {
                    let onto_texture = window.clip_from_local() * projection;
                    let clip_from_world = onto_texture * local_from_world_matrix;
                    PlanarView { clip_from_world, plane, weight }
                }));
                let texels = 0.5 * edge as f32 / window.half_size;
                planned.push(PlannedLight { views: points.len() as u32, share: light.share, blur: blur * texels });
            }
        }
        let strength = if shadow.strength.is_finite() { shadow.strength.clamp(0.0, 1.0) } else { 1.0 };
        PlanarPlan { receiver, texture, edge, casters, views, lights: planned, environment, strength, window }
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

/// Returns a texture that takes no light away.
fn ratio_image(edge: u32) -> Image {
    let size = Extent3d { width: edge, height: edge, ..default() };
    // 1.0 in half floats
    let mut image = Image::new_fill(
        size,
        TextureDimension::D2,
        &[0x00, 0x3c, 0x00, 0x3c, 0x00, 0x3c, 0x00, 0x3c],
        TextureFormat::Rgba16Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.texture_descriptor.usage |= TextureUsages::RENDER_ATTACHMENT;
    image.sampler = ImageSampler::linear();
    image
}
