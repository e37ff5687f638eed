//! Buttons printed on the sheet of a marker: fields of dots that notice when something covers them.
//!
//! Frames with poses enter, [`VirtualButtonState`]s and events leave. A dot is told from what covers it by its contrast
//! with the paper around it, compared with what is usual on the sheet in the same frame: lamps, shadows, exposure and
//! blur change that of all dots alike. Nothing is learned, and no empty sheet is needed.

mod dots;
mod field_state;
mod press;
mod sense;
mod sheet_contrast;
mod virtual_button;

#[cfg(feature = "apriltag")]
pub(super) use dots::DotGrid;
pub(super) use press::press_buttons;
pub use virtual_button::{ButtonCovered, ButtonUncovered, VirtualButton, VirtualButtonState};
