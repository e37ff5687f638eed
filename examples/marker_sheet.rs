//! Makes sheets to print, as SVG in true size: markers, the place of a mirrored ball with a ring to stand it on, boards
//! of several markers, nets of boxes.
//!
//! ```text
//! cargo run --example marker_sheet -- --kind ball --paper A4-landscape --out sheet.svg
//! ```

#[path = "support/dance_mat.rs"]
mod dance_mat;
#[path = "support/mod.rs"]
mod support;

use bevy::math::{Vec2, Vec3};
use bevy_mirrorball::tracking::{MarkerAnchor, MarkerBoard, MarkerFamily, MarkerSheet, PaperSize};
use dance_mat::DanceMat;
use lexopt::prelude::*;
use std::{path::PathBuf, process::ExitCode};
use support::{Outcome, exit_code};

const USAGE: &str = "marker_sheet --kind KIND --out FILE

  --kind KIND        marker: one marker; ball: with the place of a mirrored ball; board: with six
                     small markers around the ball; grid: rows and columns; box: a net to glue;
                     mat: fields for the dance game, as wide as the paper
  --out FILE         the SVG
  --paper PAPER      A5, A4, A3, Letter, also as A4-landscape, or 200x150 in millimeters [A4]
  --family FAMILY    family of markers [tag36h11]
  --id N             number of the first marker [0]
  --size MM          side of the marker's square [100; 45 in a grid and on a box]
  --ball X,Y,D       where the ball touches the sheet, to the right of and below the middle of the
                     marker, and its diameter [170,10,100]
  --grid C,R,MM      columns, rows, distance between middles [2,3,70]
  --box W,H,D        width, height and depth of the box [80,60,80]";

fn three(text: &str) -> Outcome<[f32; 3]> {
    let numbers = text.split(',').map(|number| number.trim().parse()).collect::<Result<Vec<f32>, _>>()?;
    numbers.try_into().map_err(|_| format!("{text:?}: give three numbers with commas between them").into())
}

/// Makes the sheet that the command line asks for.
fn run() -> Outcome<String> {
    let (mut kind, mut out, mut paper, mut family) = (None, None, PaperSize::A4, MarkerFamily::default());
    let (mut id, mut size) = (0, None);
    let (mut ball, mut grid, mut box_size) = ([170.0, 10.0, 100.0], [2.0, 3.0, 70.0], [80.0, 60.0, 80.0]);
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("kind") => kind = Some(parser.value()?.string()?),
            Long("out") => out = Some(PathBuf::from(parser.value()?)),
            Long("paper") => paper = parser.value()?.parse()?,
            Long("family") => family = parser.value()?.parse()?,
            Long("id") => id = parser.value()?.parse()?,
            Long("size") => size = Some(parser.value()?.parse::<f32>()?),
            Long("ball") => ball = three(&parser.value()?.string()?)?,
            Long("grid") => grid = three(&parser.value()?.string()?)?,
            Long("box") => box_size = three(&parser.value()?.string()?)?,
            Long("help") | Short('h') => return Ok(USAGE.to_owned()),
            other => return Err(other.unexpected().into()),
        }
    }
    let anchor = |default| MarkerAnchor::new(id, size.unwrap_or(default) / 1000.0).with_family(family);
    let (large, small) = (anchor(100.0), anchor(45.0));
    let (place, radius) = (Vec2::new(ball[0], ball[1]) / 1000.0, ball[2] / 2000.0);
    let sheet = match &*kind.ok_or("--kind is missing; see --help")? {
        "marker" => MarkerSheet::new(&large),
        "ball" => MarkerSheet::new(&large).with_ball(place, radius),
        "board" => {
            let board = MarkerBoard::around_ball(&large, place, radius);
            MarkerSheet::new(&large).with_board(&board).with_ball(place, radius)
        }
        "grid" => {
            let board = MarkerBoard::grid(&small, grid[0] as u32, grid[1] as u32, grid[2] / 1000.0);
            MarkerSheet::new(&small).with_board(&board)
        }
        "mat" => {
            let mat = DanceMat::of_width(paper.width / 1000.0);
            let sheet = MarkerSheet::new(&mat.anchor()).with_board(&mat.board());
            let fields = mat.field_centers().into_iter().zip(["\u{2190}", "\u{2193}", "\u{2191}", "\u{2192}"]);
            fields.fold(sheet, |sheet, (center, arrow)| sheet.with_button(center, mat.field_size(), arrow))
        }
        "box" => MarkerSheet::box_net(&small, Vec3::from_array(box_size) / 1000.0, small.size),
        other => return Err(format!("--kind {other}: write marker, ball, board, grid, box or mat").into()),
    };
    let out = out.ok_or("--out is missing; see --help")?;
    std::fs::write(&out, sheet.on(paper).to_svg()?).map_err(|error| format!("{}: {error}", out.display()))?;
    Ok(format!("marker_sheet: see {}", out.display()))
}

fn main() -> ExitCode {
    exit_code("marker_sheet", run().map(|said| println!("{said}")))
}
