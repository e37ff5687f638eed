//! Ages of the shadow maps, and the choice of those to redraw.

use bevy::prelude::*;

/// Fraction of the energy that the main directions give together.
const MAIN_ENERGY_FRACTION: f32 = 0.9;
/// Maximum age of the shadow map of a main direction, in frames.
const MAX_MAIN_AGE: u32 = 8;

/// Movement of casters from one frame to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Movement {
    /// Sum of Δ Δᵀ over the movements of centers, in m².
    moment: Mat3,
    /// Sum of the squared radii of casters that have turned, bent, appeared or disappeared, in m².
    reshaped: f32,
}

impl Default for Movement {
    fn default() -> Self {
        Self { moment: Mat3::ZERO, reshaped: 0.0 }
    }
}

impl Movement {
    /// Adds a movement of a caster's center.
    pub(super) fn shift(&mut self, by: Vec3) {
        self.moment += Mat3::from_cols(by * by.x, by * by.y, by * by.z);
    }

    /// Adds a caster that has turned, bent, appeared or disappeared.
    pub(super) fn reshape(&mut self, radius: f32) {
        self.reshaped += radius * radius;
    }

    /// Returns the root of the sum of squared movements as seen from a light in a direction, in meters.
    fn seen_from(&self, direction: Vec3) -> f32 {
        let trace = self.moment.x_axis.x + self.moment.y_axis.y + self.moment.z_axis.z;
        (trace - direction.dot(self.moment * direction) + self.reshaped).max(0.0).sqrt()
    }
}

/// Directions of a dome with the ages of their shadow maps.
#[derive(Clone, Debug, Default)]
pub(super) struct RefreshSchedule {
    directions: Vec<DirectionAge>,
}

#[derive(Clone, Copy, Debug)]
struct DirectionAge {
    /// `None` for a free slot.
    direction: Option<Vec3>,
    /// Frames since casters were where the shadow map shows them; 0 if the shadow map is up to date.
    age: u32,
    /// Distance that casters have moved since then, in meters; `f32::MAX` for a shadow map that was never drawn.
    movement: f32,
}

impl DirectionAge {
    /// Returns the age of a shadow map that was never drawn.
    fn new(direction: Option<Vec3>) -> Self {
        match direction {
            Some(_) => Self { direction, age: MAX_MAIN_AGE, movement: f32::MAX },
            None => Self { direction, age: 0, movement: 0.0 },
        }
    }

    fn was_drawn(&self) -> bool {
        self.movement < f32::MAX
    }
}

/// Statistics of a dome's shadow maps after the choice of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Ages {
    pub outdated: u32,
    pub main: u32,
    pub oldest_main: u32,
}

impl RefreshSchedule {
    /// Returns the schedule of a dome whose shadow maps were never drawn.
    pub(super) fn new(directions: impl Iterator<Item = Option<Vec3>>) -> Self {
        Self { directions: directions.map(DirectionAge::new).collect() }
    }

    /// Replaces one direction by another one or by none. Its shadow map counts as never drawn, also if the direction
    /// is the same.
    pub(super) fn replace(&mut self, index: usize, direction: Option<Vec3>) {
        if let Some(replaced) = self.directions.get_mut(index) {
            *replaced = DirectionAge::new(direction);
        }
    }

    /// Advances all ages by one frame, in which casters may have moved.
    pub(super) fn advance(&mut self, movement: Option<Movement>) {
        for aged in &mut self.directions {
            if let (Some(movement), Some(direction)) = (movement, aged.direction) {
                aged.age += 1;
                aged.movement += movement.seen_from(direction);
            } else if aged.age > 0 {
                aged.age += 1;
            }
        }
    }

    pub(super) fn is_outdated(&self) -> bool {
        self.directions.iter().any(|direction| direction.age > 0)
    }

    /// Returns the main directions by descending energy: the smallest set that gives most of the energy.
    fn main_directions(&self, energies: &[f32]) -> Vec<usize> {
        let energy = |i: usize| energies.get(i).copied().unwrap_or(1.0).max(0.0);
        let mut order: Vec<usize> =
            (0..self.directions.len()).filter(|&i| self.directions[i].direction.is_some()).collect();
        order.sort_by(|&a, &b| energy(b).total_cmp(&energy(a)));
        let total: f32 = order.iter().map(|&i| energy(i)).sum();
        let mut sum = 0.0;
        let is_needed = |i: &usize| {
            let needed = sum < MAIN_ENERGY_FRACTION * total;
            sum += energy(*i);
            needed
        };
        order.into_iter().take_while(is_needed).collect()
    }

    /// Chooses the directions to redraw: first as many of the oldest main directions as are needed to keep none of
    /// them older than eight frames, then others by energy × age × movement, up to `budget` in total. Directions that
    /// were never drawn are always chosen and do not count towards the budget.
    pub(super) fn choose(&mut self, budget: u32, energies: &[f32]) -> (Vec<u32>, Ages) {
        let main = self.main_directions(energies);
        let (drawn, mut chosen): (Vec<usize>, Vec<usize>) =
            (0..self.directions.len()).partition(|&i| self.directions[i].was_drawn());
        let urgent = chosen.len();
        let mut waiting: Vec<usize> =
            main.iter().copied().filter(|&i| self.directions[i].was_drawn() && self.directions[i].age > 0).collect();
        waiting.sort_by_key(|&i| std::cmp::Reverse(self.directions[i].age));
        waiting.truncate(main.len().div_ceil(MAX_MAIN_AGE as usize));
        chosen.extend(waiting);
        let priority = |i: usize| {
            let DirectionAge { age, movement, .. } = self.directions[i];
            energies.get(i).copied().unwrap_or(1.0).max(1e-6) * age as f32 * movement.max(1e-6)
        };
        let mut rest: Vec<usize> =
            drawn.into_iter().filter(|i| self.directions[*i].age > 0 && !chosen.contains(i)).collect();
        rest.sort_by(|&a, &b| priority(b).total_cmp(&priority(a)));
        let budget = (budget as usize).saturating_sub(chosen.len() - urgent);
        chosen.extend(rest.into_iter().take(budget));
        for &i in &chosen {
            (self.directions[i].age, self.directions[i].movement) = (0, 0.0);
        }
        let ages = Ages {
            outdated: self.directions.iter().filter(|direction| direction.age > 0).count() as u32,
            main: main.len() as u32,
            oldest_main: main.iter().map(|&i| self.directions[i].age).max().unwrap_or(0),
        };
        (chosen.into_iter().map(|i| i as u32).collect(), ages)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::directions::hemisphere, *};

    fn moving() -> Option<Movement> {
        let mut movement = Movement::default();
        movement.shift(Vec3::X);
        Some(movement)
    }

    /// A few lamps in front of a dim sky.
    fn energies(count: u32, lamps: u32) -> Vec<f32> {
        (0..count).map(|i| if i % 7 == 3 && i / 7 < lamps { 50.0 } else { 1.0 + (i % 5) as f32 }).collect()
    }

    #[test]
    fn a_still_scene_is_drawn_once() {
        let mut schedule = RefreshSchedule::new(hemisphere(64).map(Some));
        assert_eq!(schedule.choose(16, &[]).0.len(), 64, "all that was never drawn");
        for _ in 0..5 {
            schedule.advance(None);
            assert_eq!(schedule.choose(16, &[]), (vec![], Ages { main: 58, ..default() }));
        }
    }

    #[test]
    fn after_one_movement_each_direction_is_drawn_once_in_the_order_of_energy() {
        let mut schedule = RefreshSchedule::new(hemisphere(64).map(Some));
        schedule.choose(16, &[]);
        let energies = energies(64, 4);
        let mut drawn = Vec::new();
        schedule.advance(moving());
        for _ in 0..10 {
            drawn.extend(schedule.choose(16, &energies).0);
            schedule.advance(None);
        }
        let first: Vec<u32> = drawn[..16].to_vec();
        for lamp in [3, 10, 17, 24] {
            assert!(first.contains(&lamp), "lamp {lamp} is not among {first:?}");
        }
        drawn.sort_unstable();
        assert_eq!(drawn, (0..64).collect::<Vec<_>>());
    }

    #[test]
    fn while_casters_move_no_main_direction_waits_longer_than_eight_frames() {
        for (count, budget, lamps) in [(64, 16, 0), (64, 4, 5), (256, 16, 0), (256, 16, 20), (1024, 16, 0)] {
            let energies = energies(count, lamps);
            let mut schedule = RefreshSchedule::new(hemisphere(count).map(Some));
            schedule.choose(budget, &energies);
            let (mut oldest, mut most) = (0, 0);
            for _ in 0..60 {
                schedule.advance(moving());
                let (chosen, ages) = schedule.choose(budget, &energies);
                oldest = oldest.max(ages.oldest_main);
                most = most.max(chosen.len());
            }
            println!("{count} directions, {lamps} lamps, budget {budget}: up to {most} a frame, oldest {oldest}");
            assert!(oldest <= MAX_MAIN_AGE);
            assert!(most <= (budget as usize).max(count.div_ceil(MAX_MAIN_AGE) as usize));
        }
    }

    #[test]
    fn one_that_turns_is_drawn_at_once_besides_the_others_and_a_free_place_never() {
        let mut schedule = RefreshSchedule::new(hemisphere(64).map(Some).chain([None]));
        assert_eq!(schedule.choose(16, &[]).0.len(), 64);
        for step in 0..40 {
            schedule.replace(64, Some(Vec3::new(0.1 * step as f32, 1.0, 0.0).normalize()));
            schedule.advance(moving());
            let (chosen, ages) = schedule.choose(16, &[]);
            assert!(
                chosen.contains(&64) && chosen.len() == 17 && ages.oldest_main <= MAX_MAIN_AGE,
                "{chosen:?} {ages:?}"
            );
        }
        schedule.replace(64, None);
        schedule.advance(moving());
        let (chosen, ages) = schedule.choose(u32::MAX, &[]);
        assert!(chosen.len() == 64 && ages.outdated == 0);
    }

    #[test]
    fn movement_towards_a_light_is_not_seen_from_there() {
        let mut movement = Movement::default();
        movement.shift(Vec3::new(0.0, 2.0, 0.0));
        assert_eq!(movement.seen_from(Vec3::Y), 0.0);
        assert_eq!(movement.seen_from(Vec3::X), 2.0);
        movement.reshape(1.5);
        assert_eq!(movement.seen_from(Vec3::Y), 1.5);
    }
}
