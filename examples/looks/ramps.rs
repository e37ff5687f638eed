//! Ramps for toons, painted in code. A game would load images that its artists have painted.

use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::prelude::*;

/// Choice of ramps for a thing; becomes its [`ToonRamps`], which hold images and so cannot be saved by themselves.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default)]
pub(crate) struct Ramps {
    /// Steps of light; `None` for the bands of the style.
    pub diffuse: Option<Ramp>,
    /// Steps of the highlight; `None` for a single one.
    pub specular: Option<Ramp>,
}

#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ramp {
    /// Cool shadows, a warm line where they begin, and light.
    Anime,
    /// From blue shadows to yellow light without a step that shows.
    CoolToWarm,
    /// Black, gray and white, of which the gray is wide.
    Comic,
    /// Blue and violet shadows, light as of a low sun.
    Dusk,
    /// A thin bright ring around a dim middle, for highlights.
    Ring,
    /// Shadow or light.
    TwoTone,
}

impl Ramp {
    /// Colors of the steps, dark ones first. Repeated pixels make wide steps.
    fn pixels(self) -> Vec<[u8; 3]> {
        match self {
            Self::Anime => {
                let (shadow, border, light) = ([168, 150, 205], [236, 160, 150], [255, 250, 244]);
                [vec![shadow; 7], vec![border; 1], vec![light; 12]].concat()
            }
            Self::CoolToWarm => {
                let (cool, warm) = (Vec3::new(90.0, 105.0, 205.0), Vec3::new(255.0, 235.0, 165.0));
                (0..64).map(|i| cool.lerp(warm, i as f32 / 63.0).to_array().map(|channel| channel as u8)).collect()
            }
            Self::Comic => vec![[110; 3], [200; 3], [200; 3], [200; 3], [255; 3]],
            Self::Dusk => vec![[70, 76, 190], [140, 120, 220], [140, 120, 220], [255, 205, 140], [255, 245, 220]],
            Self::Ring => vec![[0; 3], [0; 3], [0; 3], [255; 3], [70; 3], [70; 3]],
            Self::TwoTone => [vec![[130; 3]; 2], vec![[250; 3]; 8]].concat(),
        }
    }

    fn paint(self) -> Image {
        let pixels = self.pixels();
        let size = Extent3d { width: pixels.len() as u32, height: 1, depth_or_array_layers: 1 };
        let texels = pixels.iter().flat_map(|[red, green, blue]| [*red, *green, *blue, 255]).collect();
        let format = TextureFormat::Rgba8UnormSrgb;
        Image::new(size, TextureDimension::D2, texels, format, RenderAssetUsages::default())
    }
}

/// Gives things the ramps of their choice.
pub(crate) fn paint_ramps(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    changed: Query<(Entity, &Ramps), Changed<Ramps>>,
) {
    for (thing, Ramps { diffuse, specular }) in &changed {
        let mut paint = |ramp: &Option<Ramp>| ramp.map(|ramp| images.add(ramp.paint()));
        commands.entity(thing).insert(ToonRamps { diffuse: paint(diffuse), specular: paint(specular) });
    }
}
