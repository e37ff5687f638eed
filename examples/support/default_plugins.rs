//! Bevy's default plugins for the small examples.

use super::{draw_to_file::DrawToFile, has_display, headless_log, parse_size, window_log};
use bevy::{app::PluginGroupBuilder, prelude::*};
use bevy_mirrorball::headless;
use lexopt::prelude::*;
use std::{path::PathBuf, process::exit};

const USAGE: &str = "\
Options of all small examples:

  --headless           draw to a file instead of a window; chosen by itself where there is no display
  --frames N           frames to draw then, counted from the first frame of each feed; the last one is written [16]
  --size WIDTHxHEIGHT  its size in pixels [640x480]
  --out FILE           where it goes (PNG) [the example's name, .png]
  --press KEY          a key to press in the first frame, by Bevy's name for it: KeyT, Space
";
/// Size of the window and of the written frame, in pixels.
const SIZE: UVec2 = UVec2::new(640, 480);

/// Stands for Bevy's plugins of this name: the same with a window in the shape of the frames, or, with `--headless`,
/// without a window and with a runner that writes a frame to a file.
pub(crate) struct DefaultPlugins;

impl PluginGroup for DefaultPlugins {
    fn build(self) -> PluginGroupBuilder {
        let name = program_name();
        let (is_headless, drawing) = match options(&name) {
            Ok(Some(options)) => options,
            Ok(None) => {
                println!("{USAGE}");
                exit(0)
            }
            Err(error) => {
                eprintln!("{name}: {error}");
                exit(1)
            }
        };
        if is_headless || !has_display() {
            println!("{name}: drawing {} frames without a window", drawing.frames);
            return headless::default_plugins().add(headless_log()).add(drawing);
        }
        let window = Window { title: name, resolution: drawing.size.into(), ..default() };
        let window = WindowPlugin { primary_window: Some(window), ..default() };
        bevy::DefaultPlugins.set(window).set(window_log())
    }
}

fn program_name() -> String {
    let program = std::env::current_exe().ok();
    let name = program.as_ref().and_then(|program| program.file_stem());
    name.map_or_else(|| "example".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Whether to draw to a file, and how. `None` if help was asked for.
fn options(name: &str) -> Result<Option<(bool, DrawToFile)>, lexopt::Error> {
    let (mut is_headless, mut frames, mut size, mut key) = (false, 16, SIZE, None);
    let mut out = PathBuf::from(format!("{name}.png"));
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("headless") => is_headless = true,
            Long("frames") => frames = parser.value()?.parse()?,
            Long("size") => {
                size = parse_size(&parser.value()?.string()?).ok_or("--size: write it like 640x480")?;
            }
            Long("out") => out = parser.value()?.into(),
            Long("press") => key = Some(parser.value()?.parse_with(parse_key)?),
            Long("help") | Short('h') => return Ok(None),
            other => return Err(other.unexpected()),
        }
    }
    if frames == 0 {
        return Err("--frames takes a whole number above 0".into());
    }
    Ok(Some((is_headless, DrawToFile { name: name.to_owned(), frames, size, out, key })))
}

fn parse_key(name: &str) -> Result<KeyCode, String> {
    serde_json::from_value(name.into()).map_err(|_| format!("{name} is no key; write it like KeyT, Digit1 or Space"))
}
