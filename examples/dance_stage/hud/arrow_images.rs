//! Images of arrows, painted in code.

use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

/// Images of arrows that point up.
#[derive(Resource)]
pub(super) struct ArrowImages {
    /// A white arrow with a dark edge, to be tinted.
    pub arrow: Handle<Image>,
    /// The outline of an arrow.
    pub target: Handle<Image>,
    /// A soft light in the form of an arrow.
    pub glow: Handle<Image>,
}

/// Width and height in pixels: that of a lane at 4K.
const SIZE: u32 = 256;

/// Corners of an arrow that points up, in −1…1 with y downwards.
const CORNERS: [Vec2; 9] = [
    Vec2::new(0.0, -0.86),
    Vec2::new(0.84, -0.02),
    Vec2::new(0.56, 0.27),
    Vec2::new(0.21, -0.07),
    Vec2::new(0.21, 0.82),
    Vec2::new(-0.21, 0.82),
    Vec2::new(-0.21, -0.07),
    Vec2::new(-0.56, 0.27),
    Vec2::new(-0.84, -0.02),
];
/// Corners are this round.
const ROUNDING: f32 = 0.06;
const EDGE: f32 = 0.09;

impl FromWorld for ArrowImages {
    fn from_world(world: &mut World) -> Self {
        let mut images = world.resource_mut::<Assets<Image>>();
        let mut paint = |color: fn(Vec2, f32) -> LinearRgba| images.add(paint(color));
        Self {
            arrow: paint(|at, distance| {
                let inside = inside(distance + EDGE);
                // Brighter above, as if lit, and a lighter middle line.
                let shade = 0.62 + 0.38 * inside * (0.75 - 0.35 * at.y).clamp(0.0, 1.0);
                LinearRgba::gray(shade * inside).with_alpha(self::inside(distance))
            }),
            target: paint(|_, distance| {
                let line = inside(distance) * (1.0 - inside(distance + EDGE));
                LinearRgba::WHITE.with_alpha(line.max(0.25 * inside(distance)))
            }),
            glow: paint(|_, distance| LinearRgba::WHITE.with_alpha((-14.0 * distance.max(0.0)).exp())),
        }
    }
}

/// 1 within a form, 0 outside, and between over the width of a pixel.
fn inside(distance: f32) -> f32 {
    (0.5 - 0.5 * distance * SIZE as f32).clamp(0.0, 1.0)
}

fn paint(color: impl Fn(Vec2, f32) -> LinearRgba) -> Image {
    let texel = |i: u32| {
        let at = (Vec2::new((i % SIZE) as f32, (i / SIZE) as f32) + 0.5) / SIZE as f32 * 2.0 - 1.0;
        Srgba::from(color(at, distance(at) - ROUNDING)).to_u8_array()
    };
    let extent = Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 };
    let texels = (0..SIZE * SIZE).flat_map(texel).collect();
    let usages = RenderAssetUsages::RENDER_WORLD | RenderAssetUsages::MAIN_WORLD;
    Image::new(extent, TextureDimension::D2, texels, TextureFormat::Rgba8UnormSrgb, usages)
}

/// Distance to the outline of the arrow, negative inside: to the nearest edge, with the sign by the number of edges
/// that a ray to the right crosses.
fn distance(at: Vec2) -> f32 {
    let edges = CORNERS.iter().zip(CORNERS.iter().cycle().skip(1));
    let mut nearest = f32::INFINITY;
    let mut is_inside = false;
    for (from, to) in edges {
        let along = (at - *from).dot(*to - *from) / from.distance_squared(*to);
        nearest = nearest.min(at.distance(from.lerp(*to, along.clamp(0.0, 1.0))));
        let crosses = (from.y > at.y) != (to.y > at.y);
        if crosses && at.x < from.x + (at.y - from.y) / (to.y - from.y) * (to.x - from.x) {
            is_inside = !is_inside;
        }
    }
    if is_inside { -nearest } else { nearest }
}
