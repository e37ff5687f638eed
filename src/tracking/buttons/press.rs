//! Reads the buttons of all sheets in new frames.

use super::{
    ButtonCovered, ButtonUncovered, VirtualButton, VirtualButtonState,
    dots::DotGrid,
    field_state::Change,
    sense::{FieldReading, read_field},
    sheet_contrast::SheetContrast,
    virtual_button::ButtonHistory,
};
use crate::{
    camera::{ArCamera, CameraFrame, PosedFrame},
    luminance::luminance,
    tracking::{MarkerTracking, placement::Placement},
};
use bevy::prelude::*;
use std::time::Duration;

type ButtonItem = (&'static VirtualButton, &'static mut VirtualButtonState, &'static mut ButtonHistory);

/// Finds out which buttons are covered, once for each new frame of the camera that tracks the marker of their sheet.
pub(in crate::tracking) fn press_buttons(
    mut commands: Commands,
    sheets: Query<(Entity, &MarkerTracking)>,
    cameras: Query<(&ArCamera, &CameraFrame)>,
    children: Query<&Children>,
    mut buttons: Query<ButtonItem>,
    placement: Placement,
) {
    if buttons.is_empty() {
        return;
    }
    for (sheet, tracking) in sheets.iter().filter(|(_, tracking)| tracking.state.is_found()) {
        let Some((entity, (camera, frame))) = tracking.camera.and_then(|of| Some((of, cameras.get(of).ok()?))) else {
            continue;
        };
        let Some(world_from_camera) = placement.world_from(entity) else { continue };
        let posed = PosedFrame {
            frame: &frame.pixels,
            intrinsics: camera.intrinsics_for(frame),
            camera_from_world: world_from_camera.inverse().into(),
            exposure: 1.0,
        };
        let of_sheet: Vec<_> = children.iter_descendants(sheet).filter(|child| buttons.contains(*child)).collect();
        let readings: Vec<_> = of_sheet
            .into_iter()
            .filter_map(|button| {
                let (field, _, mut history) = buttons.get_mut(button).ok()?;
                let this = (entity, frame.sequence);
                if history.frame.replace(this) == Some(this) || !field.size.cmpgt(Vec2::ZERO).all() {
                    return None;
                }
                Some((button, read(field, placement.world_from(button)?, &posed)?))
            })
            .collect();
        let Some(contrast) = SheetContrast::of(readings.iter().map(|(_, reading)| reading)) else { continue };
        for (button, reading) in &readings {
            let Ok((_, mut state, mut history)) = buttons.get_mut(*button) else { continue };
            let change = history.field.update(contrast.coverage(reading), frame.captured.as_secs_f64());
            let at = change.map(|change| Duration::from_secs_f64(change.at_seconds.max(0.0)));
            state.set_if_neq(VirtualButtonState {
                is_covered: history.field.is_covered(),
                coverage: history.field.coverage().unwrap_or_default(),
                changed_at: at.or(state.changed_at),
            });
            match change.zip(at) {
                Some((Change { is_covered: true, .. }, at)) => commands.trigger(ButtonCovered { entity: *button, at }),
                Some((_, at)) => commands.trigger(ButtonUncovered { entity: *button, at }),
                None => {}
            }
        }
    }
}

/// Light on the dots of a button in a frame. `None` if it is not wholly in the frame or too small there.
fn read(button: &VirtualButton, world_from_button: Isometry3d, posed: &PosedFrame) -> Option<FieldReading> {
    let project = |at: Vec2| posed.project(world_from_button.transform_point(Vec3::new(at.x, 0.0, at.y)).into());
    let light = |pixel| posed.bilinear(pixel).into_iter().map(|(weight, value)| weight * luminance(value)).sum();
    read_field(&DotGrid::new(button.size), project, light, posed.frame.size.as_vec2())
}
