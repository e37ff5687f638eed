//! Reference for filtered environments in double precision, and a reader for the maps on the GPU.

use crate::radiance_cube::texel;
use bevy::{
    math::{DVec2, DVec3},
    prelude::*,
    render::{
        RenderApp,
        render_asset::RenderAssets,
        render_resource::{
            BindGroupDescriptor, BindGroupEntry, BindingResource, BufferDescriptor, BufferInitDescriptor, BufferUsages,
            MapMode, PollType, RawComputePipelineDescriptor, ShaderModuleDescriptor, ShaderSource,
            TextureViewDescriptor, TextureViewDimension,
        },
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};
use bevy_mirrorball::{environment_map::EquirectPixels, prefilter::SpecularLobe};
use std::{f64::consts::PI, path::Path};

/// Perceptual roughnesses at which glossy maps are compared.
pub(crate) const ROUGHNESSES: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

/// Two suns of 2° and 15° over a dim sky, from very different heights.
pub(crate) fn two_suns(dir: DVec3) -> DVec3 {
    let (strong, weak) = (DVec3::new(0.3, 0.8, -0.4).normalize(), DVec3::new(-0.7, 0.2, 0.6).normalize());
    let strong = if dir.dot(strong) > 2f64.to_radians().cos() { 1e4 } else { 0.0 };
    let weak = if dir.dot(weak) > 15f64.to_radians().cos() { 1.0 } else { 0.0 };
    DVec3::new(strong, weak, strong.max(weak)) + 0.03125
}

/// Radiance by direction in an equirectangular picture, column u ÷ width is the azimuth from −Z towards +X, row 0 is
/// up: bilinear.
pub(crate) fn picture(path: &Path) -> impl Fn(DVec3) -> DVec3 + use<> {
    let picture = EquirectPixels::open(path).expect("a picture");
    let size = picture.size.as_dvec2();
    move |dir| {
        let uv = DVec2::new(dir.x.atan2(-dir.z) / (2.0 * PI), dir.y.clamp(-1.0, 1.0).acos() / PI);
        let at = uv * size - 0.5;
        let pixel = |dx: f64, dy: f64| {
            let (x, y) = ((at.x.floor() + dx).rem_euclid(size.x), (at.y.floor() + dy).clamp(0.0, size.y - 1.0));
            picture.texels[y as usize * picture.size.x as usize + x as usize].as_dvec3().max(DVec3::ZERO)
        };
        let t = at - at.floor();
        pixel(0.0, 0.0).lerp(pixel(1.0, 0.0), t.x).lerp(pixel(0.0, 1.0).lerp(pixel(1.0, 1.0), t.x), t.y)
    }
}

/// Values by direction: 6 · edge² directions, at the centers of a cube's texels; first the diffuse map, then the glossy
/// one at each of [`ROUGHNESSES`].
pub(crate) type Filtered = Vec<Vec<DVec3>>;

/// The sums each filter approximates: irradiance ÷ π, and the glossy kernel of ours, which is D · N·L or a power of the
/// cosine, or, with Smith's term for the light (k = α ÷ 2), of Bevy's generator. GGX is for normal = view.
pub(crate) struct Truth {
    pub ours: Filtered,
    pub bevy: Filtered,
}

impl Truth {
    pub(crate) fn of(lobe: SpecularLobe, edge: usize, texels: &[DVec3], directions: usize) -> Self {
        let lights: Vec<(DVec3, DVec3, f64)> = texels
            .iter()
            .enumerate()
            .map(|(i, radiance)| {
                let (dir, solid_angle) = texel(edge, i);
                (dir, radiance * solid_angle, solid_angle)
            })
            .collect();
        let count = 6 * directions * directions;
        let sum = |i: usize| Self::at(lobe, texel(directions, i).0, &lights);
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let sums: Vec<_> = std::thread::scope(|scope| {
            let part = count.div_ceil(threads);
            let parts: Vec<_> = (0..threads)
                .map(|t| scope.spawn(move || (t * part..((t + 1) * part).min(count)).map(sum).collect::<Vec<_>>()))
                .collect();
            parts.into_iter().flat_map(|part| part.join().expect("sums do not panic")).collect()
        });
        let pick =
            |kernel: usize| (0..=ROUGHNESSES.len()).map(|k| sums.iter().map(|s| s[kernel][k]).collect()).collect();
        Self { ours: pick(0), bevy: pick(1) }
    }

    fn at(lobe: SpecularLobe, normal: DVec3, lights: &[(DVec3, DVec3, f64)]) -> [[DVec3; 6]; 2] {
        let (mut sums, mut weights) = ([[DVec3::ZERO; 6]; 2], [[0.0; 6]; 2]);
        for (dir, light, solid_angle) in lights {
            let cosine = normal.dot(*dir);
            if cosine <= 0.0 {
                continue;
            }
            sums[0][0] += light * cosine;
            for (k, roughness) in ROUGHNESSES.into_iter().enumerate() {
                let alpha = roughness * roughness;
                // The half vector bisects the angle.
                let d = 0.5 * (1.0 + cosine) * (alpha * alpha - 1.0) + 1.0;
                let ggx = cosine / (d * d);
                let ours = match lobe {
                    SpecularLobe::Cosine => cosine.powf(f64::from(SpecularLobe::exponent(roughness as f32))),
                    _ => ggx,
                };
                let bevy = ggx * cosine / (cosine * (1.0 - 0.5 * alpha) + 0.5 * alpha);
                sums[0][k + 1] += light * ours;
                weights[0][k + 1] += solid_angle * ours;
                sums[1][k + 1] += light * bevy;
                weights[1][k + 1] += solid_angle * bevy;
            }
        }
        sums[1][0] = sums[0][0];
        weights[0][0] = PI;
        weights[1][0] = PI;
        std::array::from_fn(|i| std::array::from_fn(|k| sums[i][k] / weights[i][k]))
    }
}

/// √(Σ ω (a − b)² ÷ Σ ω b²) over all directions and channels.
pub(crate) fn relative_rmse(got: &[DVec3], truth: &[DVec3]) -> f64 {
    let edge = (got.len() as f64 / 6.0).sqrt() as usize;
    let (mut error, mut signal) = (0.0, 0.0);
    for (i, (got, truth)) in got.iter().zip(truth).enumerate() {
        let solid_angle = texel(edge, i).1;
        error += solid_angle * (got - truth).length_squared();
        signal += solid_angle * truth.length_squared();
    }
    (error / signal).sqrt()
}

/// RMS step across the edges of a cube, between the outermost directions of neighboring faces, relative to the RMS
/// value.
pub(crate) fn seam(values: &[DVec3]) -> f64 {
    let edge = (values.len() as f64 / 6.0).sqrt() as usize;
    let is_border = |i: &usize| [i / edge % edge, i % edge].into_iter().any(|k| k == 0 || k + 1 == edge);
    let border: Vec<(usize, DVec3)> = (0..values.len()).filter(is_border).map(|i| (i, texel(edge, i).0)).collect();
    let (mut step, mut count) = (0.0, 0.0);
    for (i, dir) in &border {
        let others = border.iter().filter(|(other, _)| other / (edge * edge) != i / (edge * edge));
        let nearest = others.max_by(|a, b| dir.dot(a.1).total_cmp(&dir.dot(b.1)));
        if let Some((other, _)) = nearest {
            step += (values[*i] - values[*other]).length_squared();
            count += 1.0;
        }
    }
    let signal: f64 = values.iter().map(|v| v.length_squared()).sum();
    (step / count / (signal / values.len() as f64)).sqrt()
}

/// Brightest value of any channel.
pub(crate) fn brightest(values: &[DVec3]) -> f64 {
    values.iter().map(|v| v.max_element()).fold(0.0, f64::max)
}

/// One thread per direction and map: w is the level. Reads faces, as the crate's own passes do: some drivers do not
/// look across the edges of cubes, which would be judged with the maps.
const READER: &str = "
@group(0) @binding(0) var diffuse: texture_2d_array<f32>;
@group(0) @binding(1) var glossy: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read> directions: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> values: array<vec4f>;

@compute @workgroup_size(64)
fn read_maps(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&directions) {
        return;
    }
    let dir = directions[i];
    if dir.w < 0.0 {
        values[i] = sample_faces(diffuse, dir.xyz, 0u);
    } else {
        let low = u32(dir.w);
        let high = min(low + 1u, textureNumLevels(glossy) - 1u);
        values[i] = mix(sample_faces(glossy, dir.xyz, low), sample_faces(glossy, dir.xyz, high), fract(dir.w));
    }
}";

/// The crate's shader library of cube faces, without the lines that only Bevy reads.
fn cubemap_library() -> String {
    let lines = include_str!("../../src/environment_map/cubemap.wgsl").lines();
    lines.filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join("\n")
}

/// Reads maps as `StandardMaterial` should: trilinear, seamless, level = roughness · (levels − 1).
pub(crate) fn read(app: &mut App, diffuse: &Handle<Image>, glossy: &Handle<Image>, directions: usize) -> Filtered {
    let world = app.sub_app_mut(RenderApp).world_mut();
    let (device, queue) = (world.resource::<RenderDevice>(), world.resource::<RenderQueue>());
    let images = world.resource::<RenderAssets<GpuImage>>();
    let [diffuse, glossy] = [diffuse, glossy].map(|image| images.get(image).expect("the map is on the GPU"));
    let levels = f64::from(glossy.texture.mip_level_count() - 1);
    let lods = std::iter::once(-1.0).chain(ROUGHNESSES.map(|roughness| roughness * levels));
    let count = 6 * directions * directions;
    let input: Vec<u8> = lods
        .flat_map(|lod| (0..count).map(move |i| (texel(directions, i).0, lod)))
        // Cubes live in a left-handed frame.
        .flat_map(|(dir, lod)| [dir.x, dir.y, -dir.z, lod].map(|v| (v as f32).to_le_bytes()))
        .flatten()
        .collect();
    let size = input.len() as u64;
    let input = device.create_buffer_with_data(&BufferInitDescriptor {
        label: None,
        contents: &input,
        usage: BufferUsages::STORAGE,
    });
    let buffer =
        |usage| device.create_buffer(&BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    let output = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
    let answer = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
    let source = ShaderSource::Wgsl(format!("{}{READER}", cubemap_library()).into());
    let shader = device.create_and_validate_shader_module(ShaderModuleDescriptor { label: None, source });
    let pipeline = device.create_compute_pipeline(&RawComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &shader,
        entry_point: Some("read_maps"),
        compilation_options: default(),
        cache: None,
    });
    let view = |image: &GpuImage| {
        image
            .texture
            .create_view(&TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..default() })
    };
    let (diffuse, glossy) = (view(diffuse), view(glossy));
    let resources = [
        BindingResource::TextureView(&diffuse),
        BindingResource::TextureView(&glossy),
        input.as_entire_binding(),
        output.as_entire_binding(),
    ];
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
    let layout = pipeline.get_bind_group_layout(0);
    let bindings = BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
    let bindings = device.wgpu_device().create_bind_group(&bindings);
    let mut encoder = device.create_command_encoder(&default());
    {
        let mut pass = encoder.begin_compute_pass(&default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups((size / 16).div_ceil(64) as u32, 1, 1);
    }
    encoder.copy_buffer_to_buffer(&output, 0, &answer, 0, size);
    queue.submit([encoder.finish()]);
    device.map_buffer(&answer.slice(..), MapMode::Read, |result| result.expect("the answer can be mapped"));
    wait(device);
    let bytes = answer.slice(..).get_mapped_range().to_vec();
    let value = |v: &[u8]| {
        let channel = |i: usize| f64::from(f32::from_le_bytes([v[4 * i], v[4 * i + 1], v[4 * i + 2], v[4 * i + 3]]));
        DVec3::new(channel(0), channel(1), channel(2))
    };
    let values: Vec<DVec3> = bytes.chunks_exact(16).map(value).collect();
    values.chunks(count).map(<[_]>::to_vec).collect()
}

/// Returns when the GPU has done what it was given.
pub(crate) fn wait(device: &RenderDevice) {
    device.poll(PollType::wait_indefinitely()).expect("the GPU answers");
}
