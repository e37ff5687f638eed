//! Lights of the stage on the real desk while there is a dance: spot lights that sweep over it, and light spots that
//! the mirror ball throws.
//!
//! The beat enters, lamps of Bevy's leave. That they light a real desk, with shadows of real and virtual things, is the
//! plugin's doing.

mod mirror_ball;
mod sweep;

use crate::{
    game::{GameSystems, Playback, Screen},
    stage::MIRROR_BALL,
};
use bevy::{camera::Exposure, light::DirectionalLightShadowMap, prelude::*};
use bevy_mirrorball::lighting::RealLight;
use mirror_ball::{FACETS, reflected};
use std::f32::consts::PI;
use sweep::Sweep;

/// Edge of the shadow map of a spot light, in texels.
const SHADOW_MAP: usize = 1024;
/// Light that a spot light and a facet add to a white surface that faces it, in camera units.
const SPOT: f32 = 1.8;
const FACET: f32 = 0.7;
/// Distance in meters at which they do.
const REACH: f32 = 0.3;
/// Half of the angle of a facet's beam in radians, where it begins to fade and where it ends.
const FACET_BEAM: [f32; 2] = [0.045, 0.06];
/// Half of the angle of a spot light's beam in radians, likewise.
const SPOT_BEAM: [f32; 2] = [0.19, 0.25];

/// Lights the stage on [`Screen::Dance`]. L switches the lights off and on.
pub(crate) struct StageLightsPlugin;

impl Plugin for StageLightsPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(DirectionalLightShadowMap { size: SHADOW_MAP }).add_systems(OnEnter(Screen::Dance), spawn);
        app.add_systems(
            Update,
            (switch, turn, throw_spots)
                .chain()
                .after(GameSystems::Time)
                .run_if(in_state(Screen::Dance).and_then(resource_exists::<Playback>)),
        );
    }
}

#[derive(Component)]
struct StageLight;

/// Light of a facet of the mirror ball, by its number.
#[derive(Component)]
struct Facet(usize);

/// Intensity in lumens of a lamp at the camera's exposure that is [`REACH`] away and adds so much light.
fn lumens(light: f32, exposures: &Query<&Exposure>) -> f32 {
    let exposure = exposures.iter().next().copied().unwrap_or_default().exposure();
    // White shows irradiance ÷ π; Bevy divides lumens by 4π.
    light / exposure * PI * REACH.powi(2) * 4.0 * PI
}

fn spawn(mut commands: Commands) {
    let light = |[inner_angle, outer_angle]: [f32; 2], shadow_maps_enabled| SpotLight {
        intensity: 0.0,
        range: 1.0,
        inner_angle,
        outer_angle,
        shadow_maps_enabled,
        shadow_depth_bias: 0.002,
        shadow_map_near_z: 0.02,
        ..default()
    };
    for sweep in Sweep::ALL {
        commands.spawn((StageLight, sweep, light(SPOT_BEAM, true), DespawnOnExit(Screen::Dance)));
    }
    for facet in 0..FACETS {
        commands.spawn((StageLight, Facet(facet), light(FACET_BEAM, false), DespawnOnExit(Screen::Dance)));
    }
}

fn switch(keys: Option<Res<ButtonInput<KeyCode>>>, mut lights: Query<&mut Visibility, With<StageLight>>) {
    if keys.is_some_and(|keys| keys.just_pressed(KeyCode::KeyL)) {
        for mut visibility in &mut lights {
            visibility.toggle_visible_hidden();
        }
    }
}

/// Turns the spot lights to where they shine at the beat.
fn turn(
    playback: Res<Playback>,
    exposures: Query<&Exposure>,
    mut lights: Query<(&Sweep, &mut SpotLight, &mut Transform)>,
) {
    for (sweep, mut light, mut transform) in &mut lights {
        let beat = playback.beat as f32;
        light.color = sweep.color(beat);
        light.intensity = lumens(SPOT * sweep.strength(beat), &exposures);
        *transform = Transform::from_translation(sweep.place).looking_at(sweep.aim(beat), Vec3::Y);
    }
}

/// Turns the beams of the facets to where they mirror the strongest real light, or a spot light if the room has none.
fn throw_spots(
    playback: Res<Playback>,
    exposures: Query<&Exposure>,
    real: Query<&RealLight>,
    mut facets: Query<(&Facet, &mut SpotLight, &mut Transform)>,
) {
    let strongest = real.iter().max_by(|a, b| a.irradiance.total_cmp(&b.irradiance));
    let (towards, color) = strongest.map_or_else(
        || ((Sweep::ALL[0].place - MIRROR_BALL).normalize(), Color::WHITE),
        |light| (light.direction, Color::LinearRgba(light.color)),
    );
    for (facet, mut light, mut transform) in &mut facets {
        let (direction, strength) = reflected(facet.0, playback.beat as f32, towards);
        light.color = color;
        light.intensity = lumens(FACET * strength, &exposures);
        *transform = Transform::from_translation(MIRROR_BALL).looking_to(direction, Vec3::Y);
    }
}
