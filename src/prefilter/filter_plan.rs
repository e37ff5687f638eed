//! Plan of one filter: the dispatches, bind groups and tables for one environment.

use super::{
    convolve::BlockSums,
    dispatch::{Dispatch, DispatchBuilder},
    downsample::Pyramid,
    filtered_environment::FilteredEnvironment,
    refresh::{Progress, Refresh},
    resample::resample,
    taps::{SpecularLevel, push_specular_taps},
};
use bevy::{
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{Buffer, Texture, TextureViewId},
        renderer::RenderQueue,
        texture::GpuImage,
    },
};

/// Maximum edge length of specular levels that are full sums over the blocks, if alpha is at least [`MIN_SUM_ALPHA`].
const MAX_SUM_EDGE: u32 = 16;
const MIN_SUM_ALPHA: f64 = 0.2;

/// Everything that filtering one environment takes. Made once, and kept as long as its textures live.
pub(super) struct FilterPlan {
    /// View of the source that the plan was made for.
    pub(super) made_from: TextureViewId,
    pub(super) source: AssetId<Image>,
    pub(super) dispatches: Vec<Dispatch>,
    /// `FilteredEnvironment::viewpoint` as of the last write to its buffer.
    viewpoint: Option<(Vec4, Buffer)>,
    /// Number of dispatches at the start that read the source and belong in one frame.
    capture: usize,
    /// Dispatches per frame.
    budget: usize,
    /// Drafts and the maps that they are copied into when a set is complete.
    pub(super) publish: Vec<(Texture, Texture)>,
    pub(super) progress: Progress,
    /// Index of the next dispatch of the current set; 0 between sets.
    pub(super) next: usize,
    /// The request that the last set answered, and the number of writes to the source at that time.
    pub(super) answered: Option<(u32, u32)>,
}

/// Diffuse and specular map.
type Maps<'a> = [&'a GpuImage; 2];

impl FilterPlan {
    /// Plans the filter of an environment. `None` while a texture is missing.
    pub(super) fn new(
        builder: &DispatchBuilder,
        environment: &FilteredEnvironment,
        source: &GpuImage,
        images: &RenderAssets<GpuImage>,
    ) -> Option<Self> {
        let mut dispatches = Vec::new();
        let shown = [images.get(&environment.diffuse)?, images.get(&environment.specular)?];
        let (cube, viewpoint) = push_resampling(builder, environment, source, images, &mut dispatches)?;
        let (made, publish) = made_maps(environment, shown, images)?;
        let [diffuse, specular] = made.map(|image| &image.texture);
        let cube_edge = cube.width();
        let pyramid = Pyramid::allocate(builder.device, cube_edge);
        pyramid.push_dispatches(builder, cube, specular, &mut dispatches);
        let blocks = BlockSums::new(builder);
        dispatches.push(blocks.gather(builder, cube, &pyramid)?);
        if specular.width() != cube_edge {
            dispatches.push(pyramid.copy_sharpest(builder, cube, specular));
        }
        let capture = dispatches.len();
        dispatches.push(blocks.diffuse(builder, diffuse));
        let last = specular.mip_level_count() - 1;
        let alpha = |level: u32| (f64::from(level) / f64::from(last)).powi(2);
        // Rougher levels first: they are the tails of sharper ones.
        for level in (1..=last).rev() {
            if level == last || specular.width() >> level <= MAX_SUM_EDGE && alpha(level) >= MIN_SUM_ALPHA {
                dispatches.push(blocks.specular(builder, environment.lobe, specular, level, alpha(level))?);
            } else {
                let rougher = alpha(level + 1);
                let lobe = environment.lobe;
                let level = SpecularLevel { map: specular, level, lobe, alpha: alpha(level), rougher };
                push_specular_taps(builder, cube_edge, &pyramid, &level, &mut dispatches)?;
            }
        }
        Some(Self {
            made_from: source.texture_view.id(),
            source: environment.source.id(),
            dispatches,
            viewpoint,
            capture,
            budget: match environment.refresh {
                Refresh::Budget { dispatches } => dispatches.max(1) as usize,
                _ => usize::MAX,
            },
            publish,
            progress: environment.progress.clone(),
            next: 0,
            answered: None,
        })
    }

    /// Index after the last dispatch of this frame.
    pub(super) fn end_of_frame(&self) -> usize {
        let count = match self.next {
            0 => self.budget.saturating_add(self.capture - 1),
            _ => self.budget,
        };
        self.next.saturating_add(count).min(self.dispatches.len())
    }

    /// Writes a changed viewpoint into its buffer.
    pub(super) fn move_viewpoint(&mut self, to: Option<Vec4>, queue: &RenderQueue) {
        if let (Some((viewpoint, buffer)), Some(to)) = (&mut self.viewpoint, to)
            && *viewpoint != to
        {
            *viewpoint = to;
            let mut bytes = [0; 16];
            bytes.chunks_exact_mut(4).zip(to.to_array()).for_each(|(bytes, v)| bytes.copy_from_slice(&v.to_le_bytes()));
            queue.write_buffer(buffer, 0, &bytes);
        }
    }
}

/// Cube to filter, the source itself or the resampled source, and the viewpoint with its buffer if there is one.
fn push_resampling<'a>(
    builder: &DispatchBuilder,
    environment: &FilteredEnvironment,
    source: &'a GpuImage,
    images: &'a RenderAssets<GpuImage>,
    dispatches: &mut Vec<Dispatch>,
) -> Option<(&'a Texture, Option<(Vec4, Buffer)>)> {
    let Some(resampled) = &environment.resampled else {
        return Some((&source.texture, None));
    };
    let cube = &images.get(resampled)?.texture;
    let buffer = builder.uniform("mirrorball_environment_viewpoint", environment.viewpoint.unwrap_or_default())?;
    dispatches.push(resample(builder, environment.shape, source, cube, &buffer));
    Some((cube, environment.viewpoint.map(|viewpoint| (viewpoint, buffer))))
}

/// Maps that the dispatches write, which are drafts if a set takes several frames, and the copies that publish them.
fn made_maps<'a>(
    environment: &FilteredEnvironment,
    shown: Maps<'a>,
    images: &'a RenderAssets<GpuImage>,
) -> Option<(Maps<'a>, Vec<(Texture, Texture)>)> {
    let Some([diffuse, specular]) = &environment.draft else {
        return Some((shown, Vec::new()));
    };
    let draft = [images.get(diffuse)?, images.get(specular)?];
    Some((draft, draft.iter().zip(shown).map(|(a, b)| (a.texture.clone(), b.texture.clone())).collect()))
}
