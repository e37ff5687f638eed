//! Live frames from the camera of a browser.
//!
//! **Enters:** [`BrowserCameraOptions`]: the camera and the requested settings. **Leaves:** the newest frame as 8-bit
//! sRGB pixels, with its age and the number of frames that were dropped before it, and a `BrowserStatus`.
//!
//! # How it works
//! A `BrowserCamera` asks the browser for a camera (`getUserMedia`), which asks the user. The stream plays in a video
//! element that is in no page. The browser calls back for each frame that it presents (`requestVideoFrameCallback`),
//! and the frame is read then: the browser converts it by itself (`VideoFrame.copyTo`), or it is drawn on a canvas and
//! read from there. Browsers that do not call back have their video looked at in each update instead. The game takes
//! the newest frame; frames that it has not taken by then are counted and dropped, and so are those that the browser
//! has skipped while the page was busy.
//!
//! Objects of the browser belong to the thread of the page. They stay in a table of that thread, and the handle is a
//! number, which may be sent anywhere. Everything happens in updates of the game, in the browser's callbacks, and in
//! tasks that wait for the browser; there are no threads. Dropping a `BrowserCamera` stops the stream, so that
//! the light of the camera goes off, also while the user is still being asked.
//!
//! # States
//! An insecure page, a refused permission, a camera that is missing, busy, unplugged, muted by the system or silent are
//! states with a text that says what to do (`failure`). Asking again may show the user a dialog again. So a lost camera
//! is looked for every second, and the browser is asked for it only if the user has permitted the camera for good, or
//! if a camera was plugged in since. After a refusal it is asked when the permission changes to granted, or when the
//! game inserts a new feed.
//!
//! # Exposure and white balance
//! One second after the first frame, both are locked at the values that they have then (`locks`), where browser and
//! camera can do it: Chrome for most cameras; Safari for the white balance only (pull request 17814 of `WebKit`). In
//! manual mode, Chrome on Android does not keep the gain (its `VideoCaptureCamera2`); on Linux the camera may return
//! to a value that another program has set. So the mean color of the frames is compared before and after, and the
//! automatic comes back if it has changed. A warning tells what is not locked. There is no exposure bracketing.
//!
//! # Colors and times
//! The browser converts to sRGB. Alpha is 255. Frames of the camera on the screen's side are not mirrored. The time of
//! capture is that of the browser where it tells one (`captureTime`), else that of the presentation.
//!
//! # Cost
//! All of it runs in the thread of the page. In Chromium on one core without a graphics processor, a 640 × 480 frame
//! takes 0.5 ms to copy and 1.8 ms to draw and read.
//!
//! # Limits
//! Browsers that disguise themselves (Firefox with `resistFingerprinting`, Brave) may add noise to canvases that are
//! read, or leave them empty. Chromium shows JPEGs of its fake camera with the levels 16 to 235 stretched to 0 to 255,
//! though JPEG has no such limits: dark things become darker and bright ones clip. Whether it does so with webcams that
//! send JPEGs is unknown. A camera that is unplugged is followed by whatever camera the browser gives next, unless
//! there is a `device_id`. Focus and stabilization are the browser's business. Tested in Chromium with its fake camera
//! (`scripts/test_browser_camera.sh`); no real camera, phone, Safari or Firefox has been tried.

#[cfg(target_arch = "wasm32")]
mod bindings;
#[cfg(target_arch = "wasm32")]
mod camera;
mod failure;
#[cfg(target_arch = "wasm32")]
mod locks;
mod mean_color;
mod newest_frame;
mod options;
#[cfg(target_arch = "wasm32")]
mod read_pixels;
#[cfg(target_arch = "wasm32")]
mod request;
#[cfg(target_arch = "wasm32")]
mod session;
mod silence_clock;
#[cfg(target_arch = "wasm32")]
mod stream;

#[cfg(target_arch = "wasm32")]
pub(crate) use camera::{BrowserCamera, BrowserStatus};
pub use options::{BrowserCameraOptions, CameraFacing};
