//! SVG of a page, in millimeters from its top-left corner.

use super::PaperSize;
use bevy::math::{Affine2, Vec2};
use std::fmt::Write;

/// Height of captions.
pub(super) const FONT: f32 = 3.5;
/// Distance from one line of captions to the next.
pub(super) const LINE: f32 = 5.0;
/// Width of an average letter, as a fraction of the font's height, rounded up.
const LETTER_WIDTH: f32 = 0.52;
/// By so much cells are larger than they should be, so that viewers draw no light gaps between neighbors.
const OVERLAP: f32 = 0.01;

/// How a line is drawn.
#[derive(Clone, Copy)]
pub(super) enum Line {
    /// To cut along.
    Cut,
    /// To fold along, or to put something on.
    Fold,
}

pub(super) struct Drawing {
    paper: PaperSize,
    body: String,
}

impl Drawing {
    pub(super) fn new(paper: PaperSize) -> Self {
        Self { paper, body: String::new() }
    }

    /// Draws the black cells of a marker. `page_from_marker` takes millimeters from the marker's center (x to the
    /// right, y to the bottom edge) to the page.
    pub(super) fn cells(&mut self, cells: &[Vec<bool>], cell: f32, page_from_marker: Affine2) {
        let half = 0.5 * cells.len() as f32;
        self.body += "<path d=\"";
        for (row, cells) in cells.iter().enumerate() {
            for (column, _) in cells.iter().enumerate().filter(|(_, is_white)| !**is_white) {
                let low = (Vec2::new(column as f32, row as f32) - half) * cell;
                let high = low + cell + OVERLAP;
                let corners = [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
                for (i, corner) in corners.into_iter().enumerate() {
                    let at = page_from_marker.transform_point2(corner);
                    let _ = write!(self.body, "{}{:.3} {:.3}", if i == 0 { 'M' } else { 'L' }, at.x, at.y);
                }
                self.body.push('z');
            }
        }
        self.body += "\"/>\n";
    }

    pub(super) fn line(&mut self, kind: Line, points: &[Vec2], is_closed: bool) {
        self.body += "<polyline points=\"";
        for point in points.iter().chain(points.first().filter(|_| is_closed)) {
            let _ = write!(self.body, "{:.3},{:.3} ", point.x, point.y);
        }
        let _ = writeln!(self.body, "\" {}/>", kind.style());
    }

    pub(super) fn circle(&mut self, kind: Line, center: Vec2, radius: f32) {
        let Vec2 { x, y } = center;
        let _ = writeln!(self.body, "<circle cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"{radius:.3}\" {}/>", kind.style());
    }

    /// Draws a black disc.
    pub(super) fn dot(&mut self, center: Vec2, radius: f32) {
        let Vec2 { x, y } = center;
        let _ = writeln!(self.body, "<circle cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"{radius:.3}\"/>");
    }

    /// Writes a line of text, its base line at `at.y`, its middle at `at.x`.
    pub(super) fn text(&mut self, at: Vec2, text: &str) {
        self.label(at, FONT, text);
    }

    /// The same in letters of a height.
    pub(super) fn label(&mut self, at: Vec2, height: f32, text: &str) {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        let _ = writeln!(
            self.body,
            "<text x=\"{:.3}\" y=\"{:.3}\" font-family=\"sans-serif\" font-size=\"{height}\" text-anchor=\"middle\">{text}</text>",
            at.x, at.y
        );
    }

    /// Draws a bar with a note, to check that the printer did not shrink the page. Takes three lines of text.
    pub(super) fn scale_bar(&mut self, top_center: Vec2, width: f32) {
        let length = if width < 110.0 { 50.0 } else { 100.0 };
        self.text(top_center + LINE * Vec2::Y, &format!("Print at 100 %. This bar is {length} mm long:"));
        let middle = top_center + 1.7 * LINE * Vec2::Y;
        for (from, to) in [
            (Vec2::new(-0.5 * length, 0.0), Vec2::new(0.5 * length, 0.0)),
            (Vec2::new(-0.5 * length, -1.5), Vec2::new(-0.5 * length, 1.5)),
            (Vec2::new(0.5 * length, -1.5), Vec2::new(0.5 * length, 1.5)),
        ] {
            self.line(Line::Cut, &[middle + from, middle + to], false);
        }
    }

    pub(super) fn into_svg(self) -> String {
        let PaperSize { width, height } = self.paper;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
             viewBox=\"0 0 {width} {height}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
            self.body
        )
    }
}

impl Line {
    fn style(self) -> &'static str {
        match self {
            Self::Cut => "fill=\"none\" stroke=\"black\" stroke-width=\"0.25\"",
            Self::Fold => "fill=\"none\" stroke=\"gray\" stroke-width=\"0.25\" stroke-dasharray=\"2 1.5\"",
        }
    }
}

/// Breaks a text into lines that fit a width in millimeters.
pub(super) fn lines(text: &str, width: f32) -> Vec<String> {
    let letters = (width / (LETTER_WIDTH * FONT)) as usize;
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
