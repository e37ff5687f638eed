//! Two cameras, one paper: how their exposures and white balances differ.

use super::{
    desk_frame::{DeskFrame, Paper},
    sample_points::{paper_points, sample_radiance},
};
use crate::camera::PosedFrame;
use bevy::prelude::*;

/// What the pictures of a second camera have to be multiplied with to look like the first one's; for the entity of the second.
///
/// Found by [`match_cameras`]; nothing applies it by itself. A second camera that shows light takes it as
/// [`LightProbeCamera::gain`](crate::probe::LightProbeCamera::gain).
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct CameraMatch {
    /// Factor on linear radiance, per channel.
    pub gain: Vec3,
    /// Points of paper that both cameras show, not clipped in any channel.
    pub points: usize,
    /// How much the points' factors scatter, relative: the typical distance from the median. Large where shadows of people pass, or
    /// the paper shines.
    pub scatter: f32,
}

/// Fewer common points tell nothing.
const MIN_POINTS: usize = 8;

/// Compares the paper of the same markers in pictures of two cameras, taken at about the same time.
///
/// White paper is as bright from everywhere, so that the ratio of its brightness is that of the cameras' exposures and white
/// balances. Papers are paired in the order of [`DeskFrame::papers`]. `None` if too little of them is seen by both, or what is
/// seen is clipped.
pub fn match_cameras(reference: &DeskFrame, second: &DeskFrame) -> Option<CameraMatch> {
    compare_papers((reference.posed_frame(), &reference.papers), (second.posed_frame(), &second.papers), 0.0)
}

/// Compares pictures by the papers in them. Paper that is not brighter than `darkest` in each channel does not count.
pub(super) fn compare_papers(
    (reference, ours): (PosedFrame, &[Paper]),
    (second, theirs): (PosedFrame, &[Paper]),
    min_radiance: f32,
) -> Option<CameraMatch> {
    let radiance = |posed: &PosedFrame, pos_world: Vec3| {
        let pixel = posed.project(pos_world)?;
        sample_radiance(posed.frame, pixel)
            .filter(|radiance| radiance.is_finite() && radiance.min_element() > min_radiance)
    };
    let ratios: Vec<Vec3> = paper_points(ours)
        .iter()
        .zip(&paper_points(theirs))
        .filter_map(|(a, b)| Some(radiance(&reference, a.pos_world)? / radiance(&second, b.pos_world)?))
        .collect();
    if ratios.len() < MIN_POINTS {
        return None;
    }
    let median = |mut values: Vec<f32>| {
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    };
    let gain = Vec3::from_array(std::array::from_fn(|c| median(ratios.iter().map(|ratio| ratio[c]).collect())));
    let scatter = median(ratios.iter().map(|ratio| (*ratio / gain - 1.0).abs().max_element()).collect());
    Some(CameraMatch { gain, points: ratios.len(), scatter })
}
