//! The capture thread of a webcam, and the handle through which the game reads its frames and status.

use super::{
    decode::decode,
    devices::{DeviceInfo, DeviceOptions, find, list_devices, missing},
    exposure_bracket::ExposureBracket,
    format::DecodeError,
    source::Source,
    stream::{Captured, WebcamStatus, WebcamStream},
};
use std::{
    any::Any,
    convert::Infallible,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel},
    },
    thread,
    time::{Duration, Instant},
};

/// Longest time without a frame before a camera counts as lost. Cameras slower than one frame per second get the
/// duration of two frames instead.
const MAX_SILENCE: Duration = Duration::from_secs(2);
/// Longest time that opening may take before the camera counts as lost; slow cameras need a second.
const MAX_OPENING_TIME: Duration = Duration::from_secs(5);
/// Time between two searches for a lost camera.
const SEARCH_INTERVAL: Duration = Duration::from_secs(1);
/// Longest time without a frame before the camera is closed and opened again, which some cameras need.
const MAX_SILENCE_BEFORE_REOPENING: Duration = Duration::from_secs(10);
/// Longest wait for a frame before the thread checks whether it should stop.
const MAX_FRAME_WAIT: Duration = Duration::from_millis(100);

/// A webcam with its capture thread. Dropping it signals the thread to stop and does not wait for it.
pub(in crate::camera) struct Webcam {
    state: Arc<Mutex<State>>,
    /// Signals the thread to stop when it is dropped. Nothing is ever sent.
    _alive: Sender<Infallible>,
}

struct State {
    newest: Option<Captured>,
    /// The newest frame of each shorter exposure.
    shorter: Vec<Captured>,
    dropped: u64,
    status: WebcamStatus,
    /// The stream that is open now.
    stream: Option<WebcamStream>,
    /// When the camera last showed that it works: it was opened, or an intact frame arrived.
    last_frame_at: Instant,
    /// What was wrong with the newest frame, if no intact frame has arrived since.
    last_error: Option<DecodeError>,
}

impl Webcam {
    /// Starts the thread that searches for the camera, and returns at once.
    pub(in crate::camera) fn open(options: DeviceOptions) -> Self {
        let state = Arc::new(Mutex::new(State {
            newest: None,
            shorter: Vec::new(),
            dropped: 0,
            status: WebcamStatus::Opening,
            stream: None,
            last_frame_at: Instant::now(),
            last_error: None,
        }));
        let (alive, stop) = channel();
        let thread_state = state.clone();
        let thread = thread::Builder::new().name("mirrorball webcam".to_owned());
        if let Err(error) = thread.spawn(move || run(&thread_state, &options, &stop)) {
            lock(&state).status = WebcamStatus::Lost(format!("the system gives no thread for the camera: {error}"));
        }
        Self { state, _alive: alive }
    }

    /// Takes the newest frame of each shorter exposure that has arrived since the last call.
    pub(in crate::camera) fn take_shorter(&self) -> Vec<Captured> {
        std::mem::take(&mut lock(&self.state).shorter)
    }

    /// Takes the newest frame of the usual exposure, if one has arrived since the last call.
    pub(in crate::camera) fn take(&self) -> Option<Captured> {
        let mut state = lock(&self.state);
        let newest = state.newest.take()?;
        Some(Captured { dropped: std::mem::take(&mut state.dropped), ..newest })
    }

    /// The current status of the camera. Silence is detected here, because the thread itself may be stuck in a driver.
    pub(in crate::camera) fn status(&self) -> WebcamStatus {
        let state = lock(&self.state);
        let silence = state.last_frame_at.elapsed();
        match (&state.status, &state.stream) {
            (WebcamStatus::Opening | WebcamStatus::Playing(_), Some(stream)) if silence > max_silence(stream) => {
                WebcamStatus::Lost(silence_message(stream, max_silence(stream), state.last_error.as_ref()))
            }
            (WebcamStatus::Opening, None) if silence > MAX_OPENING_TIME => WebcamStatus::Lost(format!(
                "the camera has not answered for {} s. If this stays, unplug it and plug it in again",
                MAX_OPENING_TIME.as_secs()
            )),
            (status, _) => status.clone(),
        }
    }
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

fn max_silence(stream: &WebcamStream) -> Duration {
    let two_frames = Duration::try_from_secs_f32(2.0 / stream.frame_rate).unwrap_or(MAX_SILENCE);
    two_frames.clamp(MAX_SILENCE, MAX_SILENCE_BEFORE_REOPENING)
}

fn silence_message(stream: &WebcamStream, silence: Duration, last_error: Option<&DecodeError>) -> String {
    let (name, seconds) = (&stream.name, silence.as_secs_f32());
    match last_error {
        None => format!(
            "no picture from the camera \"{name}\" for {seconds} s. If this stays, unplug it and plug it in again, or try \
             another USB port"
        ),
        Some(last_error) => format!(
            "no good picture from the camera \"{name}\" for {seconds} s: {last_error}. Try another cable or USB port, or a \
             smaller size or frame rate"
        ),
    }
}

/// Searches for the camera and captures frames until the game drops the [`Webcam`].
fn run(state: &Mutex<State>, options: &DeviceOptions, stop: &Receiver<Infallible>) {
    let mut known = None;
    loop {
        // The camera libraries panic on unknown values; the thread has to survive that.
        let session = catch_unwind(AssertUnwindSafe(|| play(state, options, stop, &mut known)));
        match session.unwrap_or_else(|panic| Err(panic_message(panic))) {
            Ok(Stopped) => return,
            Err(reason) => {
                let mut state = lock(state);
                state.status = WebcamStatus::Lost(reason);
                state.stream = None;
            }
        }
        if stop.recv_timeout(SEARCH_INTERVAL) != Err(RecvTimeoutError::Timeout) {
            return;
        }
    }
}

/// The game has dropped the [`Webcam`].
struct Stopped;

/// Captures frames until the game stops the thread or an error occurs, which is returned as text. The camera is closed
/// on return: a camera that is still open when it is plugged in again gets another number.
fn play(
    state: &Mutex<State>,
    options: &DeviceOptions,
    stop: &Receiver<Infallible>,
    known: &mut Option<DeviceInfo>,
) -> Result<Stopped, String> {
    let devices = list_devices();
    let device = find(&devices, &options.device, known.as_ref())
        .ok_or_else(|| missing(&devices, &options.device, known.as_ref()))?;
    let mut source = Source::open(device, options)?;
    let stream = source.stream().clone();
    *known = Some(device.clone());
    let mut last_frame_at = Instant::now();
    let mut bracket = ExposureBracket::new(&stream.shorter_exposures, last_frame_at);
    {
        let mut state = lock(state);
        state.status = WebcamStatus::Opening;
        state.stream = Some(stream.clone());
        state.last_frame_at = last_frame_at;
        state.last_error = None;
    }
    loop {
        if stop.try_recv() != Err(TryRecvError::Empty) {
            return Ok(Stopped);
        }
        let Some(frame) = source.next(MAX_FRAME_WAIT)? else {
            if last_frame_at.elapsed() > MAX_SILENCE_BEFORE_REOPENING {
                return Err(silence_message(&stream, MAX_SILENCE_BEFORE_REOPENING, None));
            }
            continue;
        };
        last_frame_at = Instant::now();
        let Some(exposure) = bracket.arrived() else {
            lock(state).last_frame_at = last_frame_at;
            continue;
        };
        let result = if frame.is_marked_damaged { Err(DecodeError::Marked) } else { decode(&frame.raw) };
        let result = result.map(|pixels| Captured {
            pixels,
            at: frame.at,
            decode_time: last_frame_at.elapsed(),
            exposure,
            dropped: 0,
        });
        let is_good = result.is_ok();
        publish(&mut lock(state), result, &stream);
        if is_good && let Some(step) = bracket.next(Instant::now()) {
            source.change_exposure(step)?;
            // Frames that have arrived until now were captured before the change.
            while source.next(Duration::ZERO)?.is_some() {}
        }
    }
}

fn publish(state: &mut State, result: Result<Captured, DecodeError>, stream: &WebcamStream) {
    match result {
        Ok(captured) => {
            if captured.exposure < 1.0 {
                state.shorter.retain(|older| older.exposure != captured.exposure);
                state.shorter.push(captured);
            } else if state.newest.replace(captured).is_some() {
                state.dropped += 1;
            }
            state.last_frame_at = Instant::now();
            state.last_error = None;
            if !matches!(&state.status, WebcamStatus::Playing(playing) if playing == stream) {
                state.status = WebcamStatus::Playing(stream.clone());
            }
        }
        Err(last_error) => {
            state.dropped += 1;
            state.last_error = Some(last_error);
        }
    }
}

fn panic_message(panic: Box<dyn Any + Send>) -> String {
    let text = crate::panic_text::panic_text(&*panic);
    format!("the camera driver's library failed: {}. Another mode or camera may work", text.unwrap_or("without a word"))
}

#[cfg(test)]
mod tests {
    use super::{State, *};
    use crate::camera::{FramePixels, webcam::format::PixelFormat};
    use bevy::prelude::*;

    fn stream(frame_rate: f32) -> WebcamStream {
        WebcamStream {
            name: "Cam".to_owned(),
            size: UVec2::ONE,
            frame_rate,
            format: PixelFormat::Yuyv,
            exposure: None,
            shorter_exposures: Vec::new(),
        }
    }

    fn webcam(status: WebcamStatus, last_frame_at: Instant) -> (Webcam, Receiver<Infallible>) {
        let stream = Some(stream(30.0));
        let state =
            State { newest: None, shorter: Vec::new(), dropped: 0, status, stream, last_frame_at, last_error: None };
        let (alive, stop) = channel();
        (Webcam { state: Arc::new(Mutex::new(state)), _alive: alive }, stop)
    }

    fn pixel(value: u8, at: Instant) -> Result<Captured, DecodeError> {
        let pixels = FramePixels::new(UVec2::ONE, vec![value; 4]).ok_or(DecodeError::Empty)?;
        Ok(Captured { pixels, at, decode_time: Duration::ZERO, exposure: 1.0, dropped: 0 })
    }

    #[test]
    fn the_newest_of_each_shorter_exposure_waits_beside_the_usual_one_and_none_is_dropped() {
        let (webcam, _stop) = webcam(WebcamStatus::Opening, Instant::now());
        let now = Instant::now();
        for (value, exposure) in [(1, 0.1), (2, 1.0), (3, 0.5), (4, 0.1)] {
            let result = pixel(value, now).map(|captured| Captured { exposure, ..captured });
            publish(&mut lock(&webcam.state), result, &stream(30.0));
        }
        let shorter: Vec<u8> = webcam.take_shorter().iter().map(|captured| captured.pixels.rgba[0]).collect();
        let usual = webcam.take().expect("was published");
        assert_eq!((shorter, usual.pixels.rgba[0], usual.dropped), (vec![3, 4], 2, 0));
        assert!(webcam.take_shorter().is_empty());
    }

    #[test]
    fn the_newest_frame_wins_and_the_others_are_counted() {
        let (webcam, _stop) = webcam(WebcamStatus::Opening, Instant::now());
        let now = Instant::now();
        for result in [pixel(1, now), Err(DecodeError::Empty), pixel(2, now), pixel(3, now)] {
            publish(&mut lock(&webcam.state), result, &stream(30.0));
        }
        let captured = webcam.take().unwrap();
        assert_eq!((captured.pixels.rgba[0], captured.dropped, captured.at), (3, 3, now));
        assert!(webcam.take().is_none());
        assert_eq!(webcam.status(), WebcamStatus::Playing(stream(30.0)));
    }

    #[test]
    fn a_silent_camera_is_lost_even_if_its_thread_is_stuck_and_the_next_frame_brings_it_back() {
        let long_ago = Instant::now() - Duration::from_secs(3);
        let (webcam, _stop) = webcam(WebcamStatus::Playing(stream(30.0)), long_ago);
        assert!(matches!(webcam.status(), WebcamStatus::Lost(text) if text.contains("\"Cam\" for 2 s")));
        publish(&mut lock(&webcam.state), Err(DecodeError::Marked), &stream(30.0));
        assert!(matches!(webcam.status(), WebcamStatus::Lost(text) if text.contains("damaged")));
        publish(&mut lock(&webcam.state), pixel(0, Instant::now()), &stream(30.0));
        assert_eq!(webcam.status(), WebcamStatus::Playing(stream(30.0)));
    }

    #[test]
    fn slow_cameras_may_be_silent_for_longer_up_to_the_reopening() {
        assert_eq!(max_silence(&stream(0.5)), Duration::from_secs(4));
        for (rate, seconds) in [(30.0, 2), (0.0, 2), (0.01, 10)] {
            assert_eq!(max_silence(&stream(rate)).as_secs(), seconds, "{rate}");
        }
    }

    #[test]
    fn a_webcam_may_be_shared_between_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<Webcam>();
    }
}
