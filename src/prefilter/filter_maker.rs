//! Makes the dispatches, bind groups and tables that filter one environment.

use super::{
    FilteredEnvironment, Refresh,
    filter::{Dispatch, Filter},
    lobe::{self, MAX_TAPS, Reading, TapSet},
    maps::ROUGHEST_EDGE,
    pipeline::{FilterPipelines, Step},
    source::SourceShape,
};
use bevy::{
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{
            BindGroupEntry, BindingResource, Buffer, BufferDescriptor, BufferUsages, Extent3d, PipelineCache,
            ShaderType, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
            TextureViewDescriptor, TextureViewDimension, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

/// Threads along each side of a workgroup, as in the shader.
const WORKGROUP: u32 = 8;
/// Texels that a thread of the sums works on, and threads in its workgroup, as in the shader.
const QUAD: u32 = 4;
const QUAD_WORKGROUP: u32 = 64;
/// Threads in a workgroup that goes through padded faces row by row.
const ROW_WORKGROUP: u32 = 64;
/// Texels around padded faces, as in the shader.
const PADDING: u32 = 1;
/// How many levels finer than in the mean over a face the pyramid is looked at in its middle, where texels are largest: half the
/// logarithm of 6 ÷ π.
const MIDDLE_IS_FINER: f64 = 0.467;
/// Blocks along a cube edge, as in the shader, and bytes of a block.
const BLOCK_EDGE: u32 = 8;
const BLOCK_BYTES: u32 = 32;
/// Blocks of a face.
pub(super) const FACE_BLOCKS: usize = (BLOCK_EDGE * BLOCK_EDGE) as usize;
/// Largest edge length that the blocks are gathered from.
const MAX_GATHER_EDGE: u32 = 64;
/// Glossy levels up to this edge length are whole sums over the blocks, if their alpha is at least this.
const MAX_SUM_EDGE: u32 = 16;
const MIN_SUM_ALPHA: f64 = 0.2;

/// Mirror of `Taps` in `filter_pass.wgsl`.
#[derive(ShaderType, Clone)]
pub(super) struct TapsUniform {
    shares: Vec4,
    places: [Vec4; MAX_TAPS],
}

/// Solid angles of the blocks of a face in steradian, row by row. Each is a small difference of four angles, which a GPU need not
/// know that exactly.
fn block_angles() -> [Vec4; FACE_BLOCKS / 4] {
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(BLOCK_EDGE) - 1.0;
    // Antiderivative of the solid angle of a rectangle on the face plane z = 1 with a corner on the axis.
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    std::array::from_fn(|i| {
        let angle = |k: u32| {
            let (column, row) = ((4 * i as u32 + k) % BLOCK_EDGE, (4 * i as u32 + k) / BLOCK_EDGE);
            let (left, right, top, bottom) = (at(column), at(column + 1), at(row), at(row + 1));
            (corner(right, bottom) + corner(left, top) - corner(left, bottom) - corner(right, top)) as f32
        };
        Vec4::new(angle(0), angle(1), angle(2), angle(3))
    })
}

/// Workgroups of one thread for each texel of a cube.
fn texel_groups(edge: u32) -> UVec3 {
    UVec2::splat(edge.div_ceil(WORKGROUP)).extend(6)
}

/// Workgroups of one thread for each of a number of quads.
fn quad_groups(quads: u32) -> UVec3 {
    UVec3::new(quads.div_ceil(QUAD_WORKGROUP), 1, 1)
}

/// Workgroups of one thread for each texel of padded faces.
fn padded_groups(faces: &Texture) -> UVec3 {
    UVec3::new((faces.width() * faces.height()).div_ceil(ROW_WORKGROUP), 1, 6)
}

/// Quads of a face.
fn quads(edge: u32) -> u32 {
    edge * edge / QUAD
}

/// What filters are made with.
pub(super) struct FilterMaker<'a> {
    pub(super) pipelines: &'a FilterPipelines,
    pub(super) cache: &'a PipelineCache,
    pub(super) device: &'a RenderDevice,
    pub(super) queue: &'a RenderQueue,
}

impl FilterMaker<'_> {
    /// `None` while a texture is missing.
    pub(super) fn make(
        &self,
        environment: &FilteredEnvironment,
        source: &GpuImage,
        images: &RenderAssets<GpuImage>,
    ) -> Option<Filter> {
        let shown = [images.get(&environment.diffuse)?, images.get(&environment.glossy)?];
        let mut dispatches = Vec::new();
        let mut viewpoint = None;
        let cube = match &environment.resampled {
            Some(resampled) => {
                let resampled = images.get(resampled)?;
                let place = environment.viewpoint.unwrap_or_default();
                let mut buffer = UniformBuffer::from(place);
                buffer.set_label(Some("mirrorball_environment_viewpoint"));
                buffer.write_buffer(self.device, self.queue);
                let buffer = buffer.buffer()?.clone();
                dispatches.push(self.resample(environment.shape, source, &resampled.texture, &buffer));
                viewpoint = environment.viewpoint.map(|place| (place, buffer));
                resampled
            }
            None => source,
        };
        let (made, publish) = match &environment.draft {
            Some([diffuse, glossy]) => {
                let draft = [images.get(diffuse)?, images.get(glossy)?];
                (draft, draft.iter().zip(shown).map(|(a, b)| (a.texture.clone(), b.texture.clone())).collect())
            }
            None => (shown, Vec::new()),
        };
        let [diffuse, glossy] = made.map(|image| &image.texture);
        let pyramid = self.pyramid(cube.texture.width());
        self.push_pyramid(&cube.texture, &pyramid, glossy, &mut dispatches);
        let blocks = self.device.create_buffer(&BufferDescriptor {
            label: Some("mirrorball_environment_blocks"),
            size: u64::from(6 * BLOCK_EDGE * BLOCK_EDGE * BLOCK_BYTES),
            usage: BufferUsages::STORAGE | BufferUsages::UNIFORM,
            mapped_at_creation: false,
        });
        // The cube or its pyramid where it has at most this edge length.
        let level_of = |max_edge: u32| match (cube.texture.width() / max_edge).max(1).ilog2() {
            0 => texels(&cube.texture, 0),
            level => texels(&pyramid[level as usize - 1], 0),
        };
        let mut angles = UniformBuffer::from(block_angles());
        angles.set_label(Some("mirrorball_environment_block_angles"));
        angles.write_buffer(self.device, self.queue);
        dispatches.push(self.dispatch(
            &self.pipelines.gather_blocks,
            &[(0, view(&level_of(MAX_GATHER_EDGE))), (8, blocks.as_entire_binding()), (19, angles.binding()?)],
            texel_groups(BLOCK_EDGE),
        ));
        let edge = glossy.width();
        if edge != cube.texture.width() {
            let (input, output) = (level_of(edge), texels(glossy, 0));
            let bindings = [(0, view(&input)), (5, view(&output))];
            dispatches.push(self.dispatch(&self.pipelines.sharpest, &bindings, texel_groups(edge)));
        }
        let capture = dispatches.len();
        dispatches.push(self.dispatch(
            &self.pipelines.diffuse,
            &[(5, view(&texels(diffuse, 0))), (14, blocks.as_entire_binding())],
            quad_groups(quads(diffuse.width())).with_z(3),
        ));
        // Rougher levels first: they are tails of sharper ones.
        for level in (1..glossy.mip_level_count()).rev() {
            let cube_edge = cube.texture.width();
            self.push_glossy_level(cube_edge, &pyramid, glossy, level, &blocks, &mut dispatches)?;
        }
        let budget = match environment.refresh {
            Refresh::Budget { dispatches } => dispatches.max(1) as usize,
            _ => usize::MAX,
        };
        Some(Filter {
            made_from: source.texture_view.id(),
            source: environment.source.id(),
            dispatches,
            viewpoint,
            capture,
            budget,
            publish,
            progress: environment.progress.clone(),
            next: 0,
            answered: None,
        })
    }

    /// Padded faces of the source in half its resolution and less: they are read between texels, also across edges.
    fn pyramid(&self, cube_edge: u32) -> Vec<Texture> {
        let finest = (cube_edge / 2).max(ROUGHEST_EDGE);
        let edges = (0..=(finest / ROUGHEST_EDGE).ilog2()).map(|level| finest >> level);
        edges.map(|edge| self.padded_faces("mirrorball_environment_pyramid", edge)).collect()
    }

    fn push_pyramid(&self, cube: &Texture, pyramid: &[Texture], glossy: &Texture, dispatches: &mut Vec<Dispatch>) {
        for (level, coarser) in pyramid.iter().enumerate() {
            let groups = padded_groups(coarser);
            let output = texels(coarser, 0);
            dispatches.push(match level.checked_sub(1) {
                None if glossy.width() == cube.width() => {
                    let (finer, copy) = (texels(cube, 0), texels(glossy, 0));
                    let bindings = [(0, view(&finer)), (1, view(&output)), (5, view(&copy))];
                    self.dispatch(&self.pipelines.halve_and_copy, &bindings, groups)
                }
                None => {
                    let finer = texels(cube, 0);
                    self.dispatch(&self.pipelines.halve, &[(0, view(&finer)), (1, view(&output))], groups)
                }
                Some(above) => {
                    let finer = texels(&pyramid[above], 0);
                    let bindings =
                        [(0, view(&finer)), (1, view(&output)), (3, BindingResource::Sampler(&self.pipelines.sampler))];
                    self.dispatch(&self.pipelines.smooth_halve, &bindings, groups)
                }
            });
        }
    }

    fn push_glossy_level(
        &self,
        cube_edge: u32,
        pyramid: &[Texture],
        glossy: &Texture,
        level: u32,
        blocks: &Buffer,
        dispatches: &mut Vec<Dispatch>,
    ) -> Option<()> {
        let last = glossy.mip_level_count() - 1;
        let alpha = |level: u32| (f64::from(level) / f64::from(last)).powi(2);
        let edge = glossy.width() >> level;
        let output = texels(glossy, level);
        if level == last || edge <= MAX_SUM_EDGE && alpha(level) >= MIN_SUM_ALPHA {
            let alpha = self.number("mirrorball_environment_alpha", alpha(level))?;
            let bindings = [(5, view(&output)), (12, alpha.as_entire_binding()), (14, blocks.as_entire_binding())];
            dispatches.push(self.dispatch(&self.pipelines.glossy_sum, &bindings, quad_groups(6 * quads(edge))));
            return Some(());
        }
        let set = TapSet::for_edge(edge);
        let lobe = lobe::fit(alpha(level), alpha(level + 1), set.rings(), cube_edge, edge);
        let sampler = BindingResource::Sampler(&self.pipelines.sampler);
        let mut taps = TapsUniform { shares: lobe.shares, places: [Vec4::ZERO; MAX_TAPS] };
        taps.places.iter_mut().zip(lobe.places).for_each(|(place, tap)| *place = tap.extend(0.0));
        let mut evened = Vec::new();
        for reading in &lobe.readings {
            let faces = self.padded_faces("mirrorball_environment_even", reading.edge);
            dispatches.push(self.even_out(pyramid, reading, &faces)?);
            evened.push(texels(&faces, 0));
        }
        let mut taps = UniformBuffer::from(taps);
        taps.set_label(Some("mirrorball_environment_taps"));
        taps.write_buffer(self.device, self.queue);
        let rougher = texels(glossy, level + 1);
        // A ring that a set does not have has no taps.
        let even = |ring: usize| evened.get(ring).or(evened.last()).map(view);
        let bindings = [
            (3, sampler),
            (5, view(&output)),
            (6, taps.binding()?),
            (7, view(&rougher)),
            (15, even(0)?),
            (16, even(1)?),
            (17, even(2)?),
        ];
        let step = match set {
            TapSet::Few => &self.pipelines.few_taps,
            TapSet::Many => &self.pipelines.many_taps,
        };
        dispatches.push(self.dispatch(step, &bindings, texel_groups(edge)));
        Some(())
    }

    /// Makes what the taps of a ring read.
    fn even_out(&self, pyramid: &[Texture], reading: &Reading, faces: &Texture) -> Option<Dispatch> {
        let last = pyramid.len() - 1;
        // The level to look at grows over a face by 1.2, from the middle to the corners. Three bound levels reach that far but
        // for at most 0.2 of a level in the corners.
        let first = (reading.level - MIDDLE_IS_FINER).floor().clamp(0.0, last as f64);
        let reach = (last as f64 - first).min(2.0);
        let sharpness = Vec2::new((reading.level - first) as f32, reach as f32);
        let mut uniform = UniformBuffer::from(sharpness);
        uniform.set_label(Some("mirrorball_environment_sharpness"));
        uniform.write_buffer(self.device, self.queue);
        let levels = [0, 1, 2].map(|i| texels(&pyramid[(first as usize + i).min(last)], 0));
        let output = texels(faces, 0);
        let bindings = [
            (3, BindingResource::Sampler(&self.pipelines.sampler)),
            (4, view(&levels[0])),
            (5, view(&output)),
            (18, uniform.binding()?),
            (20, view(&levels[1])),
            (21, view(&levels[2])),
        ];
        Some(self.dispatch(&self.pipelines.even_out, &bindings, padded_groups(faces)))
    }

    /// Six faces with a texel of their neighbors around each.
    fn padded_faces(&self, label: &'static str, edge: u32) -> Texture {
        let padded = edge + 2 * PADDING;
        self.device.create_texture(&TextureDescriptor {
            label: Some(label),
            size: Extent3d { width: padded, height: padded, depth_or_array_layers: 6 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING,
            view_formats: &[],
        })
    }

    /// A uniform of one number.
    fn number(&self, label: &'static str, value: f64) -> Option<Buffer> {
        let mut buffer = UniformBuffer::from(value as f32);
        buffer.set_label(Some(label));
        buffer.write_buffer(self.device, self.queue);
        buffer.buffer().cloned()
    }

    fn resample(&self, shape: SourceShape, source: &GpuImage, cube: &Texture, viewpoint: &Buffer) -> Dispatch {
        let (binding, dimension, step) = match shape {
            SourceShape::Equirect(_) => (9, TextureViewDimension::D2, &self.pipelines.resample_equirect),
            SourceShape::Cube(_) => (10, TextureViewDimension::D2Array, &self.pipelines.resample_cube),
        };
        let (picture, output) = (single_level(&source.texture, 0, dimension), texels(cube, 0));
        let bindings = [(1, view(&output)), (binding, view(&picture)), (13, viewpoint.as_entire_binding())];
        self.dispatch(step, &bindings, texel_groups(cube.width()))
    }

    fn dispatch(&self, step: &Step, bindings: &[(u32, BindingResource)], groups: UVec3) -> Dispatch {
        let entries: Vec<_> = bindings
            .iter()
            .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.clone() })
            .collect();
        let layout = self.cache.get_bind_group_layout(&step.layout);
        let bind_group = self.device.create_bind_group("mirrorball_environment_bind_group", &layout, &entries);
        Dispatch { pipeline: step.id, bind_group, groups }
    }
}

fn view(view: &TextureView) -> BindingResource<'_> {
    BindingResource::TextureView(view)
}

/// One level of a cube as an array of six layers.
fn texels(texture: &Texture, level: u32) -> TextureView {
    single_level(texture, level, TextureViewDimension::D2Array)
}

fn single_level(texture: &Texture, level: u32, dimension: TextureViewDimension) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        label: Some("mirrorball_environment_level"),
        dimension: Some(dimension),
        base_mip_level: level,
        mip_level_count: Some(1),
        ..default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blocks_of_a_face_cover_a_sixth_of_the_sphere() {
        let sum: f32 = block_angles().iter().map(|angles| angles.element_sum()).sum();
        assert!((sum - 4.0 * std::f32::consts::PI / 6.0).abs() < 1e-5, "{sum}");
    }
}
