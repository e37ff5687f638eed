//! Recorded clips: a folder of images and a sidecar file.

use super::{CameraError, Intrinsics, bracketing::is_exposure, calibration::IntrinsicsFields};
use bevy::prelude::*;
use serde::Deserialize;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};

/// A recorded clip: a folder of JPEG or PNG images, numbered by their names, and a sidecar `clip.json`.
///
/// ```json
/// {
///     "image": [640, 480],
///     "fps": 15,
///     "intrinsics": {"fx": 601.8, "fy": 601.8, "cx": 320.0, "cy": 240.0},
///     "files": ["frame_000.jpg", "frame_001.jpg"],
///     "exposures": [1, 1, 1, 0.125]
/// }
/// ```
/// `image` is the size in pixels that the intrinsics belong to, `fps` the number of frames per second, 0.001 to 1000.
/// `files` lists the images in the order in which they are played; [assets](super::ClipAsset) need it, because a
/// browser cannot list a folder. The other fields are optional. `intrinsics` may have the distortion of the lens,
/// `k1`, `k2`, `p1`, `p2` and `k3`, 0 where they are missing; then the frames are undistorted. Without `files`, the
/// clip consists of all JPEG and PNG files in the folder, sorted by their names with numbers by value, or of those
/// that fit a `pattern` such as `"frame_*.jpg"`, in which a `*` matches any text. `exposures` lists the exposure of
/// each frame relative to the normal ones, above 0 and at most 1; a list that is shorter than the clip is repeated.
/// Without it, every exposure is 1. Frames below 1 are not shown, see [`BracketedFrames`](super::BracketedFrames).
/// `times` lists the time of capture of each frame in seconds, from 0 and ascending; without it, frames are `1 / fps`
/// apart. `tracking` is written by a [`FrameRecorder`](crate::tracking::FrameRecorder). Unknown fields are ignored.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Image files in the order in which they are played.
    pub files: Vec<PathBuf>,
    /// Frames per second.
    pub frame_rate: f32,
    /// Width and height in pixels, from the sidecar.
    pub size: UVec2,
    /// Intrinsics of the camera, if the sidecar has them.
    pub intrinsics: Option<Intrinsics>,
    /// Exposure of each file relative to the normal frames, which have 1.
    pub exposures: Vec<f32>,
    /// Time of capture of each file after the first, in seconds. Empty if they are `1 / frame_rate` apart.
    pub times: Vec<f64>,
    /// How markers were tracked in a recording, for [`tracking`](crate::tracking) to read.
    pub(super) tracking: Option<serde_json::Value>,
}

/// What the sidecar of a recording says of tracking; on the entity of the camera that plays it.
#[derive(Component, Clone, Debug)]
pub(crate) struct SidecarTracking(pub(crate) serde_json::Value);

/// Name of the sidecar in the folder of a clip.
const SIDECAR: &str = "clip.json";
/// Extensions of the files that form a clip without a pattern.
const IMAGE_EXTENSIONS: [&str; 3] = ["jpg", "jpeg", "png"];

#[derive(Deserialize)]
struct Sidecar {
    image: [u32; 2],
    fps: f32,
    intrinsics: Option<IntrinsicsFields>,
    files: Option<Vec<String>>,
    pattern: Option<String>,
    exposures: Option<Vec<f32>>,
    times: Option<Vec<f64>>,
    tracking: Option<serde_json::Value>,
}

impl Clip {
    /// Reads the sidecar of a clip and lists its files.
    ///
    /// # Errors
    /// [`CameraError::ClipUnreadable`], [`CameraError::ClipSidecar`], [`CameraError::ClipValue`] or
    /// [`CameraError::ClipEmpty`] name the file, the field and the remedy.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, CameraError> {
        let folder = folder.as_ref();
        let unreadable = |path: &Path| {
            let path = path.to_owned();
            move |source| CameraError::ClipUnreadable { path, source }
        };
        let path = folder.join(SIDECAR);
        let text = std::fs::read_to_string(&path).map_err(unreadable(&path))?;
        let sidecar = Sidecar::parse(&text, &path)?;
        let names = match &sidecar.files {
            Some(files) => files.clone(),
            None => {
                let mut names: Vec<String> = std::fs::read_dir(folder)
                    .map_err(unreadable(folder))?
                    .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
                    .filter(|name| {
                        sidecar.pattern.as_deref().map_or_else(|| is_image(name), |wanted| fits(wanted, name))
                    })
                    .collect();
                names.sort_by_cached_key(|name| natural_order(name));
                names
            }
        };
        Self::new(sidecar, names, &path)
    }

    /// Reads the text of a sidecar that lists its files.
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, CameraError> {
        let sidecar = Sidecar::parse(text, path)?;
        let Some(names) = sidecar.files.clone() else {
            let (path, found) = (path.to_owned(), "nothing".to_owned());
            let expected = "a list of the clip's images in the order in which they are played, for clips as assets";
            return Err(CameraError::ClipValue { path, field: "files", found, expected });
        };
        Self::new(sidecar, names, path)
    }

    fn new(sidecar: Sidecar, names: Vec<String>, path: &Path) -> Result<Self, CameraError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let wrong =
            |field, found: String, expected| CameraError::ClipValue { path: path.to_owned(), field, found, expected };
        let size = UVec2::from(sidecar.image);
        if size.min_element() == 0 {
            return Err(wrong("image", format!("{:?}", sidecar.image), "width and height in pixels, above 0"));
        }
        if !(0.001..=1000.0).contains(&sidecar.fps) {
            return Err(wrong(
                "fps",
                sidecar.fps.to_string(),
                "a number of frames per second above 0, from 0.001 to 1000",
            ));
        }
        let intrinsics = sidecar.intrinsics.map(|fields| fields.for_size(size));
        if let Some(k) = intrinsics.filter(|k| !k.is_valid()) {
            let found = format!("fx {}, fy {}, cx {}, cy {}", k.focal.x, k.focal.y, k.center.x, k.center.y);
            return Err(wrong("intrinsics", found, "in pixels, with focal lengths above 0"));
        }
        if names.is_empty() {
            let pattern = sidecar.pattern.unwrap_or_else(|| "*.jpg or *.png".to_owned());
            return Err(CameraError::ClipEmpty { folder: folder.to_owned(), pattern });
        }
        let files: Vec<PathBuf> = names.into_iter().map(|name| folder.join(name)).collect();
        let listed = sidecar.exposures.unwrap_or_else(|| vec![1.0]);
        let exposures: Vec<f32> = listed.iter().copied().cycle().take(files.len()).collect();
        if !listed.iter().copied().all(is_exposure) || !exposures.contains(&1.0) {
            let expected =
                "a list of numbers above 0 and at most 1, with 1 for the frames that are shown, at least one of them";
            return Err(wrong("exposures", format!("{listed:?}"), expected));
        }
        let times = sidecar.times.unwrap_or_default();
        let are_times = times.is_sorted_by(|a, b| a < b) && times.iter().all(|time| (0.0..1e6).contains(time));
        if !are_times || !(times.is_empty() || times.len() == files.len()) {
            let expected = "a list of as many ascending times in seconds, from 0, as the clip has frames";
            return Err(wrong("times", format!("a list of {}", times.len()), expected));
        }
        Ok(Self { files, frame_rate: sidecar.fps, size, intrinsics, exposures, times, tracking: sidecar.tracking })
    }

    /// File of a step and the time at which it is due. The clip repeats forever.
    pub(super) fn step(&self, step: u64) -> (&Path, Duration) {
        let seconds = match self.times.get(self.index(step)) {
            Some(time) => (step / self.files.len() as u64) as f64 * self.period() + time,
            None => step as f64 / f64::from(self.frame_rate),
        };
        (&self.files[self.index(step)], Duration::from_secs_f64(seconds))
    }

    /// Newest step that is due at a time.
    pub(super) fn step_at(&self, time: Duration) -> u64 {
        let seconds = time.as_secs_f64();
        if self.times.is_empty() {
            return (seconds * f64::from(self.frame_rate)) as u64;
        }
        let repeated = (seconds / self.period()) as u64;
        let rest = seconds - repeated as f64 * self.period();
        let due = self.times.partition_point(|time| *time <= rest) as u64;
        (repeated * self.times.len() as u64 + due).saturating_sub(1)
    }

    /// Seconds from one repetition of a clip with times to the next: the last frame is shown as long as one is in the
    /// mean.
    fn period(&self) -> f64 {
        match self.times.last() {
            Some(last) if *last > 0.0 => last * self.times.len() as f64 / (self.times.len() - 1) as f64,
            _ => 1.0 / f64::from(self.frame_rate),
        }
    }

    /// Exposure of a step.
    pub(super) fn exposure(&self, step: u64) -> f32 {
        self.exposures[self.index(step)]
    }

    pub(super) fn index(&self, step: u64) -> usize {
        (step % self.files.len() as u64) as usize
    }
}

impl Sidecar {
    fn parse(text: &str, path: &Path) -> Result<Self, CameraError> {
        let sidecar: Self =
            serde_json::from_str(text).map_err(|source| CameraError::ClipSidecar { path: path.to_owned(), source })?;
        match sidecar.files.iter().flatten().find(|name| !is_plain(name)) {
            None => Ok(sidecar),
            Some(name) => {
                let (path, found) = (path.to_owned(), format!("{name:?}"));
                let expected = "names of files beside the sidecar, without folders";
                Err(CameraError::ClipValue { path, field: "files", found, expected })
            }
        }
    }
}

/// Whether a name is that of a file beside the sidecar.
fn is_plain(name: &str) -> bool {
    !name.contains(['/', '\\', ':']) && !["", ".", ".."].contains(&name)
}

fn is_image(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    IMAGE_EXTENSIONS.iter().any(|known| known.eq_ignore_ascii_case(extension))
}

/// Returns whether a name matches a pattern with any number of `*`, in time proportional to their lengths.
fn fits(pattern: &str, name: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else {
        return pattern == name;
    };
    let (between, end) = rest.rsplit_once('*').unwrap_or(("", rest));
    let Some(name) = name.strip_prefix(start).and_then(|name| name.strip_suffix(end)) else {
        return false;
    };
    // The first place of each part leaves the most for the others.
    let mut left = Some(name);
    for part in between.split('*') {
        left = left.and_then(|left| left.find(part).map(|at| &left[at + part.len()..]));
    }
    left.is_some()
}

/// Sort key that puts `frame_9` before `frame_10`: letters compare as they are, runs of digits by value.
fn natural_order(name: &str) -> Vec<(u64, char)> {
    let mut key: Vec<(u64, char)> = Vec::new();
    let mut in_number = false;
    for character in name.chars() {
        match (character.to_digit(10), key.last_mut()) {
            (Some(digit), Some((value, _))) if in_number => {
                *value = value.saturating_mul(10).saturating_add(digit.into());
            }
            (Some(digit), _) => key.push((digit.into(), '0')),
            (None, _) => key.push((0, character)),
        }
        in_number = character.is_ascii_digit();
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_are_ordered_by_value() {
        let mut names = vec!["f10.png", "f9.png", "f010b.png", "f1.png", "a2.png"];
        names.sort_by_cached_key(|name| natural_order(name));
        assert_eq!(names, ["a2.png", "f1.png", "f9.png", "f10.png", "f010b.png"]);
    }

    #[test]
    fn stars_stand_for_anything() {
        assert!(fits("frame_*.jpg", "frame_003.jpg"));
        assert!(fits("*", ""));
        assert!(fits("*_left_*.png", "a_left_1.png"));
        assert!(!fits("frame_*.jpg", "frame_003.jpg.bak"));
        assert!(!fits("frame.jpg", "frame1.jpg"));
        assert!(fits("ä*", "äöü"));
        assert!(!fits("ab*ba", "aba"), "parts do not overlap");
        let many = "*a".repeat(40);
        assert!(fits(&many, &"a".repeat(40)) && !fits(&many, &"ab".repeat(39)), "without trying all ways");
    }
}
