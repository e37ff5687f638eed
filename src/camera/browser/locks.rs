//! Locks of exposure and white balance.
//!
//! Properties and their values are those of the W3C's `MediaStream` Image Capture, section on extensions of tracks.

use super::{
    BrowserCameraOptions,
    bindings::{object, property},
    mean_color::has_changed,
    request::track_constraints,
};
use js_sys::{Array, Function, Object, Promise, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::MediaStreamTrack;

/// What became of one lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lock {
    /// The game asks for none.
    NotAsked,
    /// The browser reports that the camera keeps its value.
    Locked,
    /// The browser or the camera cannot do it, or has not done it.
    Missing,
}

/// Locks of a camera that runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Locks {
    exposure: Lock,
    white_balance: Lock,
}

impl Locks {
    /// What to tell the user: the locks that there are, or as an error those that were asked for and are missing.
    pub(super) fn notice(self, camera: &str) -> Option<Result<String, String>> {
        let names = |lock| {
            let of = |state, name| (state == lock).then_some(name);
            let names = [of(self.exposure, "exposure"), of(self.white_balance, "white balance")];
            Some(names.into_iter().flatten().collect::<Vec<_>>().join(" and ")).filter(|names| !names.is_empty())
        };
        if let Some(missing) = names(Lock::Missing) {
            return Some(Err(format!(
                "the browser cannot lock {missing} of the camera \"{camera}\", so measured light changes with the \
                 automatic. Keep what is bright in view as it is, or use another browser: Chrome can with most cameras"
            )));
        }
        Some(Ok(format!("the camera \"{camera}\" keeps its {} from now on", names(Lock::Locked)?)))
    }
}

/// A property with a mode, and the values that belong to it.
struct Lockable {
    mode: &'static str,
    values: &'static [&'static str],
}

const EXPOSURE: Lockable = Lockable { mode: "exposureMode", values: &["exposureTime", "iso"] };
const WHITE_BALANCE: Lockable = Lockable { mode: "whiteBalanceMode", values: &["colorTemperature"] };
/// Modes that keep a value, the better one first.
const KEEPING_MODES: [&str; 2] = ["manual", "single-shot"];
/// Time after which a picture shows what a change of modes has done to it.
const SETTLING_MS: i32 = 1000;

/// Locks what the game asks for and the camera can. `color` returns the mean color of the newest frame, `None` if the
/// stream has ended. Takes some seconds.
pub(super) async fn lock(
    track: &MediaStreamTrack,
    options: &BrowserCameraOptions,
    color: impl Fn() -> Option<[f32; 3]>,
) -> Locks {
    let mut locks = Locks { exposure: Lock::NotAsked, white_balance: Lock::NotAsked };
    let mut locker = Locker { track, options, color, kept: Vec::new() };
    if options.locks_exposure {
        locks.exposure = locker.lock(&EXPOSURE).await;
    }
    if options.locks_white_balance {
        locks.white_balance = locker.lock(&WHITE_BALANCE).await;
    }
    locks
}

struct Locker<'a, C> {
    track: &'a MediaStreamTrack,
    options: &'a BrowserCameraOptions,
    color: C,
    /// Constraints of the locks that there are. New constraints replace all earlier ones, so these are said again.
    kept: Vec<Object>,
}

impl<C: Fn() -> Option<[f32; 3]>> Locker<'_, C> {
    /// Locks one property if the camera can and keeps its picture then.
    ///
    /// In manual mode, some cameras return to a value that was set some time ago: their picture is suddenly black or
    /// blue. With the values of now they may keep it, but these are not up to date everywhere, and a color temperature
    /// may stand for a preset. So what the picture shows decides, and the automatic comes back if both have failed.
    async fn lock(&mut self, lockable: &Lockable) -> Lock {
        let modes = property(&capabilities(self.track), lockable.mode).dyn_into::<Array>().unwrap_or_default();
        let Some(mode) = KEEPING_MODES.into_iter().find(|mode| modes.includes(&(*mode).into(), 0)) else {
            return Lock::Missing;
        };
        for with_values in [false, true] {
            let Some(before) = (self.color)() else { return Lock::Missing };
            let mut set = vec![(lockable.mode, mode.into())];
            if with_values {
                set.extend(present_values(self.track, lockable));
            }
            if !self.apply(&set).await || self.mode_of(lockable).as_deref() != Some(mode) {
                continue;
            }
            sleep(SETTLING_MS).await;
            let Some(after) = (self.color)() else { return Lock::Missing };
            if !has_changed(before, after) {
                self.kept.push(object(&set));
                return Lock::Locked;
            }
            self.apply(&[(lockable.mode, "continuous".into())]).await;
            sleep(SETTLING_MS).await;
        }
        Lock::Missing
    }

    /// Applies a set of constraints beside those of the locks that there are, and returns whether the browser agrees.
    async fn apply(&self, set: &[(&str, JsValue)]) -> bool {
        let advanced: Array = self.kept.iter().cloned().chain([object(set)]).collect();
        let all = track_constraints(self.options);
        _ = Reflect::set(&all, &"advanced".into(), &advanced);
        // Older versions of Chrome take wishes of either kind and not both.
        for constraints in [all, object(&[("advanced", advanced.into())])] {
            let promise = self.track.apply_constraints_with_constraints(constraints.unchecked_ref());
            if let Ok(promise) = promise
                && JsFuture::from(promise).await.is_ok()
            {
                return true;
            }
        }
        false
    }

    fn mode_of(&self, lockable: &Lockable) -> Option<String> {
        property(&self.track.get_settings(), lockable.mode).as_string()
    }
}

fn present_values(track: &MediaStreamTrack, lockable: &Lockable) -> Vec<(&'static str, JsValue)> {
    let settings = track.get_settings();
    let values = lockable.values.iter().map(|name| (*name, property(&settings, name)));
    values.filter(|(_, value)| value.as_f64().is_some_and(|value| value > 0.0)).collect()
}

/// Capabilities of a track. Undefined in browsers that do not tell them.
fn capabilities(track: &MediaStreamTrack) -> JsValue {
    let function = property(track, "getCapabilities").dyn_into::<Function>();
    function.and_then(|function| function.call0(track)).unwrap_or(JsValue::UNDEFINED)
}

async fn sleep(milliseconds: i32) {
    let promise = Promise::new(&mut |resolve, _| {
        if let Some(window) = web_sys::window() {
            _ = window.set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, milliseconds);
        }
    });
    _ = JsFuture::from(promise).await;
}
