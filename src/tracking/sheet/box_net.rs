//! Net of a box with markers on its top and sides.

use super::{
    GAP, MarkerSheet, draw,
    drawing::{Drawing, LINE, Line, lines},
    millimeters, print_width,
};
use crate::tracking::TrackingError;
use bevy::math::{Affine2, Vec2, Vec3};
use std::f32::consts::FRAC_PI_2;

/// Width of the flaps for glue, in millimeters.
const FLAP: f32 = 8.0;

/// Draws the top in the middle and the sides around it.
pub(super) fn to_svg(sheet: &MarkerSheet, box_size: Vec3) -> Result<String, TrackingError> {
    if !(box_size.is_finite() && box_size.min_element() > 0.0) {
        return Err(TrackingError::BadSize(box_size.min_element()));
    }
    let Vec3 { x: width, y: height, z: depth } = 1000.0 * box_size;
    let net = Vec2::new(width + 2.0 * height, depth + 2.0 * height);
    for (i, marker) in sheet.markers().enumerate() {
        let face = match i {
            0 => width.min(depth),
            1 | 3 => width.min(height),
            _ => depth.min(height),
        };
        let print = print_width(&marker);
        if print > face {
            return Err(TrackingError::BoxTooSmall { marker: marker.marker(), print, side: face });
        }
    }
    let mut captions = sheet.captions(net.x.max(100.0));
    let text = format!(
        "Box {} mm wide, {} mm high, {} mm deep. Cut along the lines, fold along the dashed ones, glue the flaps inside.",
        millimeters(box_size.x),
        millimeters(box_size.y),
        millimeters(box_size.z)
    );
    captions.extend(lines(&text, net.x.max(100.0)));
    let below = GAP + (captions.len() + 3) as f32 * LINE;
    let start = sheet.start_of(Vec2::new(net.x, net.y + below))?;
    let top = Vec2::new(0.5 * sheet.paper.width, start + 0.5 * net.y);
    let mut drawing = Drawing::new(sheet.paper);
    draw_lines(&mut drawing, top, 0.5 * Vec2::new(width, depth), height);
    // Center of each face, and by how many quarters it is turned against the top: its upper edge is at the fold.
    let (beside, beyond) = (0.5 * (width + height), 0.5 * (depth + height));
    let faces = [
        (Vec2::ZERO, 0.0),
        (Vec2::new(0.0, beyond), 0.0),
        (Vec2::new(beside, 0.0), -1.0),
        (Vec2::new(0.0, -beyond), 2.0),
        (Vec2::new(-beside, 0.0), 1.0),
    ];
    for (marker, (center, quarters)) in sheet.markers().zip(faces) {
        draw(&mut drawing, &marker, Affine2::from_angle_translation(quarters * FRAC_PI_2, top + center))?;
    }
    let mut at = Vec2::new(top.x, start + net.y + GAP);
    for caption in captions {
        at.y += LINE;
        drawing.text(at, &caption);
    }
    drawing.scale_bar(at, sheet.paper.width);
    Ok(drawing.into_svg())
}

/// Outline with flaps at the sides above and below the top, and the folds. `half` is half of the top's size.
fn draw_lines(drawing: &mut Drawing, top: Vec2, half: Vec2, height: f32) {
    let flap = FLAP.min(0.5 * height);
    // A quarter of the outline: from the lower right corner of the top along the lower side's flap to the middle.
    let quarter = [
        Vec2::new(half.x + height, 0.0),
        Vec2::new(half.x + height, half.y),
        half,
        Vec2::new(half.x + flap, half.y + flap),
        Vec2::new(half.x + flap, half.y + height - flap),
        Vec2::new(half.x, half.y + height),
        Vec2::new(0.0, half.y + height),
    ];
    for mirror in [Vec2::ONE, Vec2::new(-1.0, 1.0), Vec2::new(1.0, -1.0), Vec2::NEG_ONE] {
        drawing.line(Line::Cut, &quarter.map(|point| top + mirror * point), false);
        let folds = [half, Vec2::new(half.x, half.y + height)].map(|point| top + mirror * point);
        drawing.line(Line::Fold, &folds, false);
    }
    let corners = [half, Vec2::new(-half.x, half.y), -half, Vec2::new(half.x, -half.y)];
    drawing.line(Line::Fold, &corners.map(|corner| top + corner), true);
}
