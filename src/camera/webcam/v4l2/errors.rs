//! Error messages for V4L2 cameras.

use crate::camera::webcam::devices::DeviceInfo;
use std::io;

pub(super) fn title(info: &DeviceInfo) -> String {
    format!("the camera \"{}\" (/dev/video{})", info.name, info.index)
}

/// Returns a message that says what happened to the camera and what to do.
pub(super) fn describe(info: &DeviceInfo, what: &str, error: &io::Error) -> String {
    const NO_DEVICE: i32 = libc::ENODEV;
    const NO_SPACE: i32 = libc::ENOSPC;
    let title = title(info);
    match error.kind() {
        io::ErrorKind::ResourceBusy => {
            format!("{title} is in use. Close the other program; `fuser -v /dev/video{}` shows it", info.index)
        }
        io::ErrorKind::PermissionDenied => format!(
            "{title} may not be opened by this user. Add the user to the group `video` (`sudo usermod -aG video $USER`) and \
             log in again"
        ),
        io::ErrorKind::NotFound => format!("{title} is gone. Plug it in again; it is found by itself"),
        _ => match error.raw_os_error() {
            Some(NO_DEVICE) => format!("{title} is unplugged. Plug it in again; it is found by itself"),
            Some(NO_SPACE) => {
                format!("{title} does not get enough of the USB bus. Use another port, or a smaller size or frame rate")
            }
            _ => format!("{title} {what}: {error}. It is opened again by itself; if this stays, plug it in again"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_camera_and_a_remedy() {
        let info = DeviceInfo { index: 3, name: "Cam".to_owned() };
        for (error, remedy) in
            [(libc::EBUSY, "fuser -v /dev/video3"), (libc::EACCES, "group `video`"), (libc::ENODEV, "unplugged")]
        {
            let text = describe(&info, "cannot be opened", &io::Error::from_raw_os_error(error));
            assert!(text.contains("\"Cam\"") && text.contains(remedy), "{text}");
        }
    }
}
