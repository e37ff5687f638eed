//! Converts a photograph of a mirrored ball to an equirectangular environment map.
//!
//! ```text
//! cargo run --example unwrap_ball -- \
//!     --photo ball.jpg --center 1031,1037 --diameter 1988 --fov 280 --out surroundings.hdr
//! ```

#[path = "support/mod.rs"]
mod support;

use bevy::{
    color::{ColorToComponents, ColorToPacked, LinearRgba, Srgba},
    math::{Quat, Vec2, Vec3},
};
use bevy_mirrorball::probe::{BallPhoto, open_photo};
use lexopt::prelude::*;
use std::{path::PathBuf, process::ExitCode};
use support::{Outcome, run_with_options};

const USAGE: &str = "unwrap_ball --photo FILE --center X,Y --diameter D --fov DEGREES --out FILE

  --photo FILE       picture with a mirrored ball in it: PNG, JPEG, or Radiance or OpenEXR,
                     which stays linear and unclipped
  --center X,Y       middle of the ball's outline, in pixels
  --diameter D       diameter of the outline, in pixels
  --fov DEGREES      below 180: the camera's horizontal field of view;
                     above 180: how much of its surroundings the ball shows, 360 if it was far away
  --out FILE         .hdr (Radiance) or .exr (OpenEXR); .png for looking at it
  --reflectance R    share of light that the ball mirrors, above 0 to 1 [1]
  --width W          width of the map in pixels [1024]";

struct Options {
    photo: PathBuf,
    out: PathBuf,
    center: Vec2,
    diameter: f32,
    fov: f32,
    reflectance: f32,
    width: u32,
}

fn options() -> Outcome<Option<Options>> {
    let (mut photo, mut out, mut center, mut diameter, mut fov) = (None, None, None, None, None);
    let (mut reflectance, mut width) = (1.0, 1024);
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("photo") => photo = Some(parser.value()?.into()),
            Long("out") => out = Some(parser.value()?.into()),
            Long("center") => {
                let text = parser.value()?.string()?;
                let (x, y) = text.split_once(',').ok_or("--center: give two numbers, X,Y")?;
                center = Some(Vec2::new(x.trim().parse()?, y.trim().parse()?));
            }
            Long("diameter") => diameter = Some(parser.value()?.parse()?),
            Long("fov") => fov = Some(parser.value()?.parse()?),
            Long("reflectance") => reflectance = parser.value()?.parse()?,
            Long("width") => width = parser.value()?.parse()?,
            Long("help") | Short('h') => return Ok(None),
            other => return Err(other.unexpected().into()),
        }
    }
    if !(reflectance > 0.0 && reflectance <= 1.0) {
        return Err("--reflectance: give a number above 0, at most 1".into());
    }
    if !(2..=16384).contains(&width) {
        return Err("--width: give a number from 2 to 16384".into());
    }
    let missing = |name: &str| format!("{name} is missing; see --help");
    Ok(Some(Options {
        photo: photo.ok_or_else(|| missing("--photo"))?,
        out: out.ok_or_else(|| missing("--out"))?,
        center: center.ok_or_else(|| missing("--center"))?,
        diameter: diameter.ok_or_else(|| missing("--diameter"))?,
        fov: fov.ok_or_else(|| missing("--fov"))?,
        reflectance,
        width,
    }))
}

fn unwrap_ball(options: &Options) -> Outcome<()> {
    let photo = open_photo(&options.photo)?;
    let mut picture = BallPhoto::from_outline(&*photo, options.center, options.diameter, options.fov)?;
    picture.reflectance = options.reflectance;
    let map = picture.to_equirect(options.width, Quat::IDENTITY);
    if options.out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        let encode = |texel: &Vec3| Srgba::from(LinearRgba::from_vec3(texel.min(Vec3::ONE))).to_u8_array_no_alpha();
        let bytes = map.texels.iter().flat_map(encode);
        image::RgbImage::from_raw(map.size.x, map.size.y, bytes.collect())
            .ok_or("the map has the wrong size")?
            .save(&options.out)?;
    } else {
        map.save(&options.out)?;
    }
    println!("unwrap_ball: see {}", options.out.display());
    Ok(())
}

fn main() -> ExitCode {
    run_with_options("unwrap_ball", USAGE, options(), unwrap_ball)
}
