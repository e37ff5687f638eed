//! Light on the sheet that changes: lamps, shadows of people, television, sun, glare.

use super::random::Random;
use glam::{Vec2, Vec3};

/// One change of the light. Times in seconds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Change {
    /// A lamp is switched on or off within a frame: all light is multiplied from then on.
    Lamp { at: f64, factor: f32, color: Vec3 },
    /// A dimmer is turned: light is multiplied by a factor in the end.
    Dimmer { from: f64, to: f64, factor: f32 },
    /// Somebody walks by: a band of shadow wanders over the sheet.
    Shadow { from: f64, to: f64, direction: Vec2, width: f32, softness: f32, light: f32 },
    /// A television changes the light at random, a few times a second.
    Television { from: f64, to: f64, strength: f32 },
    /// A reflection wanders over the sheet.
    Glare { from: f64, to: f64, start: Vec2, end: Vec2, radius: f32, strength: f32 },
}

/// All changes of a feed, and the light without them.
#[derive(Clone, Debug)]
pub(super) struct Lighting {
    /// Light on white paper at the start, in units of the sensor's white at exposure 1.
    pub(super) level: f32,
    /// Change of light per meter.
    pub(super) gradient: Vec2,
    /// Light added to everything: flare in the lens, black level.
    pub(super) veil: f32,
    pub(super) changes: Vec<Change>,
}

impl Lighting {
    pub(super) fn steady() -> Self {
        Self { level: 0.6, gradient: Vec2::new(0.8, -0.5), veil: 0.01, changes: Vec::new() }
    }

    /// One change after the other, each about two seconds.
    pub(super) fn restless(seconds: f64, random: &mut Random) -> Self {
        let mut lighting = Self::steady();
        lighting.gradient = Vec2::new(random.between(-1.5, 1.5), random.between(-1.5, 1.5));
        lighting.veil = random.between(0.002, 0.03);
        // The product of all lamps and dimmers so far.
        let mut total = 1.0;
        let mut at = 0.7;
        while at < seconds {
            let to = at + f64::from(random.between(0.4, 2.5));
            // Lamps go out where it is bright, and on where it is dark.
            let mut factor = random.between(1.3, 2.5);
            if total > 1.2 || (total > 0.5 && random.unit() < 0.5) {
                factor = 1.0 / factor;
            }
            let turn = random.between(0.0, std::f32::consts::TAU);
            let place = |random: &mut Random| Vec2::new(random.between(-0.2, 0.2), random.between(-0.02, 0.13));
            lighting.changes.push(match random.below(6) {
                0 | 1 => {
                    total *= factor;
                    let color = Vec3::new(random.between(0.8, 1.2), 1.0, random.between(0.7, 1.3));
                    Change::Lamp { at, factor, color }
                }
                2 => {
                    total *= factor;
                    Change::Dimmer { from: at, to, factor }
                }
                3 => Change::Shadow {
                    from: at,
                    to,
                    direction: Vec2::from_angle(turn),
                    width: random.between(0.03, 0.3),
                    softness: if random.unit() < 0.5 { 0.001 } else { random.between(0.01, 0.08) },
                    light: random.between(0.3, 0.7),
                },
                4 => Change::Television { from: at, to, strength: random.between(0.1, 0.5) },
                _ => Change::Glare {
                    from: at,
                    to,
                    start: place(random),
                    end: place(random),
                    radius: random.between(0.02, 0.12),
                    strength: random.between(0.1, 0.8),
                },
            });
            at = to + f64::from(random.between(0.0, 0.6));
        }
        lighting
    }

    /// The light of one frame.
    pub(super) fn at(&self, seconds: f64) -> FrameLight {
        let mut light =
            FrameLight { color: Vec3::splat(self.level), gradient: self.gradient, veil: self.veil, spots: Vec::new() };
        for change in &self.changes {
            light.add(change, seconds);
        }
        light
    }
}

/// Shadow and glare in one frame.
#[derive(Clone, Copy, Debug)]
enum Spot {
    Shadow { direction: Vec2, middle: f32, half: f32, softness: f32, light: f32 },
    Glare { middle: Vec2, radius: f32, strength: f32 },
}

/// The light on the sheet in one frame.
#[derive(Clone, Debug)]
pub(super) struct FrameLight {
    color: Vec3,
    gradient: Vec2,
    veil: f32,
    spots: Vec<Spot>,
}

impl FrameLight {
    fn add(&mut self, change: &Change, seconds: f64) {
        let part = |from: f64, to: f64| ((seconds - from) / (to - from)) as f32;
        match *change {
            Change::Lamp { at, factor, color } if seconds >= at => self.color *= factor * color,
            Change::Dimmer { from, to, factor } => self.color *= factor.powf(part(from, to).clamp(0.0, 1.0)),
            Change::Shadow { from, to, direction, width, softness, light } if (from..to).contains(&seconds) => {
                let reach = 0.2 + 0.5 * width + softness;
                let middle = reach * (2.0 * part(from, to) - 1.0);
                self.spots.push(Spot::Shadow { direction, middle, half: 0.5 * width, softness, light });
            }
            Change::Television { from, to, strength } if (from..to).contains(&seconds) => {
                let mut random = Random::new((seconds * 12.0) as u64);
                self.color *= 1.0 + strength * random.between(-1.0, 1.0);
            }
            Change::Glare { from, to, start, end, radius, strength } if (from..to).contains(&seconds) => {
                let t = part(from, to);
                let fade = (6.0 * t.min(1.0 - t)).min(1.0);
                self.spots.push(Spot::Glare { middle: start.lerp(end, t), radius, strength: strength * fade });
            }
            Change::Lamp { .. } | Change::Shadow { .. } | Change::Television { .. } | Change::Glare { .. } => {}
        }
    }

    /// Light that falls on a place, and light that is added to what it reflects.
    pub(super) fn on(&self, place: Vec2) -> (Vec3, f32) {
        let (mut lit, mut added) = ((1.0 + self.gradient.dot(place)).max(0.1), 0.0);
        for spot in &self.spots {
            match *spot {
                Spot::Shadow { direction, middle, half, softness, light } => {
                    let inside = half - (direction.dot(place) - middle).abs();
                    let t = (0.5 + 0.5 * inside / softness).clamp(0.0, 1.0);
                    lit *= 1.0 + (light - 1.0) * t * t * (3.0 - 2.0 * t);
                }
                Spot::Glare { middle, radius, strength } => {
                    let square = place.distance_squared(middle) / (radius * radius);
                    if square < 1.0 {
                        added += strength * (1.0 - square).powi(2);
                    }
                }
            }
        }
        (self.color * lit, added + self.veil)
    }
}
