//! The command line.

use bevy_mirrorball::camera::calibration::CalibrationBoard;
use lexopt::prelude::*;
use std::path::PathBuf;

pub(crate) const USAGE: &str = "\
Measures the lens of a camera: focal lengths, principal point and distortion, from views of a printed board.

usage: calibrate --board SHEET.svg
       calibrate --images FILE... [--out FILE]
       calibrate --device N [--out FILE]

  --board FILE        write the board as an A4 page (SVG) to print at 100 % and lay on something flat and stiff
  --images FILE...    photographs or frames of the board (PNG or JPEG, all of one size), eight or more;
                      a * in a file's name stands for anything
  --device N          webcam number N (needs the feature `webcam`): move the board, a view is taken where it is held
                      still at a new place; ends after --views
  --views N           views to take from a webcam (default 20)
  --resolution WIDTHxHEIGHT
                      what to ask the webcam for (default 640x480, as the game does unless it asks for more); the
                      result is good for all sizes of this shape
  --size MM           side of the black squares as printed, in millimeters (default 24)
  --grid COLUMNSxROWS markers of the board (default 6x8)
  --first N           number of the upper left marker (default 500)
  --out FILE          where the result goes (default calibration.json), for `dance_stage --calibration FILE` and
                      Intrinsics::open

Slant the board by 20° to 45° to each side, and bring it near all borders and into the corners. Focus and zoom have to
stay as they will be in use.";

/// Where views come from.
pub(crate) enum Source {
    Images(Vec<PathBuf>),
    Device(u32),
}

pub(crate) struct Options {
    pub board: CalibrationBoard,
    /// File for the page to print.
    pub sheet: Option<PathBuf>,
    pub source: Option<Source>,
    pub views: usize,
    #[cfg_attr(not(feature = "webcam"), expect(dead_code, reason = "only webcams are asked for a size"))]
    pub resolution: (u32, u32),
    pub out: PathBuf,
}

impl Options {
    /// `None` if help was asked for.
    pub(crate) fn from_command_line() -> Result<Option<Self>, lexopt::Error> {
        let mut parser = lexopt::Parser::from_env();
        let mut options = Self {
            board: CalibrationBoard::default(),
            sheet: None,
            source: None,
            views: 20,
            resolution: (640, 480),
            out: "calibration.json".into(),
        };
        while let Some(argument) = parser.next()? {
            match argument {
                Long("board") => options.sheet = Some(parser.value()?.into()),
                Long("images") => {
                    options.source = Some(Source::Images(parser.values()?.map(PathBuf::from).collect()));
                }
                Long("device") => options.source = Some(Source::Device(parser.value()?.parse()?)),
                Long("views") => options.views = parser.value()?.parse()?,
                Long("resolution") => options.resolution = parser.value()?.parse_with(pair)?,
                Long("size") => options.board.size = 0.001 * parser.value()?.parse::<f64>()?,
                Long("grid") => (options.board.columns, options.board.rows) = parser.value()?.parse_with(pair)?,
                Long("first") => options.board.first_id = parser.value()?.parse()?,
                Long("out") => options.out = parser.value()?.into(),
                Long("help") | Short('h') => return Ok(None),
                other => return Err(other.unexpected()),
            }
        }
        if options.sheet.is_none() && options.source.is_none() {
            return Err("give --board FILE to print a board, or --images or --device to measure with one".into());
        }
        Ok(Some(options))
    }
}

fn pair(text: &str) -> Result<(u32, u32), String> {
    let numbers = text.split_once('x').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    numbers.filter(|(a, b)| *a > 0 && *b > 0).ok_or_else(|| format!("two whole numbers like 6x8 are meant, not {text}"))
}
