//! Light while nothing has been measured: the map saved last, a file, or a sky fitted to what the camera shows.

use super::{EnvironmentCube, LightProbeSphere, ProbeMeasurement, probe_camera::LensView, recovery};
use crate::{
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace},
    environment_map::{EnvironmentFileError, EquirectPixels, equirect_direction},
    tracking::{MarkerAnchor, MarkerTracking},
};
use bevy::{
    asset::RenderAssetUsages,
    math::Affine3A,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    tasks::{AsyncComputeTaskPool, Task, block_on, futures::check_ready},
};
use std::{path::PathBuf, time::Duration};

/// What lights the scene of an [`ArCamera`] as long as no probe has been seen, so that virtual things are never black and a game
/// works without any ball. Every [`ArCamera`] has one; removed when the camera is spawned, there is no light before a measurement.
/// Cameras spawned with an [`EnvironmentMapLight`](bevy::light::EnvironmentMapLight) or a
/// [`LiveEnvironment`](crate::prefilter::LiveEnvironment) of the game's own keep that.
///
/// The first of these that exists: [`saved`](Self::saved), [`file`](Self::file), a sky fitted to the camera's picture and the
/// marker's paper, an even gray. [`EnvironmentOrigin`] beside it says which.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::EnvironmentFallback};
/// # fn setup(mut commands: Commands) {
/// let fallback = EnvironmentFallback { file: Some("assets/studio.hdr".into()), ..default() };
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip"), fallback));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(EnvironmentOrigin)]
pub struct EnvironmentFallback {
    /// Equirectangular Radiance or OpenEXR file that the game wrote when it last ran
    /// ([`EquirectPixels::save`](crate::environment_map::EquirectPixels::save)), camera units, world axes. It may be missing. Defaults to
    /// `None`.
    pub saved: Option<PathBuf>,
    /// Another such file, for the first time. A file that cannot be read is a warning. Defaults to `None`.
    pub file: Option<PathBuf>,
    /// How long the measured environment takes to replace it; with a feed in [lockstep](FeedPace::Lockstep) it does so at once.
    /// Defaults to half a second.
    pub fade: Duration,
}

impl Default for EnvironmentFallback {
    fn default() -> Self {
        Self { saved: None, file: None, fade: Duration::from_millis(500) }
    }
}

/// Where the light of an [`ArCamera`]'s scene comes from.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Component, Default, Debug, Clone, PartialEq, Hash)]
pub enum EnvironmentOrigin {
    /// An even gray: nothing is known.
    #[default]
    Unknown,
    /// A sky fitted to the camera's picture, and to the marker's paper if it is in view.
    FittedSky,
    /// [`EnvironmentFallback::file`].
    File,
    /// [`EnvironmentFallback::saved`].
    Saved,
    /// A ball or a probe camera. Once measured, an environment stays until something new is measured.
    Measured,
}

/// A sky of three colors.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct SkyGradient {
    /// Unit vector, world space.
    pub up: Vec3,
    /// Radiance straight above, linear camera units.
    pub zenith: Vec3,
    /// Radiance from all around.
    pub horizon: Vec3,
    /// Radiance from below.
    pub ground: Vec3,
}

/// Reflectance assumed of what is below the horizon where no paper tells how much light falls on it.
const ASSUMED_REFLECTANCE: f32 = 0.4;
/// Radiance of everything before the first picture.
const UNKNOWN_RADIANCE: f32 = 0.4;
/// Sine of the elevation up to which pixels count as horizon, and below which the ground has its own color.
const HORIZON: f32 = 0.2;
/// The zenith is at least this part of the mean sky.
const LEAST_ZENITH: f32 = 0.2;
/// Relative change from which on a sky is fitted anew.
const NEWS: f32 = 0.05;

impl SkyGradient {
    const UNKNOWN: Self = Self {
        up: Vec3::Y,
        zenith: Vec3::splat(UNKNOWN_RADIANCE),
        horizon: Vec3::splat(UNKNOWN_RADIANCE),
        ground: Vec3::splat(UNKNOWN_RADIANCE * ASSUMED_REFLECTANCE),
    };

    /// The sky that explains what is known: radiance and world directions (unit vectors) of parts of a picture, and the irradiance
    /// ÷ π on a horizontal surface, if known.
    pub fn fit(parts: impl Iterator<Item = (Vec3, Vec3)>, up: Vec3, irradiance_over_pi: Option<Vec3>) -> Option<Self> {
        let (mut all, mut horizon, mut ground, mut sky) = (Vec4::ZERO, Vec4::ZERO, Vec4::ZERO, Vec4::ZERO);
        for (dir, radiance) in parts {
            let (height, part) = (dir.dot(up), radiance.extend(1.0));
            all += part;
            if height.abs() < HORIZON {
                horizon += part;
            }
            if height < 0.0 {
                ground += part;
            } else {
                sky += part;
            }
        }
        let mean = |sum: Vec4| (sum.w > 0.0).then(|| sum.truncate() / sum.w);
        let ground = mean(ground).or(mean(all))?;
        let light = irradiance_over_pi.unwrap_or_else(|| mean(sky).unwrap_or(ground / ASSUMED_REFLECTANCE));
        // A horizontal surface gets π (horizon / 3 + 2 zenith / 3) of a sky that is linear in the sine of the elevation.
        let horizon = mean(horizon).or(mean(sky)).unwrap_or(light);
        let zenith = (1.5 * light - 0.5 * horizon).max(LEAST_ZENITH * light);
        Some(Self { up, zenith, horizon: (3.0 * light - 2.0 * zenith).max(Vec3::ZERO), ground })
    }

    /// Radiance from a direction (unit vector, world space).
    pub fn radiance(&self, dir: Vec3) -> Vec3 {
        let height = dir.dot(self.up);
        if height >= 0.0 {
            return self.horizon.lerp(self.zenith, height);
        }
        self.horizon.lerp(self.ground, (-height / HORIZON).min(1.0))
    }

    fn is_like(&self, other: &Self) -> bool {
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= NEWS * a.max(b).max_element();
        near(self.zenith, other.zenith)
            && near(self.horizon, other.horizon)
            && near(self.ground, other.ground)
            && self.up.dot(other.up) > 0.999
    }
}

/// The fallback as an equirectangular texture, beside the [`EnvironmentFallback`] while it is used.
#[derive(Component, Clone, Debug)]
pub(crate) struct FallbackPicture {
    pub image: Handle<Image>,
    pub size: UVec2,
    /// Counts up when the texture changes.
    pub version: u32,
    /// Part of the way to the measured environment that is gone, 0…1.
    pub share: f32,
    gradient: Option<SkyGradient>,
    measured_since: Option<Duration>,
}

impl FallbackPicture {
    fn new(image: Handle<Image>, size: UVec2, version: u32, gradient: Option<SkyGradient>) -> Self {
        Self { image, size, version, share: 0.0, gradient, measured_since: None }
    }
}

const GRADIENT_SIZE: UVec2 = UVec2::new(128, 64);

/// A file on its way.
#[derive(Component)]
pub(super) struct FallbackFile(Task<Option<(EnvironmentOrigin, EquirectPixels)>>);

fn open_files(saved: Option<PathBuf>, file: Option<PathBuf>) -> Option<(EnvironmentOrigin, EquirectPixels)> {
    let open = |path: PathBuf, origin| match EquirectPixels::open(&path) {
        Ok(picture) => Some((origin, picture)),
        Err(EnvironmentFileError::Read { .. }) if origin == EnvironmentOrigin::Saved && !path.exists() => None,
        Err(error) => {
            warn!("EnvironmentFallback: {error}; the next choice is taken");
            None
        }
    };
    let saved = saved.and_then(|path| open(path, EnvironmentOrigin::Saved));
    saved.or_else(|| file.and_then(|path| open(path, EnvironmentOrigin::File)))
}

fn texture(size: UVec2, texels: impl Iterator<Item = Vec3>) -> Image {
    let most = Vec3::splat(half::f16::MAX.to_f32());
    let bytes = texels
        .flat_map(|texel| texel.clamp(Vec3::ZERO, most).extend(1.0).to_array())
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
    Option<&'static mut FallbackPicture>,
    Option<&'static mut FallbackFile>,
);
type SeenProbes<'w, 's> = Query<'w, 's, &'static ProbeMeasurement, (With<LightProbeSphere>, With<EnvironmentCube>)>;

pub(super) fn choose_fallbacks(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    mut cameras: Query<FallbackCamera, With<EnvironmentCube>>,
    probes: SeenProbes,
    lenses: Query<(), With<LensView>>,
    anchors: Query<(&MarkerAnchor, &MarkerTracking)>,
    time: Res<Time<Real>>,
) {
    let is_measured = !lenses.is_empty() || probes.iter().any(|measurement| measurement.view.is_some());
    for (entity, fallback, camera, frame, feed, place, mut origin, picture, file) in &mut cameras {
        let is_lockstep = feed.is_some_and(|feed| feed.pace() == FeedPace::Lockstep);
        // What was measured stays when its ball is gone.
        if is_measured || *origin == EnvironmentOrigin::Measured {
            origin.set_if_neq(EnvironmentOrigin::Measured);
            let Some(mut picture) = picture else { continue };
            if picture.share >= 1.0 {
                commands.entity(entity).remove::<FallbackPicture>();
                continue;
            }
            let since = *picture.measured_since.get_or_insert(time.elapsed());
            let gone = (time.elapsed() - since).as_secs_f32() / fallback.fade.as_secs_f32().max(1e-3);
            picture.share = if is_lockstep { 1.0 } else { gone.min(1.0) };
            continue;
        }
        let is_asked = fallback.saved.is_some() || fallback.file.is_some();
        if fallback.is_changed() && is_asked {
            let (saved, path) = (fallback.saved.clone(), fallback.file.clone());
            let task = AsyncComputeTaskPool::get().spawn(async move { open_files(saved, path) });
            if !is_lockstep {
                commands.entity(entity).insert(FallbackFile(task));
            } else if let Some(found) = block_on(task) {
                take_file(&mut commands, &mut images, entity, &mut origin, picture.as_deref(), found);
                continue;
            }
        }
        if let Some(answer) = file.and_then(|mut file| check_ready(&mut file.0)) {
            commands.entity(entity).remove::<FallbackFile>();
            if let Some(found) = answer {
                take_file(&mut commands, &mut images, entity, &mut origin, picture.as_deref(), found);
                continue;
            }
        }
        if matches!(*origin, EnvironmentOrigin::File | EnvironmentOrigin::Saved) {
            continue;
        }
        let fitted = frame.and_then(|frame| fit_sky(camera, frame, place, &anchors));
        origin.set_if_neq(if fitted.is_some() { EnvironmentOrigin::FittedSky } else { EnvironmentOrigin::Unknown });
        let sky = fitted.unwrap_or(SkyGradient::UNKNOWN);
        match picture {
            Some(picture) if picture.gradient.is_some_and(|old| old.is_like(&sky)) => (),
            Some(mut picture) => {
                picture.image = images.add(gradient_texture(&sky));
                picture.version += 1;
                picture.gradient = Some(sky);
            }
            None => {
                let image = images.add(gradient_texture(&sky));
                commands.entity(entity).insert(FallbackPicture::new(image, GRADIENT_SIZE, 0, Some(sky)));
            }
        }
    }
}

fn take_file(
    commands: &mut Commands,
    images: &mut Assets<Image>,
    entity: Entity,
    origin: &mut Mut<EnvironmentOrigin>,
    old: Option<&FallbackPicture>,
    (from, pixels): (EnvironmentOrigin, EquirectPixels),
) {
    let image = images.add(texture(pixels.size, pixels.texels.iter().copied()));
    let version = old.map_or(0, |old| old.version + 1);
    commands.entity(entity).insert(FallbackPicture::new(image, pixels.size, version, None));
    origin.set_if_neq(from);
}

/// Pixels that are looked at, along each axis.
const GRID: UVec2 = UVec2::new(24, 16);

fn fit_sky(
    camera: &ArCamera,
    frame: &CameraFrame,
    place: &GlobalTransform,
    anchors: &Query<(&MarkerAnchor, &MarkerTracking)>,
) -> Option<SkyGradient> {
    let intrinsics = camera.intrinsics_for(frame);
    let world_from_camera = place.affine();
    let parts = (0..GRID.element_product()).map(|i| {
        let cell = (UVec2::new(i % GRID.x, i / GRID.x).as_vec2() + 0.5) / GRID.as_vec2();
        let pixel = cell * frame.pixels.size.as_vec2();
        let dir = world_from_camera.transform_vector3(intrinsics.ray(pixel)).normalize();
        (dir, frame.pixels.linear(pixel.x as i32, pixel.y as i32))
    });
    let marker = anchors.iter().find_map(|(anchor, tracking)| {
        let pose = Affine3A::from(tracking.camera_from_marker.filter(|_| tracking.last_seen == Some(frame.sequence))?);
        let paper = recovery::paper_radiance(&frame.pixels, &intrinsics, &pose, anchor.size)?;
        let up = world_from_camera.transform_vector3(pose.transform_vector3(Vec3::Y)).normalize();
        Some((up, paper / recovery::ClipRecovery::default().paper_reflectance))
    });
    let up = marker.map_or(Vec3::Y, |(up, _)| up);
    SkyGradient::fit(parts, up, marker.map(|(_, light)| light))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment_map::cube_directions;

    #[test]
    fn a_fitted_sky_lights_paper_as_it_was_seen_to_be_lit() {
        let light = Vec3::new(0.9, 0.8, 0.7);
        let down = |i: i32| Vec3::new(0.1 * i as f32, -1.0, 0.3).normalize();
        let desk = (0..5).map(|i| (down(i), Vec3::splat(0.2)));
        let side = (0..5).map(|i| (Vec3::new(1.0, 0.02 * i as f32, 0.0).normalize(), Vec3::new(0.3, 0.5, 0.4)));
        let bright = (0..5).map(|i| (Vec3::new(1.0, 0.1 * i as f32, 0.0).normalize(), Vec3::splat(5.0)));
        for sky in [
            SkyGradient::fit(desk.clone(), Vec3::Y, Some(light)),
            SkyGradient::fit(desk.clone().chain(side), Vec3::Y, Some(light)),
            SkyGradient::fit(desk.clone().chain(bright), Vec3::Y, Some(light)),
        ] {
            let sky = sky.expect("parts were seen");
            let irradiance: Vec3 =
                cube_directions(32).map(|(dir, s)| sky.radiance(dir) * (dir.y.max(0.0) * s)).sum::<Vec3>();
            let found = irradiance / std::f32::consts::PI;
            assert!((found - light).abs().max_element() < 0.02, "{sky:?}: {found}");
            assert!(sky.zenith.min_element() > 0.0 && sky.ground == Vec3::splat(0.2));
        }
        assert!(SkyGradient::fit(std::iter::empty(), Vec3::Y, None).is_none());
    }
}
