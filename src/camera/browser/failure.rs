//! Reasons why there is no camera, in words with a remedy, and when to ask the browser again.
//!
//! Names of errors and their causes are those of the W3C's "Media Capture and Streams", section `getUserMedia()`.

/// Why the browser gives no camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Failure {
    /// The program runs in a worker, which has no cameras.
    NoPage,
    /// The page did not come over HTTPS or from the same machine; the browser hides cameras from it.
    Insecure,
    /// The page is secure, but the browser offers it no cameras.
    NoCameraApi,
    /// The user, a rule of the browser or the system refuses; with the browser's words.
    Refused(String),
    /// There is no camera.
    Missing,
    /// The camera with the requested id is not there.
    Unfit(String),
    /// The system does not give the camera to the browser, mostly because another program has it.
    Busy(String),
    /// The stream ended: the camera with this name was unplugged, or the permission was withdrawn.
    Ended(String),
    /// Any other error, with its name and the browser's words.
    Other(String),
}

/// What the browser told about cameras at some time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Surroundings {
    /// Whether the user has permitted the camera for good, so that asking shows no dialog. `None` if the browser does
    /// not tell.
    pub(super) is_permitted: Option<bool>,
    /// The ids of the cameras; empty ones as long as no camera is permitted.
    pub(super) cameras: Vec<String>,
}

impl Failure {
    /// The failure behind an error of `getUserMedia`. `device` is the id that was asked for.
    pub(super) fn of_request(name: &str, message: &str, device: Option<&str>) -> Self {
        match name {
            "NotAllowedError" | "SecurityError" | "PermissionDeniedError" => Self::Refused(message.to_owned()),
            "NotFoundError" | "DevicesNotFoundError" => Self::Missing,
            "OverconstrainedError" | "ConstraintNotSatisfiedError" => {
                Self::Unfit(device.unwrap_or_default().to_owned())
            }
            "NotReadableError" | "TrackStartError" | "AbortError" => Self::Busy(message.to_owned()),
            _ => Self::Other(if message.is_empty() { name.to_owned() } else { format!("{name}: {message}") }),
        }
    }

    /// Whether to ask the browser again, which has told `before` when it failed and tells `now`.
    ///
    /// A browser that has no lasting permission shows its dialog each time it is asked. So it is asked by itself only
    /// where that shows none, or when a camera was plugged in.
    pub(super) fn asks_again(&self, before: &Surroundings, now: &Surroundings) -> bool {
        let is_permitted = now.is_permitted == Some(true);
        match self {
            Self::NoPage | Self::Insecure | Self::NoCameraApi => false,
            Self::Refused(_) => is_permitted && before.is_permitted != Some(true),
            Self::Missing | Self::Unfit(_) | Self::Busy(_) | Self::Ended(_) | Self::Other(_) => {
                let is_new = |camera: &&String| {
                    let count = |list: &[String]| list.iter().filter(|other| other == camera).count();
                    count(&now.cameras) > count(&before.cameras)
                };
                is_permitted && !now.cameras.is_empty() || now.cameras.iter().any(|camera| is_new(&camera))
            }
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoPage => {
                write!(f, "a web worker has no cameras. Run the game in the page, or give it frames from there")
            }
            Self::Insecure => write!(
                f,
                "the browser gives cameras to secure pages only. Open the page with https://, or from this machine as \
                 http://localhost"
            ),
            Self::NoCameraApi => write!(
                f,
                "this browser offers no cameras to the page. Use a current Chrome, Edge, Firefox or Safari, not the \
                 one inside another app"
            ),
            Self::Refused(message) => write!(
                f,
                "the camera was not permitted{}. Permit it by the camera symbol beside the address, and reload the \
                 page if nothing happens. If there is no question, look into the privacy settings of browser and \
                 system; a page in a frame needs allow=\"camera\"",
                browser_says(message)
            ),
            Self::Missing => write!(f, "the browser finds no camera. Connect one; it is found by itself"),
            Self::Unfit(device) if device.is_empty() => {
                write!(f, "no camera can do what was asked for. Ask for another size or frame rate")
            }
            Self::Unfit(device) => write!(
                f,
                "there is no camera with the id \"{device}\". Connect it, it is found by itself, or ask for none in \
                 particular"
            ),
            Self::Busy(message) => write!(
                f,
                "the browser cannot open the camera{}. Close other programs and pages that use it, or unplug it and \
                 plug it in again; reload the page if nothing happens",
                browser_says(message)
            ),
            Self::Ended(name) => write!(
                f,
                "the camera \"{name}\" is gone: unplugged, or no longer permitted. Connect or permit it, and reload \
                 the page if nothing happens"
            ),
            Self::Other(message) => {
                write!(f, "the browser gives no camera{}. Reload the page, or try another one", browser_says(message))
            }
        }
    }
}

/// The browser's own words in brackets, without their full stop; nothing if there are none.
pub(super) fn browser_says(message: &str) -> String {
    match message.trim().trim_end_matches('.') {
        "" => String::new(),
        message => format!(" ({message})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surroundings(is_permitted: Option<bool>, cameras: &[&str]) -> Surroundings {
        Surroundings { is_permitted, cameras: cameras.iter().map(|id| (*id).to_owned()).collect() }
    }

    #[test]
    fn errors_of_the_browser_become_words_with_a_remedy() {
        for (name, message, remedy) in [
            ("NotAllowedError", "Permission denied.", "not permitted (Permission denied). Permit it"),
            ("NotFoundError", "", "no camera. Connect one"),
            (
                "NotReadableError",
                "Could not start video source",
                "(Could not start video source). Close other programs",
            ),
            ("OverconstrainedError", "", "with the id \"abc\". Connect it"),
            ("QuotaExceededError", "odd", "(QuotaExceededError: odd). Reload"),
        ] {
            let text = Failure::of_request(name, message, Some("abc")).to_string();
            assert!(text.contains(remedy), "{name}: {text}");
        }
        assert!(Failure::of_request("OverconstrainedError", "", None).to_string().contains("another size"));
    }

    #[test]
    fn a_refusal_is_final_until_the_permission_changes() {
        let refused = Failure::Refused(String::new());
        let before = surroundings(Some(false), &[""]);
        assert!(!refused.asks_again(&before, &before));
        assert!(!refused.asks_again(&before, &surroundings(Some(false), &["", ""])), "a dialog nobody has asked for");
        assert!(refused.asks_again(&before, &surroundings(Some(true), &["a"])));
        let system = surroundings(Some(true), &["a"]);
        assert!(!refused.asks_again(&system, &system), "the system refuses, whatever the browser permits");
    }

    #[test]
    fn without_a_lasting_permission_only_a_new_camera_makes_it_ask_again() {
        for failure in [Failure::Missing, Failure::Busy(String::new()), Failure::Ended("Cam".to_owned())] {
            for unsure in [None, Some(false)] {
                let before = surroundings(unsure, &["a", "b"]);
                assert!(!failure.asks_again(&before, &before));
                assert!(!failure.asks_again(&before, &surroundings(unsure, &["a"])), "one was unplugged");
                assert!(failure.asks_again(&before, &surroundings(unsure, &["a", "c"])));
            }
            let blank = surroundings(None, &[""]);
            assert!(failure.asks_again(&blank, &surroundings(None, &["", ""])), "ids are blank before a permission");
            assert!(failure.asks_again(&blank, &surroundings(Some(true), &[""])));
            assert!(!failure.asks_again(&blank, &surroundings(Some(true), &[])));
        }
    }

    #[test]
    fn a_page_that_cannot_have_cameras_does_not_ask() {
        let plugged = surroundings(Some(true), &["a"]);
        for failure in [Failure::NoPage, Failure::Insecure, Failure::NoCameraApi] {
            assert!(!failure.asks_again(&Surroundings::default(), &plugged));
        }
    }
}
