//! What games see of webcams without a camera. Taking pictures from real drivers is tested beside the code, in a virtual
//! machine: `scripts/test_webcam.sh`.
#![cfg(feature = "webcam")]

use bevy_mirrorball::camera::list_devices;

#[test]
fn cameras_are_listed_by_rising_numbers_wherever_this_runs() {
    let devices = list_devices();
    assert!(devices.is_sorted_by(|a, b| a.index < b.index), "{devices:?}");
    assert_eq!(list_devices(), devices);
}
