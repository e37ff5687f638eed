//! Raw environment cube → diffuse and glossy maps that light every `StandardMaterial`.
//!
//! **Enters:** an [`EnvironmentCube`] (or any cube a game puts into a [`LiveEnvironment`]). **Leaves:** a normal
//! [`EnvironmentMapLight`] on the camera, at the intensity that makes 1.0 in the cube 1.0 in the frame buffer.
//!
//! The diffuse map is the cosine-weighted sum of all light, the glossy one GGX by perceptual roughness with filtered
//! importance sampling (Křivánek & Colbert 2008), both free of noise. They are made anew every frame.
//!
//! # Files
//! Radiance and OpenEXR files become light, and measured light becomes a file:
//!
//! ```no_run
//! # use bevy::prelude::*;
//! # use bevy_mirrorball::{environment::{CubePixels, EnvironmentFileError, EquirectPixels}, prelude::*};
//! # fn example(camera: Entity, mut commands: Commands, mut images: ResMut<Assets<Image>>, measured: CubePixels)
//! # -> Result<(), EnvironmentFileError> {
//! let cube = EquirectPixels::open("studio.hdr")?.to_cube(128, Quat::IDENTITY);
//! commands.entity(camera).insert(LiveEnvironment { source: images.add(cube.to_image()) });
//!
//! measured.to_equirect(1024, Quat::IDENTITY).save("my_desk.exr")?;
//! # Ok(())
//! # }
//! ```

mod equirect;
mod files;
mod filter_pass;
mod maps;

pub use equirect::{CubePixels, EquirectPixels, equirect_direction, equirect_position};
pub use files::EnvironmentFileError;
pub use maps::FilteredEnvironment;

use crate::{MirrorballSystems, camera::ArCamera, probe::EnvironmentCube};
use bevy::{camera::Exposure, light::EnvironmentMapLight, prelude::*};

/// Lights the view of a camera by a cube map that changes while the game runs.
///
/// An [`ArCamera`] gets one by itself as soon as a [`LightProbeSphere`](crate::probe::LightProbeSphere) exists.
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct LiveEnvironment {
    /// The cube: radiance in frame buffer units (1.0 shows as 1.0), world axes, a filterable float format, six square layers
    /// with a power of two from 16 to 8192 as edge length. Other images are refused with an error.
    pub source: Handle<Image>,
}

/// Filters live environments.
pub struct EnvironmentPlugin;

impl Plugin for EnvironmentPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<LiveEnvironment>().add_systems(
            PreUpdate,
            (light_cameras_by_probe, start_filter, keep_intensity).chain().after(MirrorballSystems::Track),
        );
        filter_pass::build(app);
    }
}

type UnlitCamera = (With<ArCamera>, Without<LiveEnvironment>);

fn light_cameras_by_probe(mut commands: Commands, cameras: Query<Entity, UnlitCamera>, cubes: Query<&EnvironmentCube>) {
    let Some(cube) = cubes.iter().next() else {
        return;
    };
    for camera in &cameras {
        commands.entity(camera).insert(LiveEnvironment { source: cube.0.clone() });
    }
}

/// Intensity in cd/m² at which 1.0 in a map becomes 1.0 in the frame buffer.
fn unit_intensity(exposure: Option<&Exposure>) -> f32 {
    1.0 / exposure.copied().unwrap_or_default().exposure()
}

/// Edge lengths of cubes that can be filtered: at least one texel for each block of the diffuse sum.
const SOURCE_EDGES: std::ops::RangeInclusive<u32> = 16..=8192;

type ChangedEnvironment = (Entity, &'static LiveEnvironment, Option<&'static Exposure>);

fn start_filter(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    cameras: Query<ChangedEnvironment, Changed<LiveEnvironment>>,
) {
    for (camera, environment, exposure) in &cameras {
        let entity = &mut commands.entity(camera);
        entity.remove::<(FilteredEnvironment, EnvironmentMapLight)>();
        let Some(image) = images.get(&environment.source) else {
            error!("{camera}: LiveEnvironment.source is not an image (yet); insert the component once it is loaded");
            continue;
        };
        let size = image.texture_descriptor.size;
        let is_cube = size.depth_or_array_layers == 6 && size.width == size.height;
        if !is_cube || !size.width.is_power_of_two() || !SOURCE_EDGES.contains(&size.width) {
            error!(
                "{camera}: LiveEnvironment.source is {} × {} with {} layers; give a cube map, six square layers with a \
                 power of two from 16 to 8192 as edge length",
                size.width, size.height, size.depth_or_array_layers
            );
            continue;
        }
        let maps = FilteredEnvironment::allocate(&mut images, environment.source.clone(), size.width);
        let light = EnvironmentMapLight {
            diffuse_map: maps.diffuse.clone(),
            specular_map: maps.glossy.clone(),
            intensity: unit_intensity(exposure),
            ..default()
        };
        entity.insert((maps, light));
    }
}

type LitCamera = (&'static mut EnvironmentMapLight, Option<&'static Exposure>);

fn keep_intensity(mut cameras: Query<LitCamera, With<LiveEnvironment>>) {
    for (mut light, exposure) in &mut cameras {
        let intensity = unit_intensity(exposure);
        if light.intensity != intensity {
            light.intensity = intensity;
        }
    }
}
