//! Boards of several markers: rendered sheets and boxes give the pose of their camera, whichever marker is hidden.

use crate::{
    lens::LENS,
    pose_error::PoseError,
    scripted_desk::{Desk, SIZE, first_view, second_view, seen},
};
use bevy::{color::Srgba, prelude::*};
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{
        AprilTagDetector, BoardMarker, MarkerBoard, MarkerDetection, MarkerFamily, MarkerState, TrackingPlugin,
        marker_cells,
    },
};
use std::time::Duration;

/// Errors of the pose of a rendered board that has all of its markers: rotation, and translation as a share of the
/// distance.
const DEGREES: f32 = 0.03;
const SHARE: f32 = 0.0003;

/// A printed marker in a rendered scene.
struct Print {
    cells: Vec<Vec<bool>>,
    /// Frame of the anchor → frame of the marker.
    marker_from_anchor: Isometry3d,
    /// Side of a cell in meters.
    cell: f32,
    /// Where it is in the frame: the pixels of its bounding box.
    pixels: Rect,
}

impl Print {
    fn new(marker: &BoardMarker, camera_from_anchor: Isometry3d) -> Self {
        let cells = marker_cells(marker.marker()).expect("the marker exists");
        let cell = marker.size / marker.family.square_cells() as f32;
        let half = 0.5 * cell * cells.len() as f32;
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, z)| {
            let corner = camera_from_anchor * (marker.place * Vec3::new(x, 0.0, z));
            LENS.project(corner).expect("in front of the camera")
        });
        let pixels = corners.into_iter().map(|corner| Rect::from_corners(corner, corner)).reduce(|a, b| a.union(b));
        let pixels = pixels.expect("four corners").inflate(1.0);
        Self { cells, marker_from_anchor: marker.place.inverse(), cell, pixels }
    }

    /// Distance along a ray from the front, and the light there. `None` if the ray misses the print.
    fn hit(&self, eye: Vec3, ray: Vec3) -> Option<(f32, f32)> {
        let (eye, ray) = (self.marker_from_anchor * eye, self.marker_from_anchor.rotation * ray);
        if ray.y >= 0.0 || eye.y <= 0.0 {
            return None;
        }
        let at = eye - ray * (eye.y / ray.y);
        let half = 0.5 * self.cells.len() as f32;
        let (column, row) = (at.x / self.cell + half, at.z / self.cell + half);
        if column < 0.0 || row < 0.0 {
            return None;
        }
        let is_white = *self.cells.get(row as usize)?.get(column as usize)?;
        Some((-eye.y / ray.y, if is_white { 0.8 } else { 0.03 }))
    }
}

/// A frame of markers on gray ground, nine rays for each pixel.
fn photograph(markers: &[BoardMarker], anchor_from_camera: Isometry3d) -> FramePixels {
    let camera_from_anchor = anchor_from_camera.inverse();
    let prints: Vec<_> = markers.iter().map(|marker| Print::new(marker, camera_from_anchor)).collect();
    let eye = Vec3::from(anchor_from_camera.translation);
    let light = |pixel: Vec2| {
        let ray = anchor_from_camera.rotation * LENS.ray(pixel);
        let hits = prints.iter().filter(|print| print.pixels.contains(pixel)).filter_map(|print| print.hit(eye, ray));
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.3, |(_, light)| light)
    };
    let offsets = || (0..9).map(|i| Vec2::new((i % 3) as f32 + 0.5, (i / 3) as f32 + 0.5) / 3.0);
    let pixels = (0..LENS.size.y).flat_map(|y| (0..LENS.size.x).map(move |x| UVec2::new(x, y).as_vec2()));
    let rgba = pixels.flat_map(|corner| {
        let linear = offsets().map(|offset| light(corner + offset)).sum::<f32>() / 9.0;
        let gray = Srgba::from(LinearRgba::rgb(linear, linear, linear)).to_u8_array()[0];
        [gray, gray, gray, 255]
    });
    FramePixels::new(LENS.size, rgba.collect()).expect("as many bytes as the size says")
}

/// An app that tracks one board, with the real detector.
struct Tracked {
    app: App,
    camera: Entity,
    anchor: Entity,
    sequence: u64,
}

impl Tracked {
    fn new(anchor: &MarkerAnchor, board: &MarkerBoard) -> Self {
        let mut app = App::new();
        let detector = AprilTagDetector::new().expect("the AprilTag library of this crate");
        app.add_plugins((MinimalPlugins, TransformPlugin))
            .insert_resource(MarkerDetection::new(detector))
            .add_plugins(TrackingPlugin);
        let camera = app.world_mut().spawn(ArCamera::new(LENS)).id();
        let anchor = app.world_mut().spawn((anchor.clone(), board.clone())).id();
        Self { app, camera, anchor, sequence: 0 }
    }

    fn show(&mut self, pixels: FramePixels) -> bevy_mirrorball::tracking::MarkerTracking {
        // A second apart, so that nothing is smoothed.
        self.sequence += 1;
        let frame = CameraFrame::new(pixels, self.sequence, Duration::from_secs(self.sequence));
        self.app.world_mut().entity_mut(self.camera).insert(frame);
        self.app.update();
        self.app.world().get(self.anchor).cloned().expect("comes with the anchor")
    }
}

/// Renders a board with all of its markers and with each of them hidden.
fn assert_hiding_changes_nothing(name: &str, anchor: &MarkerAnchor, board: &MarkerBoard, camera: Transform) {
    let own = BoardMarker::new(anchor.marker(), anchor.size, Isometry3d::IDENTITY);
    let markers: Vec<_> = [own].into_iter().chain(board.markers.iter().copied()).collect();
    let truth = camera.to_isometry().inverse();
    let mut app = Tracked::new(anchor, board);
    let whole = app.show(photograph(&markers, camera.to_isometry()));
    assert!(whole.markers.len() >= 3, "{name}: {:?}", whole.markers);
    let pose = whole.candidates.expect("detected").best;
    PoseError::of(&pose, &truth).assert_below(&format!("{name}, all {}", whole.markers.len()), DEGREES, SHARE);
    for hidden in &whole.markers {
        let rest: Vec<_> = markers.iter().filter(|marker| marker.marker() != *hidden).copied().collect();
        let tracking = app.show(photograph(&rest, camera.to_isometry()));
        assert_eq!(tracking.state, MarkerState::Tracked);
        assert!(!tracking.markers.contains(hidden) && tracking.markers.len() + 1 == whole.markers.len());
        let candidates = tracking.candidates.expect("detected");
        assert!(!candidates.is_ambiguous(), "{name} without {hidden}");
        let what = format!("{name} without {hidden}");
        PoseError::of(&candidates.best, &truth).assert_below(&what, 2.0 * DEGREES, 2.0 * SHARE);
    }
}

fn camera(eye: Vec3, target: Vec3) -> Transform {
    Transform::from_translation(eye).looking_at(target, Vec3::Y)
}

#[test]
fn a_sheet_with_the_balls_place_may_be_covered_anywhere() {
    let anchor = MarkerAnchor::new(0, 0.1);
    let board = MarkerBoard::around_ball(&anchor, Vec2::new(0.17, 0.01), 0.05);
    let view = camera(Vec3::new(0.15, 0.32, 0.22), Vec3::new(0.09, 0.0, 0.01));
    assert_hiding_changes_nothing("sheet", &anchor, &board, view);
}

#[test]
fn a_box_may_be_covered_anywhere() {
    let anchor = MarkerAnchor::new(20, 0.06);
    let board = MarkerBoard::box_sides(&anchor, Vec3::new(0.12, 0.1, 0.1), 0.06);
    let view = camera(Vec3::new(0.2, 0.2, 0.25), Vec3::new(0.01, -0.04, 0.0));
    assert_hiding_changes_nothing("box", &anchor, &board, view);
}

#[test]
fn a_grid_may_be_covered_anywhere() {
    let anchor = MarkerAnchor::new(100, 0.05);
    let board = MarkerBoard::grid(&anchor, 3, 2, 0.07);
    let view = camera(Vec3::new(0.0, 0.35, 0.2), Vec3::new(0.06, 0.0, 0.04));
    assert_hiding_changes_nothing("grid", &anchor, &board, view);
}

#[test]
fn any_marker_of_a_board_gives_the_pose_of_its_anchor() {
    let mut desk = Desk::new();
    let place = Isometry3d::new(Vec3::new(0.2, -0.05, 0.1), Quat::from_euler(EulerRot::YXZ, 0.5, 1.2, -0.3));
    let other = BoardMarker { family: MarkerFamily::Tag25h9, ..BoardMarker::new(3, SIZE, place) };
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), MarkerBoard::new([other])));
    let mut other_seen = seen(3, first_view());
    desk.show(&[other_seen.clone()]);
    assert_eq!(desk.tracking(anchor).state, MarkerState::Searching, "number 3 of another family");
    other_seen.family = MarkerFamily::Tag25h9;
    desk.show(&[other_seen]);
    let tracking = desk.tracking(anchor);
    assert_eq!((tracking.state, &tracking.markers[..]), (MarkerState::Tracked, &[other.marker()][..]));
    let expected = first_view() * place.inverse();
    let (turn, shift) = (
        tracking.camera_from_marker.expect("a pose").rotation.angle_between(expected.rotation),
        tracking.camera_from_marker.expect("a pose").translation.distance(expected.translation),
    );
    assert!(turn < 1e-3 && shift < 1e-5, "{turn} rad, {shift} m");
}

#[test]
fn a_board_that_cannot_be_leaves_the_anchors_own_marker() {
    let mut desk = Desk::new();
    let twice = MarkerBoard::new([BoardMarker::beside(0, SIZE, 0.2, 0.0)]);
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), twice));
    desk.show(&[seen(0, second_view())]);
    desk.assert_camera_from(anchor, second_view());
}
