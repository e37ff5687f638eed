//! The strongest real light, in a buffer that all classic and toon surfaces share, with the sphere map behind it.
//!
//! Real lights change with every frame of a camera. The buffer is written in place, so that no material has to be
//! prepared again.

use super::classic::{SphereMap, TEXELS};
use crate::{MirrorballSystems, lighting::RealLight};
use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        extract_resource::{ExtractResource, ExtractResourcePlugin},
        render_asset::RenderAssets,
        render_resource::{AsBindGroup, ShaderType, encase::StorageBuffer},
        renderer::RenderQueue,
        storage::{GpuShaderBuffer, ShaderBuffer},
    },
    shader::load_shader_library,
};
use std::f32::consts::PI;

/// Mirror of the first fields of `StrongestLight` in `strongest_light.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
struct LightUniform {
    direction: Vec3,
    paper_radiance: Vec3,
    key_direction: Vec3,
    key_weight: f32,
}

/// Binding of the buffer in a material, as `strongest_light.wgsl` declares it.
#[derive(AsBindGroup, Clone, Debug)]
pub(super) struct LightBindings {
    #[storage(105, read_only, visibility(fragment))]
    strongest: Handle<ShaderBuffer>,
}

impl From<&StrongestLight> for LightBindings {
    fn from(light: &StrongestLight) -> Self {
        Self { strongest: light.buffer.clone() }
    }
}

/// Largest turn of the key light in a frame, in radians: 8°, which moves N·L by less than a fifth, the width of the
/// narrowest band.
const MAX_TURN: f32 = 8.0 * PI / 180.0;
/// Largest change of the key light's weight in a frame.
const MAX_WEIGHT_CHANGE: f32 = 0.125;
/// Minimum ratio of strengths at which another light takes over: noise does not move the highlight to and fro.
const MIN_REPLACING_RATIO: f32 = 1.25;

/// The strongest real light and the buffer that has it on the GPU.
#[derive(Resource, ExtractResource, Clone)]
pub(super) struct StrongestLight {
    buffer: Handle<ShaderBuffer>,
    id: Option<u32>,
    uniform: LightUniform,
}

impl FromWorld for StrongestLight {
    fn from_world(world: &mut World) -> Self {
        let zeros = vec![0; LightUniform::min_size().get() as usize + TEXELS * size_of::<Vec4>()];
        let buffer = ShaderBuffer::new(&zeros, RenderAssetUsages::RENDER_WORLD);
        let buffer = world.resource_mut::<Assets<ShaderBuffer>>().add(buffer);
        Self { buffer, id: None, uniform: default() }
    }
}

pub(super) fn build(app: &mut App) {
    load_shader_library!(app, "strongest_light.wgsl");
    app.add_plugins(ExtractResourcePlugin::<StrongestLight>::default()).add_systems(
        PostUpdate,
        choose_strongest_light.run_if(resource_exists::<StrongestLight>).after(MirrorballSystems::Light),
    );
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app
            .add_systems(Render, (write_strongest_light, write_sphere_map).in_set(RenderSystems::PrepareResources));
    }
}

/// Adds what needs the renderer.
pub(super) fn finish(app: &mut App) {
    if app.world().contains_resource::<Assets<ShaderBuffer>>() {
        app.init_resource::<StrongestLight>();
    }
}

/// Returns the strongest light; the last one unless another is clearly stronger.
fn strongest<'a>(lights: impl Iterator<Item = &'a RealLight>, last: Option<u32>) -> Option<&'a RealLight> {
    let strength =
        |light: &RealLight| light.irradiance * if Some(light.id) == last { MIN_REPLACING_RATIO } else { 1.0 };
    lights
        .filter(|light| light.direction.is_normalized() && light.irradiance.is_finite())
        .max_by(|a, b| strength(a).total_cmp(&strength(b)))
}

/// Returns direction and weight of the key light, a frame after `last`: it turns to another light, appears and vanishes
/// over some frames, so that no band of light is jumped over.
fn followed(last: &LightUniform, target: Option<Vec3>) -> (Vec3, f32) {
    match target {
        None => (last.key_direction, (last.key_weight - MAX_WEIGHT_CHANGE).max(0.0)),
        Some(target) if last.key_weight == 0.0 => (target, MAX_WEIGHT_CHANGE),
        Some(target) => {
            let turned = last.key_direction.rotate_towards(target, MAX_TURN).try_normalize().unwrap_or(target);
            (turned, (last.key_weight + MAX_WEIGHT_CHANGE).min(1.0))
        }
    }
}

fn choose_strongest_light(lights: Query<&RealLight>, mut light: ResMut<StrongestLight>) {
    let chosen = strongest(lights.iter(), light.id);
    let id = chosen.map(|light| light.id);
    let (key_direction, key_weight) = followed(&light.uniform, chosen.map(|light| light.direction));
    let (direction, paper_radiance) = chosen
        .map_or((Vec3::ZERO, Vec3::ZERO), |light| (light.direction, light.color.to_vec3() * (light.irradiance / PI)));
    let uniform = LightUniform { direction, paper_radiance, key_direction, key_weight };
    if (light.id, light.uniform) != (id, uniform) {
        light.id = id;
        light.uniform = uniform;
    }
}

fn write_strongest_light(
    light: Option<Res<StrongestLight>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    queue: Res<RenderQueue>,
    mut written: Local<LightUniform>,
) {
    let Some(light) = light.filter(|light| light.uniform != *written) else {
        return;
    };
    let Some(buffer) = buffers.get(&light.buffer) else {
        return;
    };
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    if let Err(error) = bytes.write(&light.uniform) {
        error_once!("cannot lay out the strongest light: {error}");
        return;
    }
    queue.write_buffer(&buffer.buffer, 0, bytes.as_ref());
    *written = light.uniform;
}

/// Writes the sphere map behind the light when it shows another frame.
fn write_sphere_map(
    light: Option<Res<StrongestLight>>,
    map: Option<Res<SphereMap>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    queue: Res<RenderQueue>,
    mut written: Local<Option<(Entity, u64)>>,
) {
    let Some((light, map)) = light.zip(map).filter(|(_, map)| map.frame.is_some() && map.frame != *written) else {
        return;
    };
    if let Some(buffer) = buffers.get(&light.buffer) {
        let bytes: Vec<u8> = map.texels.iter().flat_map(|texel| texel.to_array()).flat_map(f32::to_le_bytes).collect();
        queue.write_buffer(&buffer.buffer, LightUniform::min_size().get(), &bytes);
        *written = map.frame;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(id: u32, irradiance: f32) -> RealLight {
        RealLight {
            id,
            direction: Vec3::Y,
            position: None,
            color: LinearRgba::WHITE,
            irradiance,
            angular_radius: 0.1,
            fraction: 0.1,
        }
    }

    #[test]
    fn the_key_light_turns_by_some_degrees_a_frame_and_fades_where_there_is_none() {
        let mut uniform = LightUniform::default();
        let mut step = |target: Option<Vec3>| {
            let last = uniform;
            (uniform.key_direction, uniform.key_weight) = followed(&last, target);
            let turn = last.key_direction.angle_between(uniform.key_direction).to_degrees();
            (uniform, if last.key_weight > 0.0 { turn } else { 0.0 })
        };
        for target in [Vec3::X, Vec3::NEG_X, Vec3::new(-0.6, 0.8, 0.0), Vec3::Z] {
            let frames: Vec<_> = (0..40).map(|_| step(Some(target))).collect();
            assert!(frames.iter().all(|(_, turn)| *turn < 8.1), "{frames:?}");
            let (last, _) = frames[39];
            assert!(last.key_direction.distance(target) < 1e-3 && last.key_weight == 1.0, "{last:?}");
        }
        let nearby = Quat::from_rotation_y(5_f32.to_radians()) * Vec3::Z;
        assert!(step(Some(nearby)).0.key_direction.distance(nearby) < 1e-3, "it follows a light that moves");
        let faded = (0..8).map(|_| step(None).0).last().expect("eight frames");
        assert!(faded.key_weight == 0.0 && faded.key_direction.distance(nearby) < 1e-3);
        assert_eq!(step(Some(Vec3::Y)).0.key_direction, Vec3::Y, "one that appears is there at once");
    }

    #[test]
    fn the_strongest_light_is_kept_until_another_is_clearly_stronger() {
        let id = |lights: &[RealLight], last| strongest(lights.iter(), last).map(|light| light.id);
        assert_eq!(id(&[], Some(1)), None);
        assert_eq!(id(&[light(1, 1.0), light(2, 1.1)], None), Some(2));
        assert_eq!(id(&[light(1, 1.0), light(2, 1.1)], Some(1)), Some(1));
        assert_eq!(id(&[light(1, 1.0), light(2, 1.3)], Some(1)), Some(2));
        assert_eq!(id(&[light(2, f32::NAN), light(3, 0.1)], Some(1)), Some(3));
    }
}
