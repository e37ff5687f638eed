//! Recorded clips as assets: wherever Bevy's assets come from, a browser's network included.

use super::{CameraError, Clip};
use bevy::{
    asset::{AssetLoader, AssetPath, LoadContext, LoadState, ReadAssetBytesError, io::Reader},
    ecs::system::SystemParam,
    prelude::*,
};
use std::{path::PathBuf, sync::Arc};

/// A recorded clip with the bytes of its images, for [`CameraFeed::clip_asset`](super::CameraFeed::clip_asset): loaded
/// from its sidecar `clip.json`, which has to list the `files` (see [`Clip`]). They stay encoded in memory.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, assets: Res<AssetServer>) {
/// // in the folder `assets`, or where the page of a game in a browser has it
/// commands.spawn((ArCamera::default(), CameraFeed::clip_asset(assets.load("desk_clip/clip.json"))));
/// # }
/// ```
#[derive(Asset, TypePath, Clone, Debug)]
pub struct ClipAsset {
    pub(super) clip: Clip,
    /// Bytes of the clip's files, in their order.
    pub(super) images: Vec<Arc<[u8]>>,
}

impl ClipAsset {
    /// What the sidecar says.
    pub fn clip(&self) -> &Clip {
        &self.clip
    }
}

/// Error on loading a clip as an asset.
#[derive(thiserror::Error, Debug)]
pub(super) enum ClipAssetError {
    #[error(transparent)]
    Clip(#[from] CameraError),
    #[error("cannot read the sidecar: {0}")]
    Sidecar(#[from] std::io::Error),
    #[error("the sidecar is not UTF-8: {0}")]
    Text(#[from] std::str::Utf8Error),
    #[error("cannot read {file}, which \"files\" in the sidecar lists: {source}")]
    Image { file: PathBuf, source: Box<ReadAssetBytesError> },
}

#[derive(Default, TypePath)]
pub(super) struct ClipAssetLoader;

impl AssetLoader for ClipAssetLoader {
    type Asset = ClipAsset;
    type Settings = ();
    type Error = ClipAssetError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        context: &mut LoadContext<'_>,
    ) -> Result<ClipAsset, ClipAssetError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let path = context.path().clone();
        let clip = Clip::parse(std::str::from_utf8(&bytes)?, path.path())?;
        let mut images = Vec::with_capacity(clip.files.len());
        for file in &clip.files {
            let image = AssetPath::from_path_buf(file.clone()).with_source(path.source().clone_owned());
            match context.read_asset_bytes(image).await {
                Ok(bytes) => images.push(bytes.into()),
                Err(source) => {
                    return Err(ClipAssetError::Image { file: file.clone(), source: Box::new(source) });
                }
            }
        }
        Ok(ClipAsset { clip, images })
    }

    // Clips are loaded as such, whatever their sidecars are called: JSON files may be anything.
    fn extensions(&self) -> &[&str] {
        &[]
    }
}

/// Lets an app that has assets load clips.
pub(super) fn build(app: &mut App) {
    if app.world().contains_resource::<AssetServer>() {
        app.init_asset::<ClipAsset>().register_asset_loader(ClipAssetLoader);
    }
}

/// The clips that are loaded.
#[derive(SystemParam)]
pub(super) struct LoadedClips<'w> {
    clips: Option<Res<'w, Assets<ClipAsset>>>,
    server: Option<Res<'w, AssetServer>>,
}

impl LoadedClips<'_> {
    /// A clip, or `None` while it is loading.
    pub(super) fn get(&self, handle: &Handle<ClipAsset>) -> Result<Option<ClipAsset>, CameraError> {
        if let Some(clip) = self.clips.as_ref().and_then(|clips| clips.get(handle)) {
            return Ok(Some(clip.clone()));
        }
        let failed = |reason: String| CameraError::ClipAsset { reason };
        let server = self.server.as_ref().ok_or_else(|| failed("the app has no AssetServer".to_owned()))?;
        match server.get_load_state(handle) {
            Some(LoadState::Failed(error)) => Err(failed(error.to_string())),
            _ => Ok(None),
        }
    }
}

/// Marks a feed that waits until its clip is loaded.
#[derive(Component)]
pub(super) struct AwaitsClip;
