//! Background tasks that the next frames wait for.

use bevy::tasks::{IoTaskPool, Task, TaskPool};

/// Starts work of a few milliseconds that a frame waits for, as decoding and marker detection.
///
/// It does not queue behind the recovery of light, which takes a tenth of a second of Bevy's pool for long
/// computations. On a machine with few cores that pool has a single thread, and so the camera would stand still
/// meanwhile. The pool for input and output has threads of its own.
pub(crate) fn spawn_for_frame<T: Send + 'static>(work: impl Future<Output = T> + Send + 'static) -> Task<T> {
    IoTaskPool::get_or_init(TaskPool::default).spawn(work)
}
