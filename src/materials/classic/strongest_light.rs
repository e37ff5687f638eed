//! The strongest real light, in a buffer that all classic surfaces share.
//!
//! Real lights change with every frame of a camera. The buffer is written in place, so that no material has to be
//! prepared again.

use crate::{MirrorballSystems, lighting::RealLight};
use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        extract_resource::{ExtractResource, ExtractResourcePlugin},
        render_asset::RenderAssets,
        render_resource::{ShaderType, encase::StorageBuffer},
        renderer::RenderQueue,
        storage::{GpuShaderBuffer, ShaderBuffer},
    },
};
use std::f32::consts::PI;

/// Mirror of `StrongestLight` in `classic.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
struct LightUniform {
    direction: Vec3,
    paper_radiance: Vec3,
}

/// Minimum ratio of strengths at which another light takes over: noise does not move the highlight to and fro.
const MIN_REPLACING_RATIO: f32 = 1.25;

/// The strongest real light and the buffer that has it on the GPU.
#[derive(Resource, ExtractResource, Clone)]
pub(in crate::materials) struct StrongestLight {
    pub(in crate::materials) buffer: Handle<ShaderBuffer>,
    id: Option<u32>,
    uniform: LightUniform,
}

impl FromWorld for StrongestLight {
    fn from_world(world: &mut World) -> Self {
        let zeros = vec![0; LightUniform::min_size().get() as usize];
        let buffer = ShaderBuffer::new(&zeros, RenderAssetUsages::RENDER_WORLD);
        let buffer = world.resource_mut::<Assets<ShaderBuffer>>().add(buffer);
        Self { buffer, id: None, uniform: default() }
    }
}

pub(super) fn build(app: &mut App) {
    app.add_plugins(ExtractResourcePlugin::<StrongestLight>::default()).add_systems(
        PostUpdate,
        choose_strongest_light.run_if(resource_exists::<StrongestLight>).after(MirrorballSystems::Light),
    );
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app.add_systems(Render, write_strongest_light.in_set(RenderSystems::PrepareResources));
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

fn choose_strongest_light(lights: Query<&RealLight>, mut light: ResMut<StrongestLight>) {
    let chosen = strongest(lights.iter(), light.id);
    let id = chosen.map(|light| light.id);
    let uniform = chosen.map_or(LightUniform::default(), |light| LightUniform {
        direction: light.direction,
        paper_radiance: light.color.to_vec3() * (light.irradiance / PI),
    });
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
    fn the_strongest_light_is_kept_until_another_is_clearly_stronger() {
        let id = |lights: &[RealLight], last| strongest(lights.iter(), last).map(|light| light.id);
        assert_eq!(id(&[], Some(1)), None);
        assert_eq!(id(&[light(1, 1.0), light(2, 1.1)], None), Some(2));
        assert_eq!(id(&[light(1, 1.0), light(2, 1.1)], Some(1)), Some(1));
        assert_eq!(id(&[light(1, 1.0), light(2, 1.3)], Some(1)), Some(2));
        assert_eq!(id(&[light(2, f32::NAN), light(3, 0.1)], Some(1)), Some(3));
    }
}
