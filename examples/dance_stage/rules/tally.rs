//! What the steps of a dance add up to: hits, combo, score, life and the letter at the end.
//!
//! All values are StepMania's (`Themes/_fallback/metrics.ini`, `ScoreKeeperNormal.cpp`, `LifeMeterBar.cpp`):
//!
//! | | Marvelous | Perfect | Great | Good | Almost | Miss | hold OK | hold NG |
//! |---|---|---|---|---|---|---|---|---|
//! | dance points, for the percentage | 3 | 2 | 1 | 0 | 0 | 0 | 3 | 0 |
//! | grade points, for the letter | 2 | 2 | 1 | 0 | −4 | −8 | 6 | 0 |
//! | life, in thousandths | 8 | 8 | 4 | 0 | −40 | −80 | 8 | −80 |
//!
//! Life begins at a half. After it has fallen it rises again from the fifth good step or hold on. At 0 the dance has
//! failed, and life stays there. Unlike StepMania, which takes the worst step of a jump for both, each arrow counts.
//! A hold whose beginning was missed is one without points. Counts are whole numbers, so that sums are exact.

use super::{
    judge::{JudgeEvent, JudgeEventKind, Verdict},
    windows::{Grade, HoldGrade},
};
use crate::song::StepChart;

const DANCE_POINTS: [u32; Grade::COUNT] = [3, 2, 1, 0, 0, 0];
const DANCE_POINTS_HELD: u32 = 3;
const GRADE_POINTS: [i64; Grade::COUNT] = [2, 2, 1, 0, -4, -8];
const GRADE_POINTS_HELD: i64 = 6;
const LIFE: [i32; Grade::COUNT] = [8, 8, 4, 0, -40, -80];
const LIFE_HELD: i32 = 8;
const LIFE_LET_GO: i32 = -80;
const FULL_LIFE: i32 = 1000;
/// Number of good steps and holds after a loss, the last of which makes life rise again.
const STEPS_TO_REGAIN_LIFE: u32 = 5;

/// Letter for a whole dance, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum LetterGrade {
    /// All Marvelous, all holds held.
    Aaaa,
    /// All Perfect or better, all holds held.
    Aaa,
    /// 93 % of the grade points.
    Aa,
    /// 80 %.
    A,
    /// 65 %.
    B,
    /// 45 %.
    C,
    D,
    /// Life has run out.
    E,
}

impl LetterGrade {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Aaaa => "AAAA",
            Self::Aaa => "AAA",
            Self::Aa => "AA",
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
            Self::D => "D",
            Self::E => "E",
        }
    }
}

/// Sums over the verdicts of one dance.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Tally {
    notes: u32,
    holds: u32,
    hits: [u32; Grade::COUNT],
    held: u32,
    let_go: u32,
    combo: u32,
    best_combo: u32,
    /// In thousandths.
    life: i32,
    steps_to_regain_life: u32,
}

impl Tally {
    pub(crate) fn new(chart: &StepChart) -> Self {
        Self {
            notes: chart.notes().len() as u32,
            holds: chart.holds() as u32,
            hits: [0; Grade::COUNT],
            held: 0,
            let_go: 0,
            combo: 0,
            best_combo: 0,
            life: FULL_LIFE / 2,
            steps_to_regain_life: 0,
        }
    }

    /// Counts a step that hit an arrow.
    pub(crate) fn count_step(&mut self, verdict: &Verdict) {
        self.count_grade(verdict.grade);
    }

    /// Counts what happened without a step.
    pub(crate) fn count_event(&mut self, event: &JudgeEvent) {
        match event.kind {
            JudgeEventKind::Missed => self.count_grade(Grade::Miss),
            JudgeEventKind::HoldEnded(HoldGrade::Held) => {
                self.held += 1;
                self.change_life(LIFE_HELD);
            }
            JudgeEventKind::HoldEnded(HoldGrade::LetGo) => {
                self.let_go += 1;
                self.change_life(LIFE_LET_GO);
            }
        }
    }

    fn count_grade(&mut self, grade: Grade) {
        self.hits[grade.index()] += 1;
        self.combo = if grade.keeps_combo() { self.combo + 1 } else { 0 };
        self.best_combo = self.best_combo.max(self.combo);
        self.change_life(LIFE[grade.index()]);
    }

    fn change_life(&mut self, change: i32) {
        if change < 0 {
            self.steps_to_regain_life = STEPS_TO_REGAIN_LIFE;
        } else if change > 0 {
            self.steps_to_regain_life = self.steps_to_regain_life.saturating_sub(1);
        }
        if !self.has_failed() && (change < 0 || self.steps_to_regain_life == 0) {
            self.life = (self.life + change).clamp(0, FULL_LIFE);
        }
    }

    pub(crate) fn hits(&self, grade: Grade) -> u32 {
        self.hits[grade.index()]
    }

    /// Number of holds held to their end, and of those let go.
    pub(crate) fn holds(&self) -> (u32, u32) {
        (self.held, self.let_go)
    }

    /// Number of arrows hit in a row, each Great or better. A jump counts as two.
    pub(crate) fn combo(&self) -> u32 {
        self.combo
    }

    pub(crate) fn best_combo(&self) -> u32 {
        self.best_combo
    }

    /// Life from 0 to 1.
    pub(crate) fn life(&self) -> f32 {
        self.life as f32 / FULL_LIFE as f32
    }

    /// Whether life has run out.
    pub(crate) fn has_failed(&self) -> bool {
        self.life == 0
    }

    /// Returns the dance points so far as a fraction of those of a perfect dance, 0 to 1.
    pub(crate) fn score(&self) -> f64 {
        let points = |(hits, points): (&u32, u32)| hits * points;
        let steps: u32 = self.hits.iter().zip(DANCE_POINTS).map(points).sum();
        let possible = self.notes * DANCE_POINTS[0] + self.holds * DANCE_POINTS_HELD;
        f64::from(steps + self.held * DANCE_POINTS_HELD) / f64::from(possible.max(1))
    }

    /// Returns the score in percent with two digits. As in StepMania it is not rounded up, so that only a perfect dance
    /// has 100.00 %.
    pub(crate) fn score_text(&self) -> String {
        // Exact fractions such as 0.57 are a little less in binary.
        let hundredths = (self.score() * 10_000.0 + 1e-6).floor() as u32;
        format!("{}.{:02} %", hundredths / 100, hundredths % 100)
    }

    /// Returns the letter for the dance, in which all that is still to come counts as if it had no points.
    pub(crate) fn letter(&self) -> LetterGrade {
        if self.has_failed() {
            return LetterGrade::E;
        }
        let count = |best: &[Grade]| best.iter().map(|grade| self.hits(*grade)).sum::<u32>();
        if self.notes > 0 && self.held == self.holds {
            if count(&[Grade::Marvelous]) == self.notes {
                return LetterGrade::Aaaa;
            }
            if count(&[Grade::Marvelous, Grade::Perfect]) == self.notes {
                return LetterGrade::Aaa;
            }
        }
        let steps: i64 = self.hits.iter().zip(GRADE_POINTS).map(|(hits, points)| i64::from(*hits) * points).sum();
        let points = steps + i64::from(self.held) * GRADE_POINTS_HELD;
        let possible = i64::from(self.notes) * GRADE_POINTS[0] + i64::from(self.holds) * GRADE_POINTS_HELD;
        // Tiers in percent, compared as whole numbers.
        match 100 * points {
            points if possible == 0 || points < 45 * possible => LetterGrade::D,
            points if points < 65 * possible => LetterGrade::C,
            points if points < 80 * possible => LetterGrade::B,
            points if points < 93 * possible => LetterGrade::A,
            _ => LetterGrade::Aa,
        }
    }
}
