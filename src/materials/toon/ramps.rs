//! Ramps of toon surfaces: images with one step per pixel.
//!
//! The pixels are copied into the uniform buffers of materials, because a `StandardMaterial` with a shadow dome and an
//! environment map leaves no texture binding free within WebGPU's limits.

use bevy::{
    image::TextureAccessError,
    platform::collections::{HashMap, HashSet},
    prelude::*,
    render::render_resource::{ShaderType, TextureDimension},
};
use std::sync::Arc;

/// Ramps of all toon surfaces at and below an entity, in place of the bands and the highlight of
/// [`ToonStyle`](crate::materials::ToonStyle).
///
/// A ramp is an image of n × 1 pixels, one for each step, from the dark end on the left to the bright one on the right;
/// of higher images the first row counts. Steps may be unequally wide (by repeated pixels) and colored. Each step is
/// flat: x in 0…1 shows pixel ⌊n · x⌋. Images wider than 256 pixels are read at 256 places. Colors are as the image's
/// format says: those of sRGB files are converted to linear numbers, which count 0…1 (clamped).
///
/// The ramps of the nearest ancestor apply, the entity itself included. Images may change; while one is not loaded, and
/// if its format is compressed or its data is on the GPU only, the bands of the style stand in for it.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, assets: Res<AssetServer>) {
/// let ramps = ToonRamps { diffuse: Some(assets.load("skin.png")), specular: None };
/// commands.spawn((SurfaceStyle::Toon(default()), ramps));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct ToonRamps {
    /// Brightness over the position between dark and bright, or over N·L in [`ToonModel::Phong`]. Defaults to `None`:
    /// the style's bands.
    ///
    /// [`ToonModel::Phong`]: crate::materials::ToonModel::Phong
    pub diffuse: Option<Handle<Image>>,
    /// Highlight over (R·V)ⁿ. Defaults to `None`: one step at a half.
    pub specular: Option<Handle<Image>>,
}

impl ToonRamps {
    /// Largest number of steps.
    pub const MAX_STEPS: u32 = 256;
}

/// An image of a ramp, as it was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::materials) struct RampId {
    image: AssetId<Image>,
    /// Number of the reading: changed images get another one.
    reading: u32,
}

/// Ramps of a mesh that could be read: of diffuse and of specular light.
pub(in crate::materials) type RampPair = [Option<RampId>; 2];

/// What was read of the images of all ramps.
#[derive(Resource, Default)]
pub(in crate::materials) struct RampImages {
    by_image: HashMap<AssetId<Image>, (u32, Option<Arc<[Vec4]>>)>,
    readings: u32,
}

impl RampImages {
    /// Returns the ramps of a component that could be read.
    pub(in crate::materials) fn pair(&self, ramps: &ToonRamps) -> RampPair {
        [&ramps.diffuse, &ramps.specular].map(|ramp| {
            let image = ramp.as_ref()?.id();
            let (reading, steps) = self.by_image.get(&image)?;
            steps.is_some().then_some(RampId { image, reading: *reading })
        })
    }

    fn steps(&self, ramp: Option<RampId>) -> &[Vec4] {
        let read = ramp.and_then(|ramp| self.by_image.get(&ramp.image));
        read.and_then(|(_, steps)| steps.as_deref()).unwrap_or_default()
    }
}

/// Reads the images of ramps that are new or have changed.
pub(in crate::materials) fn read_ramps(
    mut changes: MessageReader<AssetEvent<Image>>,
    mut ramps: ResMut<RampImages>,
    components: Query<&ToonRamps>,
    images: Res<Assets<Image>>,
) {
    if components.is_empty() && ramps.by_image.is_empty() {
        changes.clear();
        return;
    }
    let RampImages { by_image, readings } = &mut *ramps;
    let changed = changes.read().filter_map(|event| match event {
        AssetEvent::Added { id } | AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    });
    let changed: HashSet<_> = changed.collect();
    let wanted: HashSet<_> =
        components.iter().flat_map(|ramps| [&ramps.diffuse, &ramps.specular]).flatten().map(Handle::id).collect();
    by_image.retain(|image, _| wanted.contains(image) && !changed.contains(image));
    for id in wanted {
        let Some(image) = images.get(id).filter(|_| !by_image.contains_key(&id)) else {
            continue;
        };
        let steps = match steps_of(image) {
            Ok(steps) => Some(steps),
            Err(error) => {
                warn!("the toon ramp {id} cannot be read, bands stand in for it: {error}");
                None
            }
        };
        *readings = readings.wrapping_add(1);
        by_image.insert(id, (*readings, steps));
    }
}

/// Reads the steps of a ramp.
fn steps_of(image: &Image) -> Result<Arc<[Vec4]>, TextureAccessError> {
    let is_line = image.texture_descriptor.dimension == TextureDimension::D1;
    let width = image.width();
    let count = width.min(ToonRamps::MAX_STEPS);
    let read = |i: u32| {
        let x = if count == width { i } else { (2 * i + 1) * width / (2 * count) };
        let color = if is_line { image.get_color_at_1d(x) } else { image.get_color_at(x, 0) }?;
        Ok(color.to_linear().to_vec4().map(|channel| if channel > 0.0 { channel.min(1.0) } else { 0.0 }))
    };
    (0..count).map(read).collect()
}

/// Mirror of `Ramps` in `toon_bindings.wgsl`.
#[derive(ShaderType, Clone, Debug)]
pub(super) struct RampsUniform {
    diffuse: [Vec4; ToonRamps::MAX_STEPS as usize],
    specular: [Vec4; ToonRamps::MAX_STEPS as usize],
    diffuse_steps: f32,
    specular_steps: f32,
}

impl RampsUniform {
    pub(super) fn new([diffuse, specular]: RampPair, images: &RampImages) -> Self {
        let copied = |steps: &[Vec4]| {
            let mut copy = [Vec4::ONE; ToonRamps::MAX_STEPS as usize];
            copy.iter_mut().zip(steps).for_each(|(to, from)| *to = *from);
            (copy, steps.len().max(1) as f32)
        };
        let (diffuse, diffuse_steps) = copied(images.steps(diffuse));
        let (specular, specular_steps) = copied(images.steps(specular));
        Self { diffuse, specular, diffuse_steps, specular_steps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::{
        asset::RenderAssetUsages,
        render::render_resource::{Extent3d, TextureFormat},
    };

    fn ramp(grays: &[u8], format: TextureFormat) -> Image {
        let texels = grays.iter().flat_map(|gray| [*gray, *gray, *gray, 255]).collect();
        let extent = Extent3d { width: grays.len() as u32, height: 1, depth_or_array_layers: 1 };
        Image::new(extent, TextureDimension::D2, texels, format, RenderAssetUsages::default())
    }

    #[test]
    fn steps_are_linear_numbers_as_the_format_says() {
        let steps = |format| steps_of(&ramp(&[0, 128, 255], format)).expect("readable");
        let linear: Vec<f32> = steps(TextureFormat::Rgba8Unorm).iter().map(|step| step.x).collect();
        assert_eq!(linear, [0.0, 128.0 / 255.0, 1.0]);
        let srgb = steps(TextureFormat::Rgba8UnormSrgb)[1];
        assert!((srgb.x - 0.2158).abs() < 1e-3, "{srgb}");
    }

    #[test]
    fn wide_ramps_are_read_at_as_many_places_as_there_are_steps() {
        let grays: Vec<u8> = (0..1024).map(|i| (i / 4) as u8).collect();
        let steps = steps_of(&ramp(&grays, TextureFormat::Rgba8Unorm)).expect("readable");
        assert_eq!(steps.len(), 256);
        assert!(steps.iter().enumerate().all(|(i, step)| step.x == i as f32 / 255.0));
    }

    #[test]
    fn images_without_data_cannot_be_read() {
        let mut empty = ramp(&[0, 255], TextureFormat::Rgba8Unorm);
        empty.data = None;
        assert!(steps_of(&empty).is_err());
    }
}
