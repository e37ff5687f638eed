//! Choice of the fallback that lights a camera's scene: it is loaded or fitted, and fades out once probes are measured.

use super::{
    clip_recovery::ClipRecovery,
    fallback::{EnvironmentFallback, EnvironmentOrigin, FallbackImage},
    light_probe_sphere::LightProbeSphere,
    paper::paper_radiance,
    probe_camera::LensView,
    probe_measurement::ProbeMeasurement,
    sky_gradient::SkyGradient,
};
use crate::{
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace, world_from_camera},
    environment_map::{EnvironmentCube, EnvironmentFileError, EquirectPixels, equirect_direction},
    relative_paths::locate,
    tracking::SeenMarker,
};
use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::{
        render_resource::{Extent3d, TextureDimension, TextureFormat},
        renderer::RenderDevice,
    },
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};
use std::path::PathBuf;

/// Size of the texture of a fitted sky, in texels.
const GRADIENT_SIZE: UVec2 = UVec2::new(128, 64);

/// Fallback file that is being loaded.
#[derive(Component)]
pub(super) struct FallbackFile(Task<Option<(EnvironmentOrigin, EquirectPixels)>>);

fn open_files(
    saved: Option<PathBuf>,
    file: Option<PathBuf>,
    max_edge: u32,
) -> Option<(EnvironmentOrigin, EquirectPixels)> {
    let open = |path: PathBuf, origin| match EquirectPixels::open(&path) {
        Ok(pixels) => {
            let (size, fitting) = (pixels.size, pixels.limited_to(max_edge));
            if fitting.size != size {
                warn!(
                    "EnvironmentFallback: {} of {} × {} pixels is larger than the textures of this device, which end at \
                     {max_edge}; it is scaled down to {} × {}",
                    path.display(),
                    size.x,
                    size.y,
                    fitting.size.x,
                    fitting.size.y
                );
            }
            Some((origin, fitting))
        }
        Err(EnvironmentFileError::Read { .. }) if origin == EnvironmentOrigin::Saved && !path.exists() => None,
        Err(error) => {
            warn!("EnvironmentFallback: {error}; the next choice is taken");
            None
        }
    };
    let saved = saved.and_then(|path| open(path, EnvironmentOrigin::Saved));
    let shipped = file.map(|path| locate(&path).unwrap_or(path));
    saved.or_else(|| shipped.and_then(|path| open(path, EnvironmentOrigin::File)))
}

fn texture(size: UVec2, texels: impl Iterator<Item = Vec3>) -> Image {
    let max = Vec3::splat(half::f16::MAX.to_f32());
    let bytes = texels
        .flat_map(|texel| texel.clamp(Vec3::ZERO, max).extend(1.0).to_array())
        .flat_map(|value| half::f16::from_f32(value).to_le_bytes());
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba16Float;
    let mut image = Image::new(extent, TextureDimension::D2, bytes.collect(), format, RenderAssetUsages::RENDER_WORLD);
    image.texture_descriptor.label = Some("mirrorball_probe_fallback");
    image
}

fn gradient_texture(sky: &SkyGradient) -> Image {
    let uv = |i: u32| (UVec2::new(i % GRADIENT_SIZE.x, i / GRADIENT_SIZE.x).as_vec2() + 0.5) / GRADIENT_SIZE.as_vec2();
    let texels = (0..GRADIENT_SIZE.element_product()).map(|i| sky.radiance(equirect_direction(uv(i))));
    texture(GRADIENT_SIZE, texels)
}

type FallbackCamera = (
    Entity,
    Ref<'static, EnvironmentFallback>,
    &'static ArCamera,
    Option<&'static CameraFrame>,
    Option<&'static CameraFeed>,
    &'static GlobalTransform,
    &'static mut EnvironmentOrigin,
    Option<&'static mut FallbackImage>,
    Option<&'static mut FallbackFile>,
);
type SeenProbes<'w, 's> = Query<'w, 's, &'static ProbeMeasurement, (With<LightProbeSphere>, With<EnvironmentCube>)>;

pub(super) fn choose_fallbacks(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    mut cameras: Query<FallbackCamera, With<EnvironmentCube>>,
    probes: SeenProbes,
    lenses: Query<(), With<LensView>>,
    markers: Query<SeenMarker>,
    time: Res<Time<Real>>,
    device: Option<Res<RenderDevice>>,
) {
    let max_edge = device.map_or(u32::MAX, |device| device.limits().max_texture_dimension_2d);
    // All cameras share the measured environment.
    let is_measured = !lenses.is_empty()
        || probes.iter().any(|measurement| measurement.view.is_some())
        || cameras.iter().any(|(.., origin, _, _)| *origin == EnvironmentOrigin::Measured);
    for (entity, fallback, camera, frame, feed, place, mut origin, image, file) in &mut cameras {
        let is_lockstep = feed.is_some_and(|feed| feed.pace() == FeedPace::Lockstep);
        // A measured environment stays when its ball is gone.
        if is_measured || *origin == EnvironmentOrigin::Measured {
            origin.set_if_neq(EnvironmentOrigin::Measured);
            let Some(mut image) = image else { continue };
            if image.measured_fraction >= 1.0 {
                commands.entity(entity).remove::<FallbackImage>();
                continue;
            }
            let since = *image.measured_since.get_or_insert(time.elapsed());
            let gone = (time.elapsed() - since).as_secs_f32() / fallback.fade.as_secs_f32().max(1e-3);
            image.measured_fraction = if is_lockstep { 1.0 } else { gone.min(1.0) };
            continue;
        }
        let is_asked = fallback.saved.is_some() || fallback.file.is_some();
        if fallback.is_changed() && is_asked {
            let (saved, path) = (fallback.saved.clone(), fallback.file.clone());
            if !is_lockstep {
                let task = AsyncComputeTaskPool::get().spawn(async move { open_files(saved, path, max_edge) });
                commands.entity(entity).insert(FallbackFile(task));
            } else if let Some(found) = open_files(saved, path, max_edge) {
                take_file(&mut commands, &mut images, entity, &mut origin, image.as_deref(), found);
                continue;
            }
        }
        if let Some(answer) = file.and_then(|mut file| check_ready(&mut file.0)) {
            commands.entity(entity).remove::<FallbackFile>();
            if let Some(found) = answer {
                take_file(&mut commands, &mut images, entity, &mut origin, image.as_deref(), found);
                continue;
            }
        }
        if matches!(*origin, EnvironmentOrigin::File | EnvironmentOrigin::Saved) {
            continue;
        }
        let fitted = frame.and_then(|frame| fit_sky(entity, camera, frame, place, &markers));
        origin.set_if_neq(if fitted.is_some() { EnvironmentOrigin::FittedSky } else { EnvironmentOrigin::Unknown });
        let sky = fitted.unwrap_or(SkyGradient::UNKNOWN);
        match image {
            Some(image) if image.gradient.is_some_and(|old| old.is_like(&sky)) => (),
            Some(mut image) => {
                image.image = images.add(gradient_texture(&sky));
                image.version += 1;
                image.gradient = Some(sky);
            }
            None => {
                let image = images.add(gradient_texture(&sky));
                commands.entity(entity).insert(FallbackImage::new(image, GRADIENT_SIZE, 0, Some(sky)));
            }
        }
    }
}

fn take_file(
    commands: &mut Commands,
    images: &mut Assets<Image>,
    entity: Entity,
    origin: &mut Mut<EnvironmentOrigin>,
    old: Option<&FallbackImage>,
    (from, pixels): (EnvironmentOrigin, EquirectPixels),
) {
    let image = images.add(texture(pixels.size, pixels.texels.iter().copied()));
    let version = old.map_or(0, |old| old.version + 1);
    commands.entity(entity).insert(FallbackImage::new(image, pixels.size, version, None));
    origin.set_if_neq(from);
}

/// Number of pixels along each axis to which a sky is fitted.
const GRID: UVec2 = UVec2::new(24, 16);

fn fit_sky(
    entity: Entity,
    camera: &ArCamera,
    frame: &CameraFrame,
    place: &GlobalTransform,
    markers: &Query<SeenMarker>,
) -> Option<SkyGradient> {
    let intrinsics = camera.intrinsics_for(frame);
    let world_from_camera = world_from_camera(place);
    let parts = (0..GRID.element_product()).map(|i| {
        let cell = (UVec2::new(i % GRID.x, i / GRID.x).as_vec2() + 0.5) / GRID.as_vec2();
        let pixel = cell * frame.pixels.size.as_vec2();
        let dir = world_from_camera.transform_vector3(intrinsics.ray(pixel)).normalize();
        (dir, frame.pixels.linear(pixel.x as i32, pixel.y as i32))
    });
    let marker = markers.iter().find_map(|marker| {
        let (pose, size) = marker.paper_in(entity, frame.sequence)?;
        let paper = paper_radiance(&frame.pixels, &intrinsics, &pose, size)?;
        let up = world_from_camera.transform_vector3(pose.transform_vector3(Vec3::Y)).normalize();
        Some((up, paper / ClipRecovery::default().paper_reflectance))
    });
    let up = marker.map_or(Vec3::Y, |(up, _)| up);
    SkyGradient::fit(parts, up, marker.map(|(_, light)| light))
}
