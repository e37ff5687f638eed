//! Rings of taps: the sharp levels of the specular map.

use super::{
    cube_views::{bound, level_view, padded_faces},
    dispatch::{Dispatch, DispatchBuilder, padded_groups, texel_groups},
    downsample::Pyramid,
    lobe::{self, TapSet, TapSource, TapsUniform},
    specular_lobe::SpecularLobe,
};
use bevy::{prelude::*, render::render_resource::Texture};

/// How many levels finer than the mean over a face the pyramid is read at the face's center, where texels are
/// largest: half the base-2 logarithm of 6 ÷ π.
const CENTER_LEVEL_OFFSET: f64 = 0.467;

/// A level of the specular map.
pub(super) struct SpecularLevel<'a> {
    pub(super) map: &'a Texture,
    pub(super) level: u32,
    pub(super) lobe: SpecularLobe,
    /// Square of the level's perceptual roughness.
    pub(super) alpha: f64,
    /// Alpha of the next rougher level, which serves as the tail of the lobe.
    pub(super) rougher: f64,
}

/// Appends the dispatches that make a sharp level of the specular map. The next rougher level has to be made before.
pub(super) fn push_specular_taps(
    builder: &DispatchBuilder,
    cube_edge: u32,
    pyramid: &Pyramid,
    specular: &SpecularLevel,
    dispatches: &mut Vec<Dispatch>,
) -> Option<()> {
    let edge = specular.map.width() >> specular.level;
    let set = TapSet::for_edge(edge);
    let lobe = lobe::fit(specular.lobe, [specular.alpha, specular.rougher], set, cube_edge, edge);
    let mut sources = Vec::new();
    for source in &lobe.sources {
        let faces = padded_faces(builder.device, "mirrorball_environment_even", source.edge);
        dispatches.push(equalize(builder, pyramid, source, &faces)?);
        sources.push(level_view(&faces, 0));
    }
    let taps = builder.uniform("mirrorball_environment_taps", TapsUniform::from(&lobe))?;
    let (output, rougher) = (level_view(specular.map, specular.level), level_view(specular.map, specular.level + 1));
    // A ring that a set does not have has no taps.
    let source = |ring: usize| sources.get(ring).or(sources.last()).map(bound);
    let bindings = [
        (0, builder.sampler()),
        (5, bound(&output)),
        (6, taps.as_entire_binding()),
        (7, bound(&rougher)),
        (8, source(0)?),
        (9, source(1)?),
        (10, source(2)?),
    ];
    let step = match set {
        TapSet::Few => &builder.pipelines.few_taps,
        TapSet::Many => &builder.pipelines.many_taps,
    };
    dispatches.push(builder.dispatch(step, &bindings, texel_groups(edge)));
    Some(())
}

/// Dispatch that makes the cube that the taps of a ring read.
fn equalize(builder: &DispatchBuilder, pyramid: &Pyramid, source: &TapSource, faces: &Texture) -> Option<Dispatch> {
    // The level to read grows over a face by 1.2, from the center to the corners. Three bound levels cover that, except
    // for at most 0.2 of a level in the corners.
    let last = pyramid.last();
    let first = (source.level - CENTER_LEVEL_OFFSET).floor().clamp(0.0, last as f64);
    let reach = (last as f64 - first).min(2.0);
    let sharpness = Vec2::new((source.level - first) as f32, reach as f32);
    let sharpness = builder.uniform("mirrorball_environment_sharpness", sharpness)?;
    let levels = [0, 1, 2].map(|i| pyramid.view(first as usize + i));
    let output = level_view(faces, 0);
    let bindings = [
        (0, builder.sampler()),
        (1, bound(&levels[0])),
        (2, bound(&levels[1])),
        (3, bound(&levels[2])),
        (4, sharpness.as_entire_binding()),
        (5, bound(&output)),
    ];
    Some(builder.dispatch(&builder.pipelines.equalize, &bindings, padded_groups(faces)))
}
