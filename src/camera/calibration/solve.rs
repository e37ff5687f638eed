//! Calibration from views.

use super::{
    CalibrationError, CalibrationPoint, CalibrationView, MIN_POINTS, MIN_VIEWS,
    adjust::{ALL_UNKNOWNS, Adjustment, FIRST_UNKNOWNS},
    coverage::coverage,
    homography,
    lens_file::{IntrinsicsFields, LensFile},
    start::start,
};
use crate::camera::{Distortion, Intrinsics};
use bevy::prelude::*;
use std::path::Path;

/// Largest error of a view's homography, as a fraction of the frame's width. The strongest distortion that the model
/// can describe is below; a marker that was taken for another is above.
const MAX_HOMOGRAPHY_ERROR: f64 = 0.025;
/// Errors that count linearly, as a fraction of the frame's width: 1 pixel of 640.
const LINEAR_ERROR: f64 = 1.0 / 640.0;
/// Multiple of the median error of all points above which the median of a view, or a point, does not fit.
const MAX_VIEW_ERROR: f64 = 4.0;
const MAX_POINT_ERROR: f64 = 5.0;
/// Error in pixels that is always within reach of a detector; smaller medians count as this.
const USUAL_ERROR: f64 = 0.1;
/// Number of times that points which do not fit are left out.
const POINT_ROUNDS: usize = 2;
/// Uncertainty of the focal length, as a fraction, above which there is no result.
const MAX_UNCERTAINTY: f32 = 0.1;

/// A calibrated camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The intrinsics with the distortion.
    pub intrinsics: Intrinsics,
    /// Root mean square of the distances in pixels between where points were seen and where the calibrated camera
    /// shows them. 0.1 to 0.5 is usual.
    pub reprojection_error: f32,
    /// The same for each view, in the order of the views; `None` for those that were not used.
    pub view_errors: Vec<Option<f32>>,
    /// Fraction of the frame's area in which points were seen, 0…1.
    pub coverage: f32,
    /// Standard deviation of the focal lengths as a fraction of them, as far as the scatter of the points tells it.
    pub focal_uncertainty: f32,
}

impl Calibration {
    /// Number of views that were used.
    pub fn used_views(&self) -> usize {
        self.view_errors.iter().flatten().count()
    }

    /// Writes the file that [`Intrinsics::open`] reads, as JSON.
    ///
    /// # Errors
    /// [`CalibrationError::File`].
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), CalibrationError> {
        let file = LensFile {
            image: self.intrinsics.size.into(),
            intrinsics: IntrinsicsFields::from(self.intrinsics),
            reprojection_error: self.reprojection_error,
            coverage: self.coverage,
            views: self.used_views(),
        };
        let path = path.as_ref();
        let to_error = |source| CalibrationError::File { path: path.to_owned(), source };
        let text = serde_json::to_string_pretty(&file).map_err(|error| to_error(error.into()))?;
        std::fs::write(path, text + "\n").map_err(to_error)
    }
}

/// Calibrates a camera from views of a flat board, in frames of a size in pixels. Needs [`MIN_VIEWS`] views of
/// [`MIN_POINTS`] points or more; ten or more views are better.
///
/// # Errors
/// [`CalibrationError::TooFewViews`] and [`CalibrationError::Undetermined`].
pub fn calibrate(size: UVec2, views: &[CalibrationView]) -> Result<Calibration, CalibrationError> {
    let width = f64::from(size.x);
    let homography_of = |view: &CalibrationView| {
        let is_enough = view.points.len() >= MIN_POINTS;
        let found = homography::homography(&view.points).filter(|_| is_enough)?;
        (homography::error(&found, &view.points) < MAX_HOMOGRAPHY_ERROR * width).then_some(found)
    };
    let (mut used, homographies): (Vec<usize>, Vec<_>) =
        views.iter().enumerate().filter_map(|(i, view)| Some((i, homography_of(view)?))).unzip();
    let too_few = |usable| CalibrationError::TooFewViews { views: views.len(), usable };
    if used.len() < MIN_VIEWS {
        return Err(too_few(used.len()));
    }
    let (camera, poses) = start(size, &homographies);
    let mut state = Adjustment { camera, poses };
    let mut points: Vec<Vec<CalibrationPoint>> = used.iter().map(|i| views[*i].points.clone()).collect();
    state.adjust(&points, &FIRST_UNKNOWNS, LINEAR_ERROR * width);
    loop {
        state.adjust(&points, &ALL_UNKNOWNS, LINEAR_ERROR * width);
        let limit = MAX_VIEW_ERROR * median(errors(&state, &points).into_iter().flatten()).max(USUAL_ERROR);
        let fits: Vec<bool> = errors(&state, &points).into_iter().map(|errors| median(errors) <= limit).collect();
        if fits.iter().all(|fits| *fits) {
            break;
        }
        keep(&mut used, &fits);
        keep(&mut points, &fits);
        keep(&mut state.poses, &fits);
        if used.len() < MIN_VIEWS {
            return Err(too_few(used.len()));
        }
    }
    for _ in 0..POINT_ROUNDS {
        let errors_of_points = errors(&state, &points);
        let limit = MAX_POINT_ERROR * median(errors_of_points.iter().flatten().copied()).max(USUAL_ERROR);
        for (points, errors) in points.iter_mut().zip(errors_of_points) {
            let fits: Vec<bool> = errors.iter().map(|error| *error <= limit).collect();
            keep(points, &fits);
        }
        state.adjust(&points, &ALL_UNKNOWNS, f64::INFINITY);
    }

    let camera = state.camera;
    let focal_uncertainty = (state.focal_deviation(&points) / camera.focal.min_element()) as f32;
    let intrinsics = Intrinsics {
        distortion: Distortion::from_coefficients(camera.lens.coefficients.map(|coefficient| coefficient as f32)),
        ..Intrinsics::new(camera.focal.as_vec2(), camera.center.as_vec2(), size)
    };
    if focal_uncertainty.is_nan() || focal_uncertainty > MAX_UNCERTAINTY {
        return Err(CalibrationError::Undetermined("the focal length is uncertain by more than 10 %"));
    }
    if !intrinsics.is_valid() {
        return Err(CalibrationError::Undetermined("the adjustment found no finite numbers"));
    }
    let errors = errors(&state, &points);
    let mut view_errors = vec![None; views.len()];
    used.iter().zip(&errors).for_each(|(i, errors)| view_errors[*i] = Some(root_mean_square(errors.iter().copied())));
    Ok(Calibration {
        intrinsics,
        reprojection_error: root_mean_square(errors.iter().flatten().copied()),
        view_errors,
        coverage: coverage(size, points.iter().flatten().map(|point| point.frame)),
        focal_uncertainty,
    })
}

/// Errors of the points of each view in pixels.
fn errors(state: &Adjustment, views: &[Vec<CalibrationPoint>]) -> Vec<Vec<f64>> {
    let of_view = |(view, pose): (&Vec<CalibrationPoint>, _)| {
        view.iter().map(|point| state.camera.error(pose, point)).collect::<Vec<f64>>()
    };
    views.iter().zip(&state.poses).map(of_view).collect()
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

fn root_mean_square(errors: impl Iterator<Item = f64> + Clone) -> f32 {
    let count = errors.clone().count().max(1) as f64;
    (errors.map(|error| error * error).sum::<f64>() / count).sqrt() as f32
}

fn keep<T>(items: &mut Vec<T>, fits: &[bool]) {
    let mut fits = fits.iter();
    items.retain(|_| fits.next().copied().unwrap_or_default());
}
