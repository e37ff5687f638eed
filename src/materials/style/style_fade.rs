//! Crossfades between styles: a copy of the mesh in the style before fades out over the mesh in the new one.

use super::{Styles, SurfaceStyle};
use crate::{
    materials::{
        mesh_copy::{MeshCopy, Placement, fade_tag},
        original_material::OriginalMaterial,
    },
    phantom::{StageRole, nearest},
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Lets all meshes at and below an entity fade from one [`SurfaceStyle`] to the next, instead of changing at once.
///
/// In a fade, both styles are drawn, the old one by a child entity, and mixed in linear light. A change back in the
/// middle of a fade turns it around; a change to a third style starts from the style that was being faded in. Outlines
/// grow and shrink. The game's time counts ([`Time<Virtual>`]), so fades pause with it.
///
/// Transparent and transmissive surfaces change at once, because one lies behind the other in a fade. Other settings,
/// such as [`MeasuredLightWeight`](super::MeasuredLightWeight), apply at once, too: animate them.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, assets: Res<AssetServer>) {
/// // whatever style the robot gets, it gets it within a second
/// let robot = assets.load(GltfAssetLabel::Scene(0).from_asset("robot.glb"));
/// commands.spawn((WorldAssetRoot(robot), SurfaceStyle::ImageBased, StyleFade { seconds: 1.0 }));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct StyleFade {
    /// Duration of a fade in seconds. Zero, negative numbers and NaN mean none. Defaults to 0.5.
    pub seconds: f32,
}

impl Default for StyleFade {
    fn default() -> Self {
        Self { seconds: 0.5 }
    }
}

/// Style in which a mesh with a [`StyleFade`] was drawn last.
#[derive(Component)]
pub(in crate::materials) struct ShownStyle {
    style: SurfaceStyle,
    /// Copy of the mesh in the style before.
    copy: Option<Entity>,
}

/// Style of a copy that fades out.
#[derive(Component, Clone, Copy)]
pub(in crate::materials) struct FadingStyle {
    pub(super) style: SurfaceStyle,
    /// How much of it is gone, 0…1.
    gone: f32,
    seconds: f32,
    /// Alpha below which the mask of the surface cuts out.
    cutoff: f32,
}

impl FadingStyle {
    /// Returns the marker components and the look of the copy.
    fn bundle(self) -> impl Bundle {
        (MeshCopy, StageRole::Virtual, fade_tag(self.gone, self.cutoff), self)
    }
}

type FadableMesh =
    (Entity, &'static Mesh3d, &'static StageRole, OriginalMaterial, Option<&'static ShownStyle>, Placement);

/// Starts, and turns around, the fades of meshes whose style has changed.
pub(in crate::materials) fn start_fades(
    mut commands: Commands,
    meshes: Query<FadableMesh, Without<MeshCopy>>,
    copies: Query<&FadingStyle>,
    fades: Query<&StyleFade>,
    parents: Query<&ChildOf>,
    originals: Res<Assets<StandardMaterial>>,
    styles: Styles,
) {
    let has_fades = !fades.is_empty();
    for (mesh, shape, role, original, shown, placement) in &meshes {
        if !has_fades && shown.is_none() {
            continue;
        }
        let fade = nearest(mesh, &parents, &fades).filter(|fade| fade.seconds > 0.0 && *role == StageRole::Virtual);
        let style = styles.of(mesh);
        let (StyleFade { seconds }, before, copy) = match (fade, shown) {
            (Some(fade), Some(ShownStyle { style: before, copy })) if style != *before => (*fade, *before, *copy),
            (Some(_), Some(_)) | (None, None) => continue,
            (Some(_), None) => {
                commands.entity(mesh).try_insert(ShownStyle { style, copy: None });
                continue;
            }
            (None, Some(_)) => {
                commands.entity(mesh).try_remove::<ShownStyle>();
                continue;
            }
        };
        let running = copy.and_then(|copy| copies.get(copy).ok().map(|fading| (copy, *fading)));
        let copy = match running {
            Some((copy, fading)) if fading.style == style => {
                let turned = FadingStyle { style: before, gone: 1.0 - fading.gone, seconds, ..fading };
                commands.entity(copy).try_insert(turned.bundle());
                Some(copy)
            }
            _ => {
                if let Some((copy, _)) = running {
                    commands.entity(copy).try_despawn();
                }
                let handle = original.handle();
                let cutoff = handle.and_then(|handle| originals.get(handle)).and_then(cutoff_of_solid);
                handle.zip(cutoff).map(|(handle, cutoff)| {
                    let fading = FadingStyle { style: before, gone: 0.0, seconds, cutoff };
                    let look = (shape.clone(), MeshMaterial3d(handle.clone()), ChildOf(mesh));
                    let mut copy = commands.spawn((fading.bundle(), look));
                    placement.copy_to(&mut copy, true);
                    copy.id()
                })
            }
        };
        commands.entity(mesh).try_insert(ShownStyle { style, copy });
    }
}

/// Returns the alpha below which a surface without transparent parts is cut out, 0 for nowhere.
fn cutoff_of_solid(material: &StandardMaterial) -> Option<f32> {
    match material.alpha_mode {
        _ if material.specular_transmission > 0.0 => None,
        AlphaMode::Opaque => Some(0.0),
        AlphaMode::Mask(cutoff) => Some(cutoff),
        _ => None,
    }
}

/// Moves fades on, and ends those that are over or whose mesh is no longer drawn as it was.
pub(in crate::materials) fn advance_fades(
    mut commands: Commands,
    mut copies: Query<(Entity, &mut FadingStyle, &Mesh3d, &ChildOf)>,
    meshes: Query<(&Mesh3d, &StageRole, Placement), Without<FadingStyle>>,
    time: Res<Time>,
) {
    for (copy, mut fading, shape, parent) in &mut copies {
        fading.gone += time.delta_secs() / fading.seconds;
        let drawn = meshes
            .get(parent.parent())
            .ok()
            .filter(|(drawn, role, _)| *drawn == shape && **role == StageRole::Virtual && fading.gone < 1.0);
        match drawn {
            Some((_, _, placement)) => {
                let mut entity = commands.entity(copy);
                entity.try_insert(fade_tag(fading.gone, fading.cutoff));
                placement.copy_to(&mut entity, false);
            }
            None => commands.entity(copy).try_despawn(),
        }
    }
}

/// System parameter that tells how much outlines fade.
#[derive(SystemParam)]
pub(in crate::materials) struct OutlineFades<'w, 's> {
    copies: Query<'w, 's, (&'static FadingStyle, &'static ChildOf)>,
    shown: Query<'w, 's, &'static ShownStyle>,
}

impl OutlineFades<'_, '_> {
    /// Returns how much of the outline of a mesh is gone, 0…1. From one outline to another it stays.
    pub(in crate::materials) fn gone(&self, mesh: Entity, styles: &Styles) -> f32 {
        if let Ok((fading, parent)) = self.copies.get(mesh) {
            return if styles.of(parent.parent()).has_outline() { 1.0 } else { fading.gone };
        }
        let copy = self.shown.get(mesh).ok().and_then(|shown| self.copies.get(shown.copy?).ok());
        copy.filter(|(fading, _)| !fading.style.has_outline()).map_or(0.0, |(fading, _)| 1.0 - fading.gone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_solid_surfaces_fade() {
        let cutoff = |alpha_mode| cutoff_of_solid(&StandardMaterial { alpha_mode, ..default() });
        let modes = [AlphaMode::Opaque, AlphaMode::Mask(0.3), AlphaMode::Blend, AlphaMode::Add];
        assert_eq!(modes.map(cutoff), [Some(0.0), Some(0.3), None, None]);
        assert_eq!(cutoff_of_solid(&StandardMaterial { specular_transmission: 0.5, ..default() }), None);
    }
}
