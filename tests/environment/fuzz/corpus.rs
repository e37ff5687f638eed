//! Small good files of each kind, with the names that they are read by.

use bevy::math::Vec3;
use exr::{
    image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer, write::WritableImage},
    math::Vec2,
    meta::{
        attribute::{Compression, LineOrder},
        header::LayerAttributes,
    },
    prelude::f16,
};
use image::{DynamicImage, ImageFormat, Rgb32FImage, RgbImage, codecs::jpeg::JpegEncoder};
use std::io::Cursor;

pub(super) type Corpus = Vec<(&'static str, Vec<u8>)>;

const SIZE: (u32, u32) = (32, 16);

fn sky() -> Rgb32FImage {
    Rgb32FImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let value = Vec3::new(x as f32 * 0.1, 1.0, if (x, y) == (9, 4) { 3e4 } else { 0.2 });
        image::Rgb(value.to_array())
    })
}

fn exr_file(names: &[&'static str], compression: Compression, blocks: Blocks, is_half: bool) -> Vec<u8> {
    let size = Vec2(SIZE.0 as usize, SIZE.1 as usize);
    let value = |channel: usize, i: usize| (i % 7) as f32 + channel as f32 * 0.5;
    let channels = names.iter().enumerate().map(|(channel, name)| {
        let values = (0..size.area()).map(|i| value(channel, i));
        let samples = if is_half {
            FlatSamples::F16(values.map(f16::from_f32).collect())
        } else {
            FlatSamples::F32(values.collect())
        };
        AnyChannel::new(*name, samples)
    });
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new(size, LayerAttributes::default(), encoding, AnyChannels::sort(channels.collect()));
    let mut bytes = Vec::new();
    Image::from_layer(layer).write().to_buffered(Cursor::new(&mut bytes)).expect("written");
    bytes
}

pub(super) fn environments() -> Corpus {
    let mut radiance = Cursor::new(Vec::new());
    sky().write_to(&mut radiance, ImageFormat::Hdr).expect("written");
    let flat = [128, 64, 32, 129].repeat(8);
    let old = [b"#?RGBE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n", &flat[..]].concat();
    let runs = [&b"#?RADIANCE\n\n-Y 2 +X 4\n"[..], &[9, 8, 7, 129, 1, 1, 1, 7]].concat();
    let mut files = vec![("sky.hdr", radiance.into_inner()), ("sky.hdr", old), ("sky.hdr", runs)];
    let colors = ["R", "G", "B"];
    let tiles = Blocks::Tiles(Vec2(8, 8));
    for (names, compression, blocks, is_half) in [
        (&colors[..], Compression::Uncompressed, Blocks::ScanLines, false),
        (&colors, Compression::RLE, tiles, false),
        (&colors, Compression::ZIP1, Blocks::ScanLines, true),
        (&colors, Compression::ZIP16, Blocks::ScanLines, false),
        (&colors, Compression::PIZ, Blocks::ScanLines, true),
        (&colors, Compression::PXR24, tiles, false),
        (&colors, Compression::B44, Blocks::ScanLines, true),
        (&colors, Compression::B44A, tiles, true),
        (
            &["VL.Combined.R", "VL.Combined.G", "VL.Combined.B", "VL.Depth.Z"],
            Compression::ZIP16,
            Blocks::ScanLines,
            false,
        ),
        (&["Y"], Compression::RLE, Blocks::ScanLines, false),
    ] {
        files.push(("sky.exr", exr_file(names, compression, blocks, is_half)));
    }
    files
}

/// A picture of few pixels in the format whose blocks end the file.
pub(super) fn b44() -> (&'static str, Vec<u8>) {
    ("b44.exr", exr_file(&["R", "G", "B"], Compression::B44, Blocks::ScanLines, true))
}

pub(super) fn scenes() -> Corpus {
    let text = r##"{"asset": {"version": "2.0"}, "scene": 0, "extensionsUsed": ["KHR_materials_unlit"],
        "scenes": [{"nodes": [0, 1, 2], "name": "Room", "extras": {"ShadowDomeLight": {"directions": 16, "filter": "Pcss"}}}],
        "nodes": [
            {"name": "marker", "extras": {"MarkerAnchor": {"family": "tag36h11", "id": 7, "size": 0.2}, "WorldOrigin": {}}},
            {"name": "ball", "mesh": 0, "extras": {"LightProbeSphere": "{\"radius\": 0.03}", "cycles": {"samples": 4}}},
            {"children": [3], "extras": {"PhantomObject": {"casts": false, "reflectance": [0.8, 0.5, 1]}}},
            {"extras": {"SurfaceStyle": {"Toon": {"bands": 2, "outline_width": 3.5, "outline_color": "#ff8000"}}}}],
        "materials": [{"name": "wood", "extras": {"SurfaceStyle": "Toon"}}],
        "meshes": [{"name": "board", "extras": {"PhantomObject": {}}, "primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "not_read.bin"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}]}"##;
    let mut chunk = text.as_bytes().to_vec();
    chunk.resize(chunk.len().next_multiple_of(4), b' ');
    let length = |bytes: usize| u32::try_from(bytes).expect("a small file").to_le_bytes();
    let binary = [&b"glTF\x02\0\0\0"[..], &length(20 + chunk.len()), &length(chunk.len()), b"JSON", &chunk].concat();
    vec![("scene.gltf", text.into()), ("scene.glb", binary)]
}

pub(super) fn sidecars() -> Corpus {
    let full = r#"{"image": [640, 480], "fps": 15, "intrinsics": {"fx": 601.8, "fy": 601.8, "cx": 320.0, "cy": 240.0},
        "files": ["frame_0.jpg", "b.png"], "pattern": "frame_*.jpg", "exposures": [1, 1, 1, 0.125]}"#;
    vec![("clip.json", full.into()), ("clip.json", r#"{"image": [8, 6], "fps": 10}"#.into())]
}

pub(super) fn lights() -> Corpus {
    let text = r#"(lights: [
        (id: "window", kind: Directional, position: (-1.0, 1.2, 0.4), look_at: (0.0, 0.0, 0.0)), // a comment
        (id: "lamp", kind: Spot, position: (0.3, 0.6, 0.1), look_at: (0.0, 0.0, 0.0),
         field_of_view: 60.0, aspect: 1.0, near: 0.05, far: 2.0),
    ])"#;
    vec![("all.lights.ron", text.into())]
}

pub(super) fn jpegs() -> Corpus {
    let image = RgbImage::from_fn(40, 24, |x, y| image::Rgb([6 * x as u8, 9 * y as u8, 90]));
    let encode = |image: DynamicImage, quality| {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(&image).expect("written");
        bytes
    };
    let color = encode(image.clone().into(), 90);
    let gray = encode(DynamicImage::ImageRgb8(image).into_luma8().into(), 40);
    // Exif data with an orientation, as a phone writes it.
    let exif = b"\xFF\xE1\0\x22Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
    let turned = [&color[..2], &exif[..], &color[2..]].concat();
    // The header says progressive, the scan is not.
    let mut progressive = color.clone();
    if let Some(at) = progressive.windows(2).position(|pair| pair == [0xFF, 0xC0]) {
        progressive[at + 1] = 0xC2;
    }
    vec![("frame.jpg", color), ("frame.jpg", gray), ("frame.jpg", turned), ("frame.jpg", progressive)]
}
