//! The text of a caught panic.

use std::any::Any;

/// Returns the message that a caught panic was raised with, or `None` if it was no text.
pub(crate) fn panic_text(panic: &(dyn Any + Send)) -> Option<&str> {
    panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied())
}
