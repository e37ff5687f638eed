//! The command line.

use crate::{
    look::{Look, Looks},
    presets, styles_file,
    support::{Outcome, parse_size},
};
use bevy::math::UVec2;
use lexopt::prelude::{Long, Short, ValueExt};
use std::path::PathBuf;

pub(crate) const USAGE: &str = "\
A teapot, a fox and a block on a recorded desk, in all styles.

usage: looks [OPTIONS]

  --style NAME         all things in one look: image-based, engine, gloss map, combined, mixed, lamps, glass, bubble,
                       sphere map (classic), toon, ink, soft, ramps, phong, key, anime, cool to warm or
                       two tone (toon)
  --styles FILE.ron    the looks of all things, as `save` in the panel writes them
  --save FILE.ron      write the looks with which the program starts, to edit them
  --headless           draw to a file instead of a window; chosen by itself where there is no display: all looks side
                       by side, or with --style or --styles one picture of the desk
  --compare            draw ways to use the ball's image: sphere map and cube map, a blur of the image and a filter on
                       the sphere of directions, side by side
  --size WIDTHxHEIGHT  size at which the desk is drawn then, in pixels [640x480]
  --out FILE           where it goes (PNG or JPEG) [looks.png]

In the window: click a thing to edit its look; Space holds the camera or lets it move; Esc ends.";

/// Largest size of an image in pixels, which all graphics devices support.
const MAX_SIZE: u32 = 8192;

/// Looks of the things if nothing else is asked for.
const START: [(&str, &str); 3] = [("teapot", "combined"), ("fox", "toon"), ("block", "image-based")];

/// What a picture without a window shows.
pub(crate) enum Subject {
    /// All looks side by side.
    Gallery,
    /// Ways to use the ball's image side by side.
    Comparison,
    /// The desk with the things in the looks that were asked for.
    Desk,
}

pub(crate) struct Options {
    look: Option<Look>,
    pub styles: Option<PathBuf>,
    save: Option<PathBuf>,
    pub is_headless: bool,
    is_comparison: bool,
    pub size: UVec2,
    pub out: PathBuf,
}

impl Options {
    /// Parses the command line; `None` if help was asked for.
    pub(crate) fn from_command_line() -> Result<Option<Self>, lexopt::Error> {
        let mut parser = lexopt::Parser::from_env();
        let size = UVec2::new(640, 480);
        let mut options = Self {
            look: None,
            styles: None,
            save: None,
            is_headless: false,
            is_comparison: false,
            size,
            out: "looks.png".into(),
        };
        while let Some(argument) = parser.next()? {
            match argument {
                Long("style") => options.look = Some(parser.value()?.parse_with(parse_style)?),
                Long("styles") => options.styles = Some(parser.value()?.into()),
                Long("save") => options.save = Some(parser.value()?.into()),
                Long("headless") => options.is_headless = true,
                Long("compare") => (options.is_headless, options.is_comparison) = (true, true),
                Long("size") => options.size = parser.value()?.parse_with(parse_image_size)?,
                Long("out") => options.out = parser.value()?.into(),
                Long("help") | Short('h') => return Ok(None),
                other => return Err(other.unexpected()),
            }
        }
        if options.look.is_some() && options.styles.is_some() {
            return Err("--style is one look for all things; leave out --styles, or --style".into());
        }
        if options.is_comparison && (options.look.is_some() || options.styles.is_some()) {
            return Err("--compare has looks of its own; leave out --style and --styles, or --compare".into());
        }
        Ok(Some(options))
    }

    /// Returns the looks with which the things start, and saves them if that is asked for.
    pub(crate) fn looks(&self) -> Outcome<Looks> {
        let looks = match (&self.look, &self.styles) {
            (Some(look), _) => look.for_all(),
            (None, Some(file)) => styles_file::load(file)?,
            (None, None) => START
                .into_iter()
                .map(|(thing, look)| (thing.to_owned(), presets::named(look).unwrap_or_default()))
                .collect(),
        };
        if let Some(file) = &self.save {
            styles_file::save(&looks, file)?;
            println!("looks: wrote the styles to {}", file.display());
        }
        Ok(looks)
    }

    pub(crate) fn subject(&self) -> Subject {
        match (self.is_comparison, &self.look, &self.styles) {
            (true, ..) => Subject::Comparison,
            (false, None, None) => Subject::Gallery,
            _ => Subject::Desk,
        }
    }
}

fn parse_style(name: &str) -> Result<Look, String> {
    presets::named(name).ok_or_else(|| format!("--style takes one of {}, not {name}", presets::NAMES.join(", ")))
}

fn parse_image_size(text: &str) -> Result<UVec2, String> {
    parse_size(text)
        .filter(|size| size.max_element() <= MAX_SIZE)
        .ok_or_else(|| format!("--size takes WIDTHxHEIGHT in pixels, each 1 to {MAX_SIZE}, not {text}"))
}
