//! Files of other programs that were read wrongly or refused once.

use crate::shared_data;
use bevy::math::Vec3;
use bevy_mirrorball::environment_map::EquirectPixels;

#[test]
fn cropped_and_overscanned_skies_lie_where_their_display_window_is() {
    let Some(folder) = shared_data::find("faults/exr_data_window") else { return };
    let cropped = EquirectPixels::open(folder.join("e_crop_middle.exr")).expect("a sky");
    let at = |x: u32, y: u32| cropped.texels[(y * cropped.size.x + x) as usize];
    let size = cropped.size;
    assert_eq!([at(0, 0), at(size.x - 1, size.y - 1)], [Vec3::ZERO; 2], "unknown corners are black");
    assert!(at(size.x / 2, size.y / 2).min_element() > 0.0);
    let overscan = EquirectPixels::open(folder.join("e_overscan.exr")).expect("a sky");
    assert_eq!(overscan.size.x, 2 * overscan.size.y);
    assert!(overscan.texels.iter().all(|texel| texel.max_element() > 0.0));
}

#[test]
fn channels_of_layers_and_in_small_letters_are_read() {
    let Some(folder) = shared_data::find("faults/exr_channel_names") else { return };
    for name in ["e_blender.exr", "e_lower.exr"] {
        let sky = EquirectPixels::open(folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
        assert!(sky.texels.iter().any(|texel| texel.min_element() > 0.0), "{name}");
    }
}
