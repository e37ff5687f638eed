//! OpenEXR files, with the channel names and windows that other programs write.
//!
//! Channels may carry the name of a layer (`ViewLayer.Combined.R`, Blender) and be written in small letters or in
//! full; `Y` alone is gray. The picture is the *display window*: pixels outside it (overscan) are left out, and those
//! of it that the file does not have (a cropped rendering) are black.

use super::check_size;
use exr::{
    image::read::{image::ReadLayers, layers::ReadChannels, read, specific_channels::ReadSpecificChannel},
    math::Vec2,
    meta::{attribute::Text, header::Header},
};
use image::{
    ImageFormat, ImageResult, Rgb32FImage,
    error::{DecodingError, ImageError},
};
use std::{
    collections::BTreeMap,
    io::{BufRead, Seek},
};

/// Names of the red, green and blue channel, in small letters and without the layer's.
const COLOR_NAMES: [[&str; 2]; 3] = [["r", "red"], ["g", "green"], ["b", "blue"]];
/// Names of a single gray channel.
const GRAY_NAMES: [&str; 5] = ["y", "l", "v", "luminance", "gray"];
/// Names of chroma and of coordinates. Beside them, `Y` and `V` are not a gray picture.
const NOT_GRAY_BESIDE: [&str; 4] = ["ry", "by", "x", "u"];
/// Last parts of the names of layers that hold the finished picture among others.
const PICTURE_LAYERS: [&str; 6] = ["combined", "rgba", "rgb", "beauty", "composite", "image"];

/// Decodes an OpenEXR file of `length` bytes. Errors name the channels that were found.
pub(super) fn decode(file: impl BufRead + Seek, length: u64) -> ImageResult<Rgb32FImage> {
    let reader = exr::block::read(file, false).map_err(|error| problem(error.to_string()))?;
    let picture = choose(reader.headers()).map_err(problem)?;
    let header = &reader.headers()[picture.header];
    let display = header.shared_attributes.display_window;
    let data_from_display = header.own_attributes.layer_position - display.position;
    for header in reader.headers() {
        check_area(header.layer_size, length)?;
    }
    check_area(display.size, length)?;

    let (width, height) = (display.size.width(), display.size.height());
    let blank = move || vec![0.0_f32; 3 * width * height];
    let place = move |pixels: &mut Vec<f32>, at: Vec2<usize>, color: [f32; 3]| {
        let (x, y) =
            (at.x() as i64 + i64::from(data_from_display.x()), at.y() as i64 + i64::from(data_from_display.y()));
        if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
            let first = 3 * (y as usize * width + x as usize);
            pixels[first..first + 3].copy_from_slice(&color);
        }
    };
    let channels = read().no_deep_data().largest_resolution_level().specific_channels();
    let pixels = match picture.channels {
        Channels::Color([red, green, blue]) => channels
            .required(red)
            .required(green)
            .required(blue)
            .collect_pixels(
                move |_, _| blank(),
                move |pixels, at, (r, g, b): (f32, f32, f32)| place(pixels, at, [r, g, b]),
            )
            .first_valid_layer()
            .all_attributes()
            .from_chunks(reader)
            .map(|image| image.layer_data.channel_data.pixels),
        Channels::Gray(gray) => channels
            .required(gray)
            .collect_pixels(move |_, _| blank(), move |pixels, at, (y,): (f32,)| place(pixels, at, [y; 3]))
            .first_valid_layer()
            .all_attributes()
            .from_chunks(reader)
            .map(|image| image.layer_data.channel_data.pixels),
    };
    let pixels = pixels.map_err(|error| problem(error.to_string()))?;
    Rgb32FImage::from_raw(width as u32, height as u32, pixels).ok_or_else(|| problem("it has no pixels".to_owned()))
}

fn check_area(size: Vec2<usize>, length: u64) -> ImageResult<()> {
    let size = (size.width() as u64, size.height() as u64);
    check_size(ImageFormat::OpenExr, size, size_of::<[f32; 3]>() as u64, length)
}

fn problem(text: String) -> ImageError {
    ImageError::Decoding(DecodingError::new(ImageFormat::OpenExr.into(), text))
}

/// The channels that are read, and the part of the file that has them.
struct Picture {
    header: usize,
    channels: Channels,
}

#[derive(PartialEq)]
enum Channels {
    Color([Text; 3]),
    Gray(Text),
}

/// The channels of one layer that matter.
#[derive(Default)]
struct Layer {
    color: [Option<Text>; 3],
    gray: Option<Text>,
    is_not_gray: bool,
}

impl Layer {
    fn channels(self) -> Option<Channels> {
        match self {
            Self { color: [Some(red), Some(green), Some(blue)], .. } => Some(Channels::Color([red, green, blue])),
            Self { gray: Some(gray), is_not_gray: false, .. } => Some(Channels::Gray(gray)),
            _ => None,
        }
    }
}

/// Chooses the channels of the picture: those without a layer's name, else those of the layer that holds the finished
/// picture, else those of the only layer that has colors, else gray ones by the same rule.
fn choose(headers: &[Header]) -> Result<Picture, String> {
    let mut found = Vec::new();
    let mut names = Vec::new();
    for (index, header) in headers.iter().enumerate() {
        let mut layers: BTreeMap<String, Layer> = BTreeMap::new();
        for channel in &header.channels.list {
            let name = channel.name.to_string();
            let (layer, last) = name.rsplit_once('.').unwrap_or(("", &name));
            let last = last.to_lowercase();
            let layer = layers.entry(layer.to_owned()).or_default();
            if let Some(at) = COLOR_NAMES.iter().position(|names| names.contains(&&*last)) {
                layer.color[at].get_or_insert_with(|| channel.name.clone());
            } else if GRAY_NAMES.contains(&&*last) {
                layer.gray.get_or_insert_with(|| channel.name.clone());
            }
            layer.is_not_gray |= NOT_GRAY_BESIDE.contains(&&*last);
            names.push(name);
        }
        let part = header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
        for (name, layer) in layers.into_iter().filter(|_| !header.deep) {
            if let Some(channels) = layer.channels() {
                found.push((rank(&part, &name, &channels), index, channels));
            }
        }
    }
    let all = list(&names);
    let Some(best) = found.iter().map(|(rank, ..)| *rank).min() else {
        return Err(format!(
            "its channels are {all}; save it with R, G and B (a layer's name may stand before them, as in Combined.R), or \
             with Y alone for gray"
        ));
    };
    found.retain(|(rank, ..)| *rank == best);
    let (_, header, channels) = found.swap_remove(0);
    // Parts of a file may have channels of the same names, as those of a stereo pair; the first one is read.
    let is_only = found.iter().all(|(_, _, others)| *others == channels);
    let wanted = match &channels {
        Channels::Color(color) => &color[..],
        Channels::Gray(gray) => std::slice::from_ref(gray),
    };
    let has_all = |header: &Header| wanted.iter().all(|name| header.channels.find_index_of_channel(name).is_some());
    let is_first = headers.iter().position(|header| !header.deep && has_all(header)) == Some(header);
    if is_first && is_only {
        return Ok(Picture { header, channels });
    }
    Err(format!(
        "it holds several pictures, with the channels {all}; save the one that is meant by itself, as R, G and B"
    ))
}

/// Order in which layers are preferred; the smallest first.
fn rank(part: &str, layer: &str, channels: &Channels) -> u8 {
    let name = if layer.is_empty() { part } else { layer };
    let last = name.rsplit('.').next().unwrap_or_default().to_lowercase();
    let by_name = match () {
        () if layer.is_empty() && part.is_empty() => 0,
        () if PICTURE_LAYERS.contains(&&*last) => 1,
        () if layer.is_empty() => 2,
        () => 3,
    };
    by_name + if matches!(channels, Channels::Gray(_)) { 4 } else { 0 }
}

/// Number of channel names that a message repeats.
const MAX_LISTED: usize = 12;

fn list(names: &[String]) -> String {
    let mut text = names.iter().take(MAX_LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
    if names.len() > MAX_LISTED {
        text += &format!(" and {} more", names.len() - MAX_LISTED);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::{
        image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, write::WritableImage},
        meta::{
            attribute::IntegerBounds,
            header::{ImageAttributes, LayerAttributes},
        },
    };
    use std::io::Cursor;

    /// An image with these channels. Each value is 100 × channel + 10 × row + column of the display window.
    fn file(names: &[&str], display: IntegerBounds, data: IntegerBounds) -> Vec<u8> {
        let (width, height) = (data.size.width(), data.size.height());
        let from = data.position - display.position;
        let value = |channel: usize, i: usize| {
            let (x, y) = (from.x() + (i % width) as i32, from.y() + (i / width) as i32);
            100.0 * channel as f32 + 10.0 * y as f32 + x as f32
        };
        let channels = names.iter().enumerate().map(|(channel, name)| {
            let samples = (0..width * height).map(|i| value(channel, i)).collect();
            AnyChannel::new(*name, FlatSamples::F32(samples))
        });
        let attributes = LayerAttributes { layer_position: data.position, ..Default::default() };
        let layer = Layer::new(data.size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels.collect()));
        let mut bytes = Vec::new();
        Image::empty(ImageAttributes::new(display))
            .with_layer(layer)
            .write()
            .to_buffered(Cursor::new(&mut bytes))
            .expect("written");
        bytes
    }

    fn bounds(x: i32, y: i32, width: usize, height: usize) -> IntegerBounds {
        IntegerBounds::new((x, y), (width, height))
    }

    fn decoded(bytes: &[u8]) -> ImageResult<Rgb32FImage> {
        decode(Cursor::new(bytes), bytes.len() as u64)
    }

    fn of_channels(names: &[&str]) -> Result<[f32; 3], String> {
        let window = bounds(0, 0, 4, 2);
        decoded(&file(names, window, window)).map(|image| image.get_pixel(3, 1).0).map_err(|error| error.to_string())
    }

    #[test]
    fn pixels_lie_where_the_data_window_is_in_the_display_window() {
        // The middle half of a picture, one with overscan on all sides, and one beside another origin.
        for (display, data) in [
            (bounds(0, 0, 8, 4), bounds(2, 1, 4, 2)),
            (bounds(0, 0, 8, 4), bounds(-2, -1, 12, 6)),
            (bounds(-5, 7, 8, 4), bounds(-6, 8, 5, 2)),
        ] {
            let image = decoded(&file(&["R", "G", "B"], display, data)).expect("an image");
            assert_eq!(image.dimensions(), (8, 4));
            let from = data.position - display.position;
            for (x, y, pixel) in image.enumerate_pixels() {
                let (column, row) = (x as i32 - from.x(), y as i32 - from.y());
                let has_data =
                    (0..data.size.width() as i32).contains(&column) && (0..data.size.height() as i32).contains(&row);
                let expected = (10 * y + x) as f32;
                let expected = if has_data { [expected, 100.0 + expected, 200.0 + expected] } else { [0.0; 3] };
                assert_eq!(pixel.0, expected, "{x}, {y} with {data:?} in {display:?}");
            }
        }
    }

    #[test]
    fn channels_are_known_by_the_names_of_other_programs() {
        for names in [
            ["R", "G", "B", "A"],
            ["r", "g", "b", "a"],
            ["red", "Green", "BLUE", "alpha"],
            ["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B", "ViewLayer.Combined.A"],
            ["beauty.red", "beauty.green", "beauty.blue", "Z"],
        ] {
            assert_eq!(of_channels(&names), Ok([13.0, 113.0, 213.0]), "{names:?}");
        }
        assert_eq!(of_channels(&["Y"]), Ok([13.0; 3]));
        assert_eq!(of_channels(&["V"]), Ok([13.0; 3]));
    }

    #[test]
    fn the_finished_picture_is_taken_from_many_layers() {
        let names = [
            "Normal.X",
            "VL.Diffuse.R",
            "VL.Diffuse.G",
            "VL.Diffuse.B",
            "VL.Combined.R",
            "VL.Combined.G",
            "VL.Combined.B",
        ];
        assert_eq!(of_channels(&names), Ok([413.0, 513.0, 613.0]));
        let names = ["left.R", "left.G", "left.B", "R", "G", "B", "Y"];
        assert_eq!(of_channels(&names), Ok([313.0, 413.0, 513.0]));
        assert_eq!(of_channels(&["Depth.V", "Glow.R", "Glow.G", "Glow.B"]), Ok([113.0, 213.0, 313.0]));
    }

    #[test]
    fn what_is_no_picture_is_refused_with_the_channels_found() {
        let said = |names: &[&str]| of_channels(names).expect_err("refused");
        let text = said(&["N.X", "N.Y", "N.Z", "Z"]);
        assert!(text.contains("N.X, N.Y, N.Z, Z") && text.contains("R, G and B"), "{text}");
        let text = said(&["Y", "RY", "BY"]);
        assert!(text.contains("BY, RY, Y"), "{text}");
        let text = said(&["A.R", "A.G", "A.B", "B.R", "B.G", "B.B"]);
        assert!(text.contains("several pictures") && text.contains("A.B, A.G, A.R, B.B"), "{text}");
    }

    #[test]
    fn a_damaged_size_takes_no_memory() {
        let display = bounds(0, 0, 1 << 20, 1 << 20);
        let text = decoded(&file(&["R", "G", "B"], display, bounds(0, 0, 4, 2))).expect_err("damaged").to_string();
        assert!(text.contains("1048576 × 1048576"), "{text}");
    }
}
