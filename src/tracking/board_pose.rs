//! Pose of an anchor from all of its markers in a frame.
//!
//! Each of the largest markers gives two poses of the board to start from. From each of them one fit over all corners
//! (see `pose_fit`) follows, in which markers that do not agree lose their weight (iteratively reweighted, Geman and
//! `McClure` 1987, one weight for the four corners of a marker). The fit counts that leaves the least disagreement,
//! where a marker cannot disagree more than wholly.

use super::{
    BoardMarker, DetectedMarker, MarkerAnchor, MarkerBoard, MarkerId, MarkerPose, PoseCandidates,
    pose::square_points,
    pose_fit::{CvPose, Lens, PointPair, error, refine},
};
use crate::camera::Intrinsics;
use bevy::{math::DMat3, prelude::*};

/// Number of markers, the largest first, from whose own poses the fit starts.
const MAX_STARTS: usize = 3;
/// Error of a marker that halves its vote, as a fraction of its side in the frame, and the least in pixels.
const TOLERANCE: f64 = 0.1;
const MIN_TOLERANCE: f64 = 1.5;
/// Multiples of the tolerance from wide to narrow: the pose of one marker is far off at the far end of the board.
const WIDE_TO_NARROW: [f64; 4] = [8.0, 4.0, 2.0, 1.0];
/// In the end, errors are measured by this multiple of the median error of the markers, in pixels at least this much.
const MEDIAN_MULTIPLE: f64 = 3.0;
const MIN_SCALE: f64 = 0.7;
/// Weight above which a marker counts as one that the pose rests on.
const MIN_WEIGHT: f64 = 0.1;

/// Pose of an anchor in a frame.
pub(super) struct AnchorPose {
    pub(super) candidates: PoseCandidates,
    /// Markers that the pose rests on.
    pub(super) markers: Vec<MarkerId>,
}

impl AnchorPose {
    /// Pose from the anchor's own marker, if it was detected, and all markers of its board among `detected`.
    pub(super) fn estimate<'a>(
        anchor: &MarkerAnchor,
        board: Option<&MarkerBoard>,
        own: Option<&'a DetectedMarker>,
        detected: &'a [DetectedMarker],
        intrinsics: &Intrinsics,
    ) -> Option<Self> {
        let mut seen: Vec<_> =
            own.map(|own| SeenMarker::new(own, anchor.size, Isometry3d::IDENTITY)).into_iter().collect();
        for BoardMarker { family, id, size, place } in board.map_or(&[][..], |board| &board.markers) {
            let same = detected.iter().filter(|marker| (marker.family, marker.id) == (*family, *id));
            seen.extend(same.map(|marker| SeenMarker::new(marker, *size, *place)));
        }
        seen.sort_by(|a, b| b.side.total_cmp(&a.side));
        match &seen[..] {
            [] => None,
            [single] => {
                Some(Self { candidates: single.candidates(intrinsics)?, markers: vec![single.marker.marker()] })
            }
            _ => fuse(&seen, intrinsics),
        }
    }
}

/// A marker in a frame, and where it is in the frame of the anchor.
struct SeenMarker<'a> {
    marker: &'a DetectedMarker,
    size: f64,
    anchor_from_marker: Isometry3d,
    pairs: [PointPair; 4],
    /// Mean length of its sides in the frame, in pixels.
    side: f64,
}

impl<'a> SeenMarker<'a> {
    fn new(marker: &'a DetectedMarker, size: f32, anchor_from_marker: Isometry3d) -> Self {
        let rotation = DMat3::from_quat(anchor_from_marker.rotation.as_dquat());
        let translation = Vec3::from(anchor_from_marker.translation).as_dvec3();
        let points = square_points(size.into()).map(|point| rotation * point + translation);
        let corners = &marker.corners;
        Self {
            marker,
            size: size.into(),
            anchor_from_marker,
            pairs: std::array::from_fn(|i| PointPair::new(points[i], corners[i])),
            side: (0..4).map(|i| corners[i].distance(corners[(i + 1) % 4])).sum::<f64>() / 4.0,
        }
    }

    /// Both poses of the anchor that this marker alone gives.
    fn candidates(&self, intrinsics: &Intrinsics) -> Option<PoseCandidates> {
        let of_marker = PoseCandidates::from_corners(&self.marker.corners, intrinsics, self.size)?;
        let marker_from_anchor = self.anchor_from_marker.inverse();
        let of_anchor =
            |pose: MarkerPose| MarkerPose { camera_from_marker: pose.camera_from_marker * marker_from_anchor, ..pose };
        Some(PoseCandidates { best: of_anchor(of_marker.best), alternative: of_anchor(of_marker.alternative) })
    }

    fn error(&self, lens: &Lens, pose: &CvPose) -> f64 {
        error(&self.pairs, lens, pose)
    }

    fn tolerance(&self) -> f64 {
        (TOLERANCE * self.side).max(MIN_TOLERANCE)
    }
}

fn fuse(seen: &[SeenMarker], intrinsics: &Intrinsics) -> Option<AnchorPose> {
    let lens = Lens::from(intrinsics);
    let mut best: Option<(f64, CvPose)> = None;
    let mut consider = |pose: CvPose| {
        let disagreement = |marker: &SeenMarker| (marker.error(&lens, &pose) / marker.tolerance()).powi(2).min(1.0);
        let sum = seen.iter().map(disagreement).sum();
        if best.is_none_or(|(least, _)| sum < least) {
            best = Some((sum, pose));
        }
    };
    for start in seen.iter().take(MAX_STARTS).filter_map(|marker| marker.candidates(intrinsics)) {
        for pose in [start.best, start.alternative] {
            let start = CvPose::from_isometry(&pose.camera_from_marker);
            let narrowed = WIDE_TO_NARROW
                .into_iter()
                .try_fold(start, |pose, wide| reweighted(seen, &lens, pose, |marker| wide * marker.tolerance()));
            // With wide tolerances two markers that disagree pull each other along.
            let narrow = reweighted(seen, &lens, start, |marker| marker.tolerance());
            [narrowed, narrow].into_iter().flatten().for_each(&mut consider);
        }
    }
    let (_, mut pose) = best?;
    let scale = |pose: &CvPose| {
        let mut errors: Vec<f64> = seen.iter().map(|marker| marker.error(&lens, pose)).collect();
        errors.sort_by(f64::total_cmp);
        (MEDIAN_MULTIPLE * errors[(errors.len() - 1) / 2]).max(MIN_SCALE)
    };
    for _ in 0..3 {
        let scale = scale(&pose);
        pose = reweighted(seen, &lens, pose, |marker| scale.min(marker.tolerance()))?;
    }
    let scale = scale(&pose);
    let weight = |marker: &&SeenMarker| geman_mcclure(marker.error(&lens, &pose), scale.min(marker.tolerance()));
    let agreeing: Vec<_> = seen.iter().filter(|marker| weight(marker) >= MIN_WEIGHT).collect();
    let pairs: Vec<PointPair> = agreeing.iter().flat_map(|marker| marker.pairs).collect();
    // The second pose, as for a single square: the plane of the largest marker mirrored in tilt.
    let place = agreeing.first()?.anchor_from_marker;
    let of_largest = CvPose::from_isometry(&(pose.to_isometry() * place));
    let second = CvPose::from_isometry(&(of_largest.mirrored().to_isometry() * place.inverse()));
    let second = refine(&pairs, &lens, second).unwrap_or(pose);
    let to_marker_pose = |pose: &CvPose| MarkerPose {
        camera_from_marker: pose.to_isometry(),
        reprojection_error: error(&pairs, &lens, pose) as f32,
    };
    let candidates = PoseCandidates::sorted(to_marker_pose(&pose), to_marker_pose(&second));
    Some(AnchorPose { candidates, markers: agreeing.iter().map(|seen| seen.marker.marker()).collect() })
}

/// Fit over the corners of all markers, each weighted by how far it is from a pose as measured by its scale in pixels.
fn reweighted(seen: &[SeenMarker], lens: &Lens, pose: CvPose, scale: impl Fn(&SeenMarker) -> f64) -> Option<CvPose> {
    let pairs: Vec<PointPair> = seen
        .iter()
        .flat_map(|marker| {
            let weight = geman_mcclure(marker.error(lens, &pose), scale(marker));
            marker.pairs.map(|pair| PointPair { weight, ..pair })
        })
        .filter(|pair| pair.weight > 0.0)
        .collect();
    refine(&pairs, lens, pose)
}

/// Weight of an error in pixels that is measured by a scale.
fn geman_mcclure(error: f64, scale: f64) -> f64 {
    (1.0 + (error / scale).powi(2)).powi(-2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::DVec2;

    const LENS: Intrinsics = Intrinsics::new(Vec2::new(600.0, 605.0), Vec2::new(318.0, 243.0), UVec2::new(640, 480));

    fn anchor() -> MarkerAnchor {
        MarkerAnchor::new(0, 0.06)
    }

    /// Pose of the anchor for a camera at a point of its frame that looks at it.
    fn view(eye: Vec3) -> Isometry3d {
        Transform::from_translation(eye).looking_at(Vec3::new(0.02, -0.02, 0.01), Vec3::Y).to_isometry().inverse()
    }

    /// How a marker looks, with corners off by up to so many pixels.
    fn seen(marker: &BoardMarker, camera_from_anchor: &Isometry3d, noise: f64, seed: usize) -> DetectedMarker {
        let pose = CvPose::from_isometry(&(*camera_from_anchor * marker.place));
        let lens = Lens::from(&LENS);
        let points = square_points(marker.size.into());
        let corners = std::array::from_fn(|i| {
            let p = pose.rotation * points[i] + pose.translation;
            let at = (seed * 64 + marker.id as usize * 4 + i) as f64;
            lens.center
                + lens.focal * p.truncate() / p.z
                + noise * DVec2::new((at * 12.9898).sin(), (at * 78.233).sin())
        });
        DetectedMarker { family: marker.family, id: marker.id, corners, corrected_bits: 0 }
    }

    /// The anchor's marker and those of its board that face the camera.
    fn see(board: &MarkerBoard, camera_from_anchor: &Isometry3d, noise: f64, seed: usize) -> Vec<DetectedMarker> {
        let own = BoardMarker::new(anchor().marker(), anchor().size, Isometry3d::IDENTITY);
        let faces = |marker: &&BoardMarker| {
            let pose = *camera_from_anchor * marker.place;
            (pose.rotation * Vec3::Y).dot(pose.translation.into()) < 0.0
        };
        let all = [&own].into_iter().chain(&board.markers).filter(faces);
        all.map(|marker| seen(marker, camera_from_anchor, noise, seed)).collect()
    }

    fn estimate(board: &MarkerBoard, detected: &[DetectedMarker]) -> AnchorPose {
        let own = detected.iter().find(|marker| marker.id == 0);
        AnchorPose::estimate(&anchor(), Some(board), own, detected, &LENS).expect("a pose")
    }

    /// Rotation error in radians and translation error in meters.
    fn off(pose: &MarkerPose, truth: &Isometry3d) -> (f32, f32) {
        let turn = pose.camera_from_marker.rotation * truth.rotation.inverse();
        let shift = pose.camera_from_marker.translation.distance(truth.translation);
        (2.0 * turn.xyz().length().atan2(turn.w.abs()), shift)
    }

    fn carton() -> MarkerBoard {
        MarkerBoard::box_sides(&anchor(), Vec3::new(0.12, 0.1, 0.1), 0.06)
    }

    fn sheet() -> MarkerBoard {
        MarkerBoard::grid(&anchor(), 3, 2, 0.08)
    }

    #[test]
    fn exact_corners_give_the_exact_pose_whichever_are_seen() {
        let truth = view(Vec3::new(0.3, 0.3, 0.4));
        for (board, count) in [(carton(), 3), (sheet(), 6)] {
            let detected = see(&board, &truth, 0.0, 0);
            assert_eq!(detected.len(), count);
            for hidden in (0..count).map(Some).chain([None]) {
                let rest: Vec<_> = (0..count).filter(|i| Some(*i) != hidden).map(|i| detected[i].clone()).collect();
                let found = estimate(&board, &rest);
                let (turn, shift) = off(&found.candidates.best, &truth);
                assert!(turn < 1e-4 && shift < 1e-5, "without {hidden:?}: {turn} rad, {shift} m");
                assert_eq!(found.markers.len(), rest.len());
            }
        }
    }

    #[test]
    fn a_marker_that_was_moved_is_outvoted() {
        let truth = view(Vec3::new(0.2, 0.5, 0.3));
        for (moved, distance) in (0..6).flat_map(|moved| [0.004, 0.02, 0.1].map(|distance| (moved, distance))) {
            let mut detected = see(&sheet(), &truth, 0.1, moved);
            let honest = off(&estimate(&sheet(), &detected).candidates.best, &truth);
            let place = sheet().markers.get(moved.wrapping_sub(1)).map_or(Isometry3d::IDENTITY, |marker| marker.place);
            let place = Isometry3d::from_translation(Vec3::new(distance, 0.0, 0.5 * distance)) * place;
            detected[moved] = seen(&BoardMarker::new(moved as u32, 0.06, place), &truth, 0.1, moved);
            let found = estimate(&sheet(), &detected);
            let spoiled = off(&found.candidates.best, &truth);
            println!("{moved} moved by {distance}: {honest:?} → {spoiled:?}");
            assert!(spoiled.0 < honest.0 + 2e-3 && spoiled.1 < honest.1 + 1e-3, "{moved}: {honest:?}, {spoiled:?}");
            assert!(!found.markers.contains(&(moved as u32).into()), "{moved}: {:?}", found.markers);
        }
    }

    #[test]
    fn of_two_that_disagree_the_larger_counts() {
        let truth = view(Vec3::new(0.1, 0.4, 0.2));
        let board = MarkerBoard::new([BoardMarker::beside(1, 0.04, 0.1, 0.0)]);
        let moved = BoardMarker::beside(1, 0.04, 0.13, 0.02);
        let own = BoardMarker::beside(0, 0.06, 0.0, 0.0);
        let found = estimate(&board, &[seen(&own, &truth, 0.05, 0), seen(&moved, &truth, 0.05, 1)]);
        assert_eq!(found.markers, [0.into()]);
        assert!(off(&found.candidates.best, &truth).1 < 2e-3);
    }

    #[test]
    fn a_box_is_never_ambiguous_and_a_far_sheet_has_the_truth_among_its_poses() {
        for seed in 0..30 {
            let eye = Quat::from_rotation_y(seed as f32) * Vec3::new(0.5, 0.7, 0.0);
            let found = estimate(&carton(), &see(&carton(), &view(eye), 0.3, seed));
            assert!(!found.candidates.is_ambiguous(), "{seed}");
            assert!(off(&found.candidates.best, &view(eye)).0 < 0.02, "{seed}");
            let far = view(Quat::from_rotation_y(seed as f32) * Vec3::new(0.5, 2.5, 0.0));
            let found = estimate(&sheet(), &see(&sheet(), &far, 0.3, seed));
            let errors = [found.candidates.best, found.candidates.alternative].map(|pose| off(&pose, &far).0);
            assert!(errors[0].min(errors[1]) < 0.1, "{seed}: {errors:?}");
            assert!(found.candidates.is_ambiguous() || errors[0] < 0.1, "{seed}: {errors:?}");
        }
    }

    #[test]
    fn a_board_is_more_exact_than_its_largest_marker() {
        let (mut of_board, mut of_marker) = (0.0, 0.0);
        for seed in 0..40 {
            let truth = view(Quat::from_rotation_y(0.7 * seed as f32) * Vec3::new(0.3, 0.5, 0.0));
            let detected = see(&sheet(), &truth, 0.2, seed);
            of_board += off(&estimate(&sheet(), &detected).candidates.best, &truth).0;
            of_marker += off(&estimate(&sheet(), &detected[..1]).candidates.choose(Some(&truth)), &truth).0;
        }
        println!("{} of {}", of_board, of_marker);
        assert!(of_board < 0.6 * of_marker, "{of_board} instead of {of_marker}");
    }
}
