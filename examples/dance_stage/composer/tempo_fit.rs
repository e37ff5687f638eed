//! The few constant tempos that beats were played in.
//!
//! Frames of beats and onsets enter, and a [`TempoMap`] leaves. Beats that dynamic programming has set waver by a frame
//! or follow a syncopation. So a line, or as many joined lines as the beats need, is fitted to the onsets at them by
//! iteratively reweighted least squares with Cauchy weights (Holland and Welsch 1977). Where lines join comes from an
//! optimal partition of the beats (Jackson et al. 2005), of which joints that the fit does not need are removed again.

use super::{
    onsets::Onset,
    tempo_map::{Node, TempoMap, bpm},
};

/// Spread in seconds of onsets about their beats.
const SPREAD: f64 = 0.008;
/// An onset this near to a beat in seconds may be the beat.
const REACH: f64 = 0.045;
/// Reach once the tempo is known.
const FINE_REACH: f64 = 0.030;
/// Weight of a beat without an onset, against 1 for a strong one.
const SILENT_WEIGHT: f64 = 0.01;
/// Beats of constant tempo at the least.
const MIN_BEATS: usize = 8;
/// What a change of tempo costs, in units of the robust cost of one strong beat.
const CHANGE_COST: f64 = 30.0;
/// How far in seconds beats may move for a tempo that is a whole number.
const WHOLE_TEMPO_SHIFT: f64 = 0.008;
/// Two changes this many beats apart may be one.
const CLOSE_BEATS: f64 = 4.0;
/// Knots that are tried at most.
const MAX_KNOTS: usize = 48;
const ITERATIONS: usize = 8;

/// An onset and the beat that it sounds like.
#[derive(Clone, Copy)]
struct Point {
    beat: f64,
    seconds: f64,
    weight: f64,
}

/// Fits tempos to beats at these times in seconds. `None` if there are too few.
pub(crate) fn fit_tempos(beats: &[f64], onsets: &[Onset]) -> Option<TempoMap> {
    if beats.len() < MIN_BEATS {
        return None;
    }
    let numbered = beats.iter().enumerate().map(|(beat, seconds)| (beat as f64, *seconds));
    let points: Vec<Point> = numbered.map(|(beat, seconds)| point(beat, seconds, onsets, REACH)).collect();
    let mut knots = pruned(partition(&points), &points)?;
    let coarse = fit(&knots, &points)?;
    // Once more with the onsets between the beats, and where dynamic programming had lost the beat.
    let last = *knots.last()? * 2.0;
    let halves = (0..=last as usize).map(|half| 0.5 * half as f64);
    let points: Vec<Point> = halves.map(|beat| point(beat, coarse.seconds_at(beat), onsets, FINE_REACH)).collect();
    knots = pruned(knots, &points)?;
    let fine = fit(&knots, &points)?;
    Some(with_whole_tempos(&fine, &points).unwrap_or(fine))
}

/// The strongest onset near a beat, or else the beat itself with little weight.
fn point(beat: f64, seconds: f64, onsets: &[Onset], reach: f64) -> Point {
    let first = onsets.partition_point(|onset| onset.seconds < seconds - reach);
    let near = onsets[first..].iter().take_while(|onset| onset.seconds <= seconds + reach);
    let weight = |onset: &Onset| f64::from(onset.strength.min(1.0) + onset.bass.min(1.0));
    match near.max_by(|a, b| weight(a).total_cmp(&weight(b))) {
        Some(onset) => Point { beat, seconds: onset.seconds, weight: weight(onset) + SILENT_WEIGHT },
        None => Point { beat, seconds, weight: SILENT_WEIGHT },
    }
}

/// Beats at which the tempo may change, with the first and the last beat: the partition of the least squared error.
fn partition(points: &[Point]) -> Vec<f64> {
    // Music that wavers would have a tempo for every few beats, and each costs time.
    let penalties = std::iter::successors(Some(CHANGE_COST), |penalty| Some(2.0 * penalty));
    let partitions = penalties.map(|penalty| partition_with(points, penalty));
    partitions
        .take(20)
        .find(|knots| knots.len() <= MAX_KNOTS)
        .unwrap_or_else(|| vec![points[0].beat, points[points.len() - 1].beat])
}

fn partition_with(points: &[Point], penalty: f64) -> Vec<f64> {
    // Sums of w, w·x, w·y, w·x², w·x·y, w·y² up to each point.
    let mut sums = vec![[0.0; 6]];
    for (i, point) in points.iter().enumerate() {
        // Without the mean tempo, so that small differences are left of large numbers.
        let (x, y, w) = (point.beat, point.seconds - points[0].seconds, point.weight);
        let terms = [w, w * x, w * y, w * x * x, w * x * y, w * y * y];
        sums.push(std::array::from_fn(|k| sums[i][k] + terms[k]));
    }
    let error = |start: usize, end: usize| {
        let [w, x, y, xx, xy, yy]: [f64; 6] = std::array::from_fn(|k| sums[end][k] - sums[start][k]);
        let (xx, xy, yy) = (xx - x * x / w, xy - x * y / w, yy - y * y / w);
        (yy - xy * xy / xx.max(1e-9)).max(0.0) / (SPREAD * SPREAD)
    };
    let count = points.len();
    let mut best: Vec<(f64, usize)> = vec![(f64::INFINITY, 0); count + 1];
    best[0].0 = 0.0;
    for end in MIN_BEATS..=count {
        for start in 0..=end - MIN_BEATS {
            let cost = best[start].0 + error(start, end) + penalty;
            if cost < best[end].0 {
                best[end] = (cost, start);
            }
        }
    }
    // Each part has knots of its own, so that the beat between two parts may have any length: songs are cut, too.
    let mut knots = Vec::new();
    let mut end = count;
    while end > 0 {
        let start = best[end].1;
        knots.extend([points[end - 1].beat, points[start].beat]);
        end = start;
    }
    knots.reverse();
    knots
}

/// Removes knots that are not worth their cost, and moves the others to where they fit best.
fn pruned(knots: Vec<f64>, points: &[Point]) -> Option<Vec<f64>> {
    let cost = |knots: &[f64]| fit(knots, points).map_or(f64::INFINITY, |map| robust_cost(&map, points));
    let mut knots = without_needless(knots, cost);
    let mut present = cost(&knots);
    for knot in 1..knots.len() - 1 {
        for step in [-4.0, -2.0, -1.0, 1.0, 2.0, 4.0] {
            let mut moved = knots.clone();
            moved[knot] += step;
            let moved_cost = cost(&moved);
            if moved_cost < present {
                (knots, present) = (moved, moved_cost);
            }
        }
    }
    knots = without_needless(knots, cost);
    cost(&knots).is_finite().then_some(knots)
}

fn without_needless(mut knots: Vec<f64>, cost: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let mut present = cost(&knots);
    loop {
        let removed = (1..knots.len() - 1).map(|knot| spliced(&knots, knot..knot + 1, None));
        // Two knots around a change may be one.
        let close = (1..knots.len().saturating_sub(2)).filter(|knot| knots[knot + 1] - knots[*knot] <= CLOSE_BEATS);
        let merged = close.flat_map(|knot| {
            let places =
                (-1..).map(|step| knots[knot] + f64::from(step)).take_while(|place| *place <= knots[knot + 1] + 1.0);
            places.map(|place| spliced(&knots, knot..knot + 2, Some(place))).collect::<Vec<_>>()
        });
        let fewer = removed.chain(merged).map(|fewer| (cost(&fewer), fewer)).min_by(|a, b| a.0.total_cmp(&b.0));
        match fewer {
            Some((least, fewer)) if least < present + CHANGE_COST => (knots, present) = (fewer, least),
            _ => return knots,
        }
    }
}

/// Knots with some replaced by another, or by none.
fn spliced(knots: &[f64], range: std::ops::Range<usize>, place: Option<f64>) -> Vec<f64> {
    let mut spliced = knots.to_vec();
    spliced.splice(range, place);
    spliced
}

/// Fits joined lines with joints at these beats. `None` if they are not in order.
fn fit(knots: &[f64], points: &[Point]) -> Option<TempoMap> {
    let mut weights: Vec<f64> = points.iter().map(|point| point.weight).collect();
    if knots.windows(2).any(|pair| pair[1] - pair[0] < 1.0) {
        return None;
    }
    let mut map = least_squares(knots, points, &weights)?;
    for _ in 0..ITERATIONS {
        for (weight, point) in weights.iter_mut().zip(points) {
            let error = (point.seconds - map.seconds_at(point.beat)) / SPREAD;
            *weight = point.weight / (1.0 + error * error);
        }
        map = least_squares(knots, points, &weights)?;
    }
    Some(map)
}

/// Times of the knots by least squares. Each point depends on two of them, so the equations are tridiagonal.
fn least_squares(knots: &[f64], points: &[Point], weights: &[f64]) -> Option<TempoMap> {
    let count = knots.len();
    let (mut diagonal, mut beside, mut right) = (vec![1e-9; count], vec![0.0; count], vec![0.0; count]);
    for (point, weight) in points.iter().zip(weights) {
        let next = knots.partition_point(|knot| *knot <= point.beat).clamp(1, count - 1);
        let b = (point.beat - knots[next - 1]) / (knots[next] - knots[next - 1]);
        let a = 1.0 - b;
        diagonal[next - 1] += weight * a * a;
        diagonal[next] += weight * b * b;
        beside[next - 1] += weight * a * b;
        right[next - 1] += weight * a * point.seconds;
        right[next] += weight * b * point.seconds;
    }
    // Elimination downwards and substitution upwards (Thomas 1949).
    for i in 1..count {
        let factor = beside[i - 1] / diagonal[i - 1];
        diagonal[i] -= factor * beside[i - 1];
        right[i] -= factor * right[i - 1];
    }
    let mut seconds = vec![0.0; count];
    for i in (0..count).rev() {
        let above = if i + 1 < count { beside[i] * seconds[i + 1] } else { 0.0 };
        seconds[i] = (right[i] - above) / diagonal[i];
    }
    TempoMap::new(knots.iter().zip(seconds).map(|(beat, seconds)| Node { beat: *beat, seconds }).collect())
}

fn robust_cost(map: &TempoMap, points: &[Point]) -> f64 {
    let cost = |point: &Point| {
        let error = (point.seconds - map.seconds_at(point.beat)) / SPREAD;
        point.weight * (error * error).ln_1p()
    };
    points.iter().map(cost).sum()
}

/// Rounds tempos to whole numbers where that moves no beat much: most music is made so.
fn with_whole_tempos(map: &TempoMap, points: &[Point]) -> Option<TempoMap> {
    let mut nodes = vec![map.nodes()[0]];
    for pair in map.nodes().windows(2) {
        let tempo = bpm(pair[0], pair[1]);
        let seconds = pair[1].seconds - pair[0].seconds;
        // Turned about the middle, the ends move by half of this.
        let shift = 0.5 * seconds * (tempo / tempo.round() - 1.0).abs();
        let tempo = if shift < WHOLE_TEMPO_SHIFT { tempo.round() } else { tempo };
        let start = nodes[nodes.len() - 1].seconds;
        nodes.push(Node { beat: pair[1].beat, seconds: start + 60.0 * (pair[1].beat - pair[0].beat) / tempo });
    }
    let rounded = TempoMap::new(nodes)?;
    let mut errors: Vec<(f64, f64)> =
        points.iter().map(|point| (point.seconds - rounded.seconds_at(point.beat), point.weight)).collect();
    let offset = weighted_median(&mut errors);
    let nodes = rounded.nodes().iter().map(|node| Node { seconds: node.seconds + offset, ..*node }).collect();
    let rounded = TempoMap::new(nodes)?;
    (robust_cost(&rounded, points) < robust_cost(map, points) + CHANGE_COST).then_some(rounded)
}

fn weighted_median(values: &mut [(f64, f64)]) -> f64 {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    let past_half = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    past_half.map_or(0.0, |(value, _)| *value)
}
