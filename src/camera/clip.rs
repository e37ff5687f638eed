//! Recorded clips: a folder of pictures and a sidecar.

use super::{
    CameraError, FeedPace, Intrinsics,
    source::{Arrival, Decoded, Decoding, FrameSource},
};
use bevy::prelude::*;
use serde::Deserialize;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};

/// A recorded clip: a folder of JPEG or PNG pictures, numbered by their names, and a sidecar `clip.json`.
///
/// ```json
/// {
///     "image": [640, 480],
///     "fps": 15,
///     "intrinsics": {"fx": 601.8, "fy": 601.8, "cx": 320.0, "cy": 240.0},
///     "pattern": "frame_*.jpg"
/// }
/// ```
/// `image` is the size in pixels that the intrinsics belong to. `intrinsics` and `pattern` are optional; without a pattern all
/// JPEG and PNG files are taken. The `*` of a pattern stands for anything; numbers in names are ordered by value. Other fields
/// are left alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The pictures in the order they are played.
    pub files: Vec<PathBuf>,
    /// Pictures per second.
    pub frame_rate: f32,
    /// Size in pixels, as the sidecar says.
    pub size: UVec2,
    /// The camera's intrinsics, if the sidecar has them.
    pub intrinsics: Option<Intrinsics>,
}

/// Name of the sidecar in a clip's folder.
const SIDECAR: &str = "clip.json";
/// What is taken without a pattern.
const PICTURE_ENDINGS: [&str; 3] = ["jpg", "jpeg", "png"];

#[derive(Deserialize)]
struct Sidecar {
    image: [u32; 2],
    fps: f32,
    intrinsics: Option<SidecarIntrinsics>,
    pattern: Option<String>,
}

#[derive(Deserialize)]
struct SidecarIntrinsics {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
}

impl Clip {
    /// Reads a clip's sidecar and lists its pictures.
    ///
    /// # Errors
    /// [`CameraError::ClipUnreadable`], [`CameraError::ClipSidecar`], [`CameraError::ClipValue`] or [`CameraError::ClipEmpty`]
    /// name the file, the field and what to do.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, CameraError> {
        let folder = folder.as_ref();
        let unreadable = |path: &Path| {
            let path = path.to_owned();
            move |source| CameraError::ClipUnreadable { path, source }
        };
        let path = folder.join(SIDECAR);
        let text = std::fs::read_to_string(&path).map_err(unreadable(&path))?;
        let sidecar: Sidecar =
            serde_json::from_str(&text).map_err(|source| CameraError::ClipSidecar { path: path.clone(), source })?;
        let wrong =
            |field, found: String, expected| CameraError::ClipValue { path: path.clone(), field, found, expected };
        let size = UVec2::from(sidecar.image);
        if size.min_element() == 0 {
            return Err(wrong("image", format!("{:?}", sidecar.image), "width and height in pixels, above 0"));
        }
        if !(sidecar.fps.is_finite() && sidecar.fps > 0.0) {
            return Err(wrong("fps", sidecar.fps.to_string(), "a number of pictures per second above 0"));
        }
        let intrinsics = sidecar.intrinsics.map(|k| Intrinsics {
            focal: Vec2::new(k.fx, k.fy),
            center: Vec2::new(k.cx, k.cy),
            size,
        });
        if let Some(k) = intrinsics.filter(|k| !k.is_valid()) {
            let found = format!("fx {}, fy {}, cx {}, cy {}", k.focal.x, k.focal.y, k.center.x, k.center.y);
            return Err(wrong("intrinsics", found, "in pixels, with focal lengths above 0"));
        }
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .map_err(unreadable(folder))?
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|name| sidecar.pattern.as_deref().map_or_else(|| is_picture(name), |pattern| fits(pattern, name)))
            .collect();
        names.sort_by_cached_key(|name| natural_order(name));
        if names.is_empty() {
            let pattern = sidecar.pattern.unwrap_or_else(|| "*.jpg or *.png".to_owned());
            return Err(CameraError::ClipEmpty { folder: folder.to_owned(), pattern });
        }
        let files = names.into_iter().map(|name| folder.join(name)).collect();
        Ok(Self { files, frame_rate: sidecar.fps, size, intrinsics })
    }

    /// The picture of a step and when it is due, the clip being repeated for ever.
    fn step(&self, step: u64) -> (&Path, Duration) {
        let file = &self.files[(step % self.files.len() as u64) as usize];
        (file, Duration::from_secs_f64(step as f64 / f64::from(self.frame_rate)))
    }
}

fn is_picture(name: &str) -> bool {
    let ending = Path::new(name).extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    PICTURE_ENDINGS.iter().any(|known| known.eq_ignore_ascii_case(ending))
}

/// Whether a name fits a pattern with any number of `*`.
fn fits(pattern: &str, name: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else {
        return pattern == name;
    };
    name.strip_prefix(start)
        .is_some_and(|name| name.char_indices().map(|(i, _)| &name[i..]).chain([""]).any(|tail| fits(rest, tail)))
}

/// A key by which `frame_9` comes before `frame_10`: letters as they are, runs of digits by value.
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

/// Plays a clip.
pub(super) struct ClipSource {
    clip: Clip,
    pace: FeedPace,
    /// When step 0 was due.
    started: Option<Duration>,
    next_step: u64,
    decoding: Option<StepDecoding>,
}

struct StepDecoding {
    decoding: Decoding,
    captured: Duration,
    skipped: u64,
}

impl ClipSource {
    pub(super) fn open(folder: &Path, pace: FeedPace) -> Result<Self, CameraError> {
        Ok(Self { clip: Clip::open(folder)?, pace, started: None, next_step: 0, decoding: None })
    }

    fn arrival(&self, decoded: Decoded, captured: Duration) -> Arrival {
        match decoded.into_picture(captured, self.clip.intrinsics) {
            Ok(picture) => Arrival { picture: Some(picture), ..default() },
            // The next picture may be good.
            Err(error) => Arrival::lost(&error),
        }
    }
}

impl FrameSource for ClipSource {
    fn poll(&mut self, now: Duration) -> Arrival {
        if self.pace == FeedPace::Lockstep {
            let (file, due) = self.clip.step(self.next_step);
            self.next_step += 1;
            return self.arrival(Decoded::from_file(file), due);
        }
        let mut arrival = Arrival::default();
        if let Some(step) = &mut self.decoding {
            let (captured, skipped) = (step.captured, step.skipped);
            let Some(decoded) = step.decoding.finish() else {
                return arrival;
            };
            self.decoding = None;
            arrival = self.arrival(decoded, captured);
            arrival.dropped += skipped;
        }
        let started = *self.started.get_or_insert(now);
        let newest_step = (now.saturating_sub(started).as_secs_f64() * f64::from(self.clip.frame_rate)) as u64;
        if newest_step >= self.next_step {
            let (file, due) = self.clip.step(newest_step);
            self.decoding = Some(StepDecoding {
                decoding: Decoding::start(file.to_owned()),
                captured: started + due,
                skipped: newest_step - self.next_step,
            });
            self.next_step = newest_step + 1;
        }
        arrival
    }
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
    }
}
