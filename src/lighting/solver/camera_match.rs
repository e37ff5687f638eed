//! Exposure and white balance of two cameras, compared on the same paper.

use super::{
    desk_frame::{DeskFrame, Paper},
    sample_points::{paper_points, sample_radiance},
};
use crate::{camera::PosedFrame, median::median_by};
use bevy::prelude::*;

/// Gain that makes the frames of a second camera look like those of the first; for the entity of the second camera.
///
/// Measured by [`match_cameras`]; nothing applies it automatically. A second camera that shows light takes it as
/// [`LightProbeCamera::gain`](crate::probe::LightProbeCamera::gain).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{lighting::CameraMatch, probe::LightProbeCamera};
/// fn apply(mut cameras: Query<(&CameraMatch, &mut LightProbeCamera), Changed<CameraMatch>>) {
///     for (found, mut probe) in &mut cameras {
///         probe.gain = found.gain;
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct CameraMatch {
    /// Factor on linear radiance, per channel.
    pub gain: Vec3,
    /// Number of paper points that both cameras show and that are not clipped in any channel.
    pub points: usize,
    /// Median relative deviation of the points' factors from the gain. Large where people cast moving shadows or the
    /// paper has highlights.
    pub scatter: f32,
}

/// Fewest common points for a result.
const MIN_POINTS: usize = 8;

/// Compares the paper of the same markers in frames of two cameras, taken at about the same time.
///
/// White paper has the same radiance in all directions, so the ratio of its pixel values is the ratio of the cameras'
/// exposures and white balances. Papers are paired in the order of [`DeskFrame::papers`]. Returns `None` if both
/// cameras see too little common paper, or if that is clipped.
pub fn match_cameras(reference: &DeskFrame, second: &DeskFrame) -> Option<CameraMatch> {
    compare_papers((reference.posed_frame(), &reference.papers), (second.posed_frame(), &second.papers), 0.0)
}

/// Compares frames by the papers in them. Paper that is not brighter than `min_radiance` in each channel is ignored.
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
    let median = |mut values: Vec<f32>| median_by(&mut values, f32::total_cmp).unwrap_or(1.0);
    let gain = Vec3::from_array(std::array::from_fn(|c| median(ratios.iter().map(|ratio| ratio[c]).collect())));
    let scatter = median(ratios.iter().map(|ratio| (*ratio / gain - 1.0).abs().max_element()).collect());
    Some(CameraMatch { gain, points: ratios.len(), scatter })
}
