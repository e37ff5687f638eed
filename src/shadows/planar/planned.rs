//! What is to be drawn for each receiver, in the main world.

use super::{
    super::casters::{Caster, Casters},
    light_points::LightShare,
    planar_shadow::{PlanarCasters, PlanarShadow, PlanarShadowState, PlanarStandIn},
    receiver_plan::ReceiverPlace,
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

/// Mirror of `PlanarView` in `planar_view.wgsl`: the shadows of one point of a light.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PlanarView {
    pub(super) clip_from_world: Mat4,
    /// Plane of the receiver, above which things cast.
    pub(super) plane: Vec4,
    /// Fraction of the light that comes from this point, per color.
    pub(super) weight: Vec3,
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

/// The filtered environment that tells how much light there is in all, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlannedEnvironment {
    pub(super) diffuse_map: AssetId<Image>,
    pub(super) specular_map: AssetId<Image>,
    /// Turns from the receiver's frame to that of the maps.
    pub(super) map_from_receiver: Quat,
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
    /// Number of views of the light from all around, which are the last ones.
    pub(super) ambient: u32,
    /// Directions of the environment's light that belongs to lights of their own, in the receiver's frame, and cosines
    /// of the radii.
    pub(super) cones: Vec<Vec4>,
    pub(super) strength: f32,
    pub(super) window: Option<Window>,
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
    pub(super) lights: Query<'w, 's, &'static RealLight>,
    environments: Query<'w, 's, (&'static EnvironmentMapLight, Option<&'static EnvironmentState>), With<ArCamera>>,
    maps: Query<'w, 's, (&'static EnvironmentMapLight, Option<&'static EnvironmentState>), With<Camera3d>>,
    stand_ins: Query<'w, 's, &'static PlanarStandIn>,
}

impl PlanarScene<'_, '_> {
    pub(super) fn environment(&self, world_from_receiver: Quat) -> Option<PlannedEnvironment> {
        let (map, state) = self.environments.iter().chain(&self.maps).next()?;
        let refreshes = match state {
            Some(EnvironmentState::Live { refreshes, .. }) => u64::from(*refreshes),
            _ => 0,
        };
        Some(PlannedEnvironment {
            diffuse_map: map.diffuse_map.id(),
            specular_map: map.specular_map.id(),
            map_from_receiver: map.rotation.inverse() * world_from_receiver,
            refreshes,
        })
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
        let edge = {
            let [least, most] = PlanarShadow::RESOLUTIONS;
            receiver.shadow.resolution.clamp(least, most)
        };
        let texture = match &receiver.texture {
            Some(texture) if texture.edge == edge => texture.image.clone(),
            _ => images.add(ratio_image(edge)),
        };
        let mut casters = casters.gather(receiver.layers);
        casters.retain(|caster| !caster.is_phantom || receiver.shadow.casters == PlanarCasters::All);
        casters.iter_mut().for_each(|caster| scene.simplify(caster));
        let plan = place.plan(receiver.entity, receiver.shadow, (texture.id(), edge), casters, &scene);
        let lights = plan.lights.iter().filter(|light| !light.share.is_rest()).count() as u32;
        let count = plan.casters.len() as u32;
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
