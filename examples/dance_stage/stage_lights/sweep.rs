//! Where the spot lights shine, as a function of the beat.

use bevy::prelude::*;
use std::f32::consts::TAU;

/// Beats from one sweep to the next, and beats of one color.
const BEATS_PER_SWEEP: f32 = 8.0;
const BEATS_PER_COLOR: f32 = 16.0;
/// How far a spot wanders from the stage, in meters to the sides and to the front.
const WIDTH: Vec2 = Vec2::new(0.16, 0.10);

/// A spot light above the stage.
#[derive(Component, Clone, Copy)]
pub(super) struct Sweep {
    /// In meters in the frame of reference of the stage.
    pub place: Vec3,
    /// Part of a sweep by which it is ahead.
    phase: f32,
    /// Hue of its first color, in degrees.
    hue: f32,
}

impl Sweep {
    /// Behind the stage on both sides.
    pub(super) const ALL: [Self; 2] = [
        Self { place: Vec3::new(-0.2, 0.36, 0.14), phase: 0.0, hue: 320.0 },
        Self { place: Vec3::new(0.2, 0.36, 0.14), phase: 0.25, hue: 190.0 },
    ];

    /// Middle of the spot on the desk: a figure of eight.
    pub(super) fn aim(&self, beat: f32) -> Vec3 {
        let turn = TAU * (beat / BEATS_PER_SWEEP + self.phase);
        Vec3::new(WIDTH.x * turn.sin(), 0.0, -0.03 + WIDTH.y * (2.0 * turn).sin())
    }

    pub(super) fn color(&self, beat: f32) -> Color {
        Color::hsl((self.hue + 360.0 * beat / BEATS_PER_COLOR).rem_euclid(360.0), 1.0, 0.65)
    }

    /// Brightest on the beat, 0…1; dark before the song.
    pub(super) fn strength(&self, beat: f32) -> f32 {
        let fade_in = (beat + 1.0).clamp(0.0, 1.0);
        fade_in * (1.0 - 0.45 * beat.rem_euclid(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_stay_on_the_desk_and_move_without_jumps() {
        for sweep in Sweep::ALL {
            for step in 0..640 {
                let (beat, next) = (0.05 * step as f32, 0.05 * (step + 1) as f32);
                let aim = sweep.aim(beat);
                assert!(aim.y == 0.0 && aim.x.abs() <= WIDTH.x && aim.z.abs() < 0.2, "{aim}");
                assert!(aim.distance(sweep.aim(next)) < 0.015);
            }
            assert!(sweep.aim(0.0).distance(sweep.aim(BEATS_PER_SWEEP)) < 1e-5);
        }
    }

    #[test]
    fn spots_flash_on_the_beat_and_are_dark_before_the_song() {
        let [sweep, _] = Sweep::ALL;
        assert_eq!((sweep.strength(4.0), sweep.strength(-1.0)), (1.0, 0.0));
        assert!(sweep.strength(4.9) < 0.7 && sweep.strength(4.9) > 0.5);
    }
}
