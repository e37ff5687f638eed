//! Sheets to print: markers, boards, the place of the ball with a ring to stand it on, and nets of boxes.

mod ball_ring;
mod box_net;
mod button_print;
mod drawing;
mod paper_size;

pub use paper_size::PaperSize;

use super::{BoardMarker, MarkerAnchor, MarkerBoard, TrackingError, marker_cells};
use ball_ring::BallRing;
use bevy::{
    math::{Affine2, Rect, Vec2, Vec3, Vec3Swizzles},
    prelude::Isometry3d,
};
use button_print::ButtonPrint;
use drawing::{Drawing, LINE, lines};

/// Free edge of a page, which most printers leave white, in millimeters.
const EDGE: f32 = 5.0;
/// Space between parts of a sheet, in millimeters.
const GAP: f32 = 4.0;
/// Largest number of markers whose places are printed.
const MAX_LISTED: usize = 12;
/// Largest distance in meters from the plane of the sheet, and of an axis of length 1 from it, of markers in it.
const MAX_OFF_PLANE: f32 = 1e-5;

/// A page with the marker of an anchor and what belongs to it, as SVG in true size. Sizes are printed on it, and a bar
/// to check them.
///
/// ```
/// # use bevy::math::Vec2;
/// # use bevy_mirrorball::tracking::{MarkerAnchor, MarkerBoard, MarkerSheet, PaperSize, TrackingError};
/// # fn main() -> Result<(), TrackingError> {
/// // A marker with the place of a mirrored ball 10 cm in diameter beside it, and a ring to stand it on.
/// let anchor = MarkerAnchor::new(0, 0.10);
/// let sheet = MarkerSheet::new(&anchor).with_ball(Vec2::new(0.17, 0.01), 0.05);
/// let svg = sheet.on(PaperSize::A4.landscape()).to_svg()?;
///
/// // Six markers as one anchor.
/// let anchor = MarkerAnchor::new(10, 0.05);
/// let board = MarkerBoard::grid(&anchor, 2, 3, 0.07);
/// let svg = MarkerSheet::new(&anchor).with_board(&board).to_svg()?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerSheet {
    paper: PaperSize,
    anchor: MarkerAnchor,
    board: MarkerBoard,
    ball: Option<BallRing>,
    buttons: Vec<ButtonPrint>,
    box_size: Option<Vec3>,
}

impl MarkerSheet {
    /// The marker of an anchor on A4 paper.
    pub fn new(anchor: &MarkerAnchor) -> Self {
        let board = MarkerBoard::default();
        Self {
            paper: PaperSize::default(),
            anchor: anchor.clone(),
            board,
            ball: None,
            buttons: Vec::new(),
            box_size: None,
        }
    }

    /// A net to be cut out, folded and glued to a box with a marker on its top and its four sides: that of
    /// [`MarkerBoard::box_sides`] with the same parameters. It has no bottom.
    pub fn box_net(anchor: &MarkerAnchor, box_size: Vec3, size: f32) -> Self {
        let board = MarkerBoard::box_sides(anchor, box_size, size);
        Self { board, box_size: Some(box_size), ..Self::new(anchor) }
    }

    /// Adds the markers of a board, which have to be in the plane of the anchor's marker.
    pub fn with_board(self, board: &MarkerBoard) -> Self {
        Self { board: board.clone(), ..self }
    }

    /// Adds the place of a mirrored ball: its outline, the circle of a ring to stand it on, and the strip of paper to
    /// make the ring of. The ball touches the sheet at `ball` (to the right and to the bottom edge from the center of
    /// the anchor's marker) and has `radius`, in meters.
    pub fn with_ball(self, ball: Vec2, radius: f32) -> Self {
        Self { ball: Some(BallRing::new(ball, radius)), ..self }
    }

    /// Adds the dots of a [`VirtualButton`](super::VirtualButton), and a label above them, which may be empty. Its
    /// middle is at `center` (to the right and to the bottom edge from the center of the anchor's marker); lengths in
    /// meters.
    pub fn with_button(mut self, center: Vec2, size: Vec2, label: &str) -> Self {
        self.buttons.push(ButtonPrint::new(center, size, label));
        self
    }

    /// The same on other paper.
    pub fn on(self, paper: PaperSize) -> Self {
        Self { paper, ..self }
    }

    /// The page as SVG.
    ///
    /// # Errors
    /// [`TrackingError::DoesNotFit`] if the page is too small, [`TrackingError::BoxTooSmall`] if the box is;
    /// [`TrackingError::NotInPlane`] for a board that no flat
    /// sheet can have; [`TrackingError::BadSize`] for a ball, button or box without a size; as [`MarkerAnchor::check`]
    /// and [`MarkerBoard::check`]; [`TrackingError::OutOfMemory`].
    pub fn to_svg(&self) -> Result<String, TrackingError> {
        self.anchor.check()?;
        self.board.check(&self.anchor)?;
        match self.box_size {
            Some(box_size) => box_net::to_svg(self, box_size),
            None => self.flat_svg(),
        }
    }

    /// All markers, that of the anchor first.
    fn markers(&self) -> impl Iterator<Item = BoardMarker> {
        let own = BoardMarker::new(self.anchor.marker(), self.anchor.size, Isometry3d::IDENTITY);
        [own].into_iter().chain(self.board.markers.iter().copied())
    }

    fn flat_svg(&self) -> Result<String, TrackingError> {
        let mut bounds: Option<Rect> = None;
        let mut placed = Vec::new();
        for marker in self.markers() {
            let sheet_from_marker = in_plane(&marker).ok_or(TrackingError::NotInPlane(marker.marker()))?;
            let half = Vec2::splat(0.5 * print_width(&marker));
            for corner in [-half, half, half.perp(), -half.perp()] {
                let at = sheet_from_marker.transform_point2(corner);
                bounds = Some(bounds.map_or(Rect::from_corners(at, at), |bounds| bounds.union_point(at)));
            }
            placed.push((marker, sheet_from_marker));
        }
        let mut bounds = bounds.unwrap_or_default();
        let width = self.paper.width - 2.0 * EDGE;
        let mut strips = Vec::new();
        if let Some(ball) = &self.ball {
            bounds = bounds.union(ball.bounds()?);
            strips = ball.strips(width)?;
        }
        for button in &self.buttons {
            bounds = bounds.union(button.bounds()?);
        }
        let captions = self.captions(width);
        let strip_height: f32 = strips.iter().map(|strip| strip.y + GAP).sum();
        let below = GAP + strip_height + captions.len() as f32 * LINE + 3.0 * LINE;
        let strip_width = strips.iter().map(|strip| strip.x).fold(0.0, f32::max);
        let needed = Vec2::new(bounds.width().max(strip_width), bounds.height() + below);
        let start = self.start_of(needed)?;
        let middle = 0.5 * self.paper.width;
        let shift = Vec2::new(middle - bounds.center().x, start - bounds.min.y);
        let mut drawing = Drawing::new(self.paper);
        for (marker, sheet_from_marker) in placed {
            draw(&mut drawing, &marker, Affine2::from_translation(shift) * sheet_from_marker)?;
        }
        for button in &self.buttons {
            button.draw(&mut drawing, shift);
        }
        let mut y = start + bounds.height() + GAP;
        if let Some(ball) = &self.ball {
            ball.draw_place(&mut drawing, shift);
            for strip in strips {
                ball.draw_strip(&mut drawing, Vec2::new(middle - 0.5 * strip.x, y), strip);
                y += strip.y + GAP;
            }
        }
        for caption in captions {
            y += LINE;
            drawing.text(Vec2::new(middle, y), &caption);
        }
        drawing.scale_bar(Vec2::new(middle, y), width);
        Ok(drawing.into_svg())
    }

    /// Distance of what is drawn from the upper edge of the page, in millimeters, so that it is in the middle.
    fn start_of(&self, needed: Vec2) -> Result<f32, TrackingError> {
        let page = self.paper.size();
        if (needed + 2.0 * EDGE).cmple(page).all() {
            return Ok(0.5 * (page.y - needed.y));
        }
        let needed = (needed + 2.0 * EDGE).ceil();
        Err(TrackingError::DoesNotFit { needed: (needed.x, needed.y), page: (page.x, page.y) })
    }

    /// What is on the sheet, in lines of so many millimeters.
    fn captions(&self, width: f32) -> Vec<String> {
        let mut groups: Vec<(BoardMarker, u32)> = Vec::new();
        for marker in self.markers() {
            match groups.last_mut() {
                Some((first, last))
                    if (first.family, first.size) == (marker.family, marker.size) && *last + 1 == marker.id =>
                {
                    *last = marker.id;
                }
                _ => groups.push((marker, marker.id)),
            }
        }
        let describe = |(first, last): &(BoardMarker, u32)| {
            let color = if first.family.has_border_inside() { "white" } else { "black" };
            let size = millimeters(first.size);
            match first.id {
                id if id == *last => format!("{} number {id}, {color} square {size} mm.", first.family),
                id => format!("{} numbers {id} to {last}, {color} squares {size} mm.", first.family),
            }
        };
        let mut texts: Vec<String> = groups.iter().map(describe).collect();
        if self.box_size.is_none() && (1..=MAX_LISTED).contains(&self.board.markers.len()) {
            let place = |marker: &BoardMarker| {
                let center = marker.place.translation;
                format!("{} ({}, {})", marker.id, millimeters(center.x), millimeters(center.z))
            };
            let places: Vec<_> = self.board.markers.iter().map(place).collect();
            texts.push(format!(
                "Their middles in mm to the right of and below that of number {}: {}.",
                self.anchor.id,
                places.join(", ")
            ));
        }
        texts.extend(self.ball.as_ref().map(BallRing::caption));
        texts.iter().flat_map(|text| lines(text, width)).collect()
    }
}

/// Place of a marker in the plane of the sheet, from and to millimeters. `None` if it is elsewhere.
fn in_plane(marker: &BoardMarker) -> Option<Affine2> {
    let (x, z) = (marker.place.rotation * Vec3::X, marker.place.rotation * Vec3::Z);
    let center = Vec3::from(marker.place.translation);
    let is_in_plane =
        center.y.abs() < MAX_OFF_PLANE && (x.y.abs() + z.y.abs()) < MAX_OFF_PLANE && x.z * z.x <= x.x * z.z;
    is_in_plane
        .then(|| Affine2 { matrix2: bevy::math::Mat2::from_cols(x.xz(), z.xz()), translation: 1000.0 * center.xz() })
}

/// Width of the whole print of a marker, in millimeters.
fn print_width(marker: &BoardMarker) -> f32 {
    1000.0 * marker.size * marker.family.print_cells() as f32 / marker.family.square_cells() as f32
}

fn draw(drawing: &mut Drawing, marker: &BoardMarker, page_from_marker: Affine2) -> Result<(), TrackingError> {
    let cells = marker_cells(marker.marker()).ok_or(TrackingError::OutOfMemory)?;
    drawing.cells(&cells, print_width(marker) / cells.len() as f32, page_from_marker);
    Ok(())
}

/// A length in meters as millimeters to a tenth.
fn millimeters(meters: f32) -> f32 {
    (10_000.0 * meters).round() / 10.0
}
