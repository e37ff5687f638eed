//! Makes the dispatches, bind groups and tables that filter one environment.

use super::{
    FilteredEnvironment, Refresh,
    filter::{Dispatch, Filter},
    lobe::{self, MAX_TAPS, TapSet},
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
/// Blocks along a cube edge, as in the shader, and bytes of a block.
const BLOCK_EDGE: u32 = 8;
const BLOCK_BYTES: u32 = 32;
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

/// Workgroups of one thread for each texel of a cube.
fn texel_groups(edge: u32) -> UVec3 {
    UVec2::splat(edge.div_ceil(WORKGROUP)).extend(6)
}

/// Workgroups of one thread for each of a number of quads.
fn quad_groups(quads: u32) -> UVec3 {
    UVec3::new(quads.div_ceil(QUAD_WORKGROUP), 1, 1)
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
        let pyramid = images.get(&environment.pyramid)?;
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
        self.push_pyramid(&cube.texture, pyramid, glossy, &mut dispatches);
        let blocks = self.device.create_buffer(&BufferDescriptor {
            label: Some("mirrorball_environment_blocks"),
            size: u64::from(6 * BLOCK_EDGE * BLOCK_EDGE * BLOCK_BYTES),
            usage: BufferUsages::STORAGE | BufferUsages::UNIFORM,
            mapped_at_creation: false,
        });
        // The cube or its pyramid where it has at most this edge length.
        let level_of = |max_edge: u32| match (cube.texture.width() / max_edge).max(1).ilog2() {
            0 => texels(&cube.texture, 0),
            level => texels(&pyramid.texture, level - 1),
        };
        dispatches.push(self.dispatch(
            &self.pipelines.gather_blocks,
            &[(0, view(&level_of(MAX_GATHER_EDGE))), (8, blocks.as_entire_binding())],
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
            self.push_glossy_level(cube_edge, pyramid, glossy, level, &blocks, &mut dispatches)?;
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

    fn push_pyramid(&self, cube: &Texture, pyramid: &GpuImage, glossy: &Texture, dispatches: &mut Vec<Dispatch>) {
        for level in 0..pyramid.texture.mip_level_count() {
            let groups = texel_groups(pyramid.texture.width() >> level);
            let coarser = texels(&pyramid.texture, level);
            dispatches.push(match level.checked_sub(1) {
                None if glossy.width() == cube.width() && cube.width() == 2 * pyramid.texture.width() => {
                    let (finer, copy) = (texels(cube, 0), texels(glossy, 0));
                    let bindings = [(0, view(&finer)), (1, view(&coarser)), (5, view(&copy))];
                    self.dispatch(&self.pipelines.halve_and_copy, &bindings, groups)
                }
                None => {
                    let finer = texels(cube, 0);
                    self.dispatch(&self.pipelines.halve, &[(0, view(&finer)), (1, view(&coarser))], groups)
                }
                Some(above) => {
                    let finer = cube_level(&pyramid.texture, above);
                    let bindings =
                        [(1, view(&coarser)), (2, view(&finer)), (3, BindingResource::Sampler(&pyramid.sampler))];
                    self.dispatch(&self.pipelines.smooth_halve, &bindings, groups)
                }
            });
        }
    }

    fn push_glossy_level(
        &self,
        cube_edge: u32,
        pyramid: &GpuImage,
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
        let whole = pyramid.texture.create_view(&TextureViewDescriptor {
            label: Some("mirrorball_environment_pyramid"),
            dimension: Some(TextureViewDimension::Cube),
            ..default()
        });
        let sampler = BindingResource::Sampler(&pyramid.sampler);
        let mut taps = TapsUniform { shares: lobe.shares, places: [Vec4::ZERO; MAX_TAPS] };
        taps.places.iter_mut().zip(lobe.places).for_each(|(place, tap)| *place = tap.extend(0.0));
        let mut evened = Vec::new();
        for reading in &lobe.readings {
            let texture = self.even_cube(reading.edge);
            let sharpness_level = self.number("mirrorball_environment_sharpness_level", reading.level)?;
            let even = texels(&texture, 0);
            let bindings =
                [(3, sampler.clone()), (4, view(&whole)), (5, view(&even)), (18, sharpness_level.as_entire_binding())];
            dispatches.push(self.dispatch(&self.pipelines.even_out, &bindings, texel_groups(reading.edge)));
            evened.push(cube_level(&texture, 0));
        }
        let mut taps = UniformBuffer::from(taps);
        taps.set_label(Some("mirrorball_environment_taps"));
        taps.write_buffer(self.device, self.queue);
        let rougher = cube_level(glossy, level + 1);
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

    /// What the taps of a ring read.
    fn even_cube(&self, edge: u32) -> Texture {
        self.device.create_texture(&TextureDescriptor {
            label: Some("mirrorball_environment_even"),
            size: Extent3d { width: edge, height: edge, depth_or_array_layers: 6 },
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
        let picture = |dimension| {
            source.texture.create_view(&TextureViewDescriptor {
                label: Some("mirrorball_environment_source"),
                dimension: Some(dimension),
                mip_level_count: Some(1),
                ..default()
            })
        };
        let output = texels(cube, 0);
        let groups = texel_groups(cube.width());
        match shape {
            SourceShape::Equirect(_) => {
                let picture = picture(TextureViewDimension::D2);
                let bindings = [(1, view(&output)), (9, view(&picture)), (13, viewpoint.as_entire_binding())];
                self.dispatch(&self.pipelines.resample_equirect, &bindings, groups)
            }
            SourceShape::Cube(_) => {
                let picture = picture(TextureViewDimension::Cube);
                let bindings = [
                    (1, view(&output)),
                    (10, view(&picture)),
                    (11, BindingResource::Sampler(&source.sampler)),
                    (13, viewpoint.as_entire_binding()),
                ];
                self.dispatch(&self.pipelines.resample_cube, &bindings, groups)
            }
        }
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

/// One level of a cube, by direction.
fn cube_level(texture: &Texture, level: u32) -> TextureView {
    single_level(texture, level, TextureViewDimension::Cube)
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
