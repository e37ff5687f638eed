//! Several sheets with the same number in one frame: the one that was followed is followed on.
//!
//! Positions are centers in pixels. Each marker of a new frame is either the one that was followed or one of the
//! others, whichever lies nearer to where it was. When the followed one is not detected, the others do not take its
//! place until it has been missing for a while.

use super::{DetectedMarker, MarkerAnchor};
use bevy::{ecs::entity::EntityHashMap, math::DVec2, prelude::*};

/// Number of frames without the followed sheet, after which another one of its number is followed; and for which
/// another one is remembered after it was last seen.
const MAX_MISSED_FRAMES: u32 = 30;

/// The sheets of an anchor in the frames of each camera; on the entity of the anchor.
#[derive(Component, Clone, Debug, Default)]
pub(crate) struct FollowedSheets(EntityHashMap<SameNumber>);

impl FollowedSheets {
    /// Sheets in the frames of a camera.
    pub(super) fn of(&mut self, camera: Entity) -> &mut SameNumber {
        self.0.entry(camera).or_default()
    }

    /// Forgets the sheets that other cameras saw.
    pub(super) fn retain(&mut self, is_kept: impl Fn(Entity) -> bool) {
        self.0.retain(|camera, _| is_kept(*camera));
    }
}

/// Positions of the sheets that bear the number of an anchor, in the frames of one camera.
#[derive(Clone, Debug, Default)]
pub(super) struct SameNumber {
    followed: Option<DVec2>,
    /// Frames since the followed sheet was seen.
    missed: u32,
    others: Vec<Other>,
    /// Whether the user was told.
    is_reported: bool,
}

/// A sheet that is not followed.
#[derive(Clone, Copy, Debug)]
struct Other {
    center: DVec2,
    /// Frames since it was seen.
    missed: u32,
}

impl SameNumber {
    /// Chooses among all markers of the number in a new frame. Returns `None` if the followed sheet is not among them.
    pub(super) fn choose<'a>(&mut self, seen: &[&'a DetectedMarker]) -> Option<&'a DetectedMarker> {
        let centers: Vec<DVec2> = seen.iter().map(|marker| center(marker)).collect();
        let chosen = match self.followed {
            // The largest is the nearest or the best to measure.
            None => (0..seen.len()).max_by(|a, b| perimeter(seen[*a]).total_cmp(&perimeter(seen[*b]))),
            Some(last) => {
                if self.missed >= MAX_MISSED_FRAMES {
                    self.others.clear();
                }
                self.nearest(&centers, last)
            }
        };
        self.remember(&centers, chosen);
        chosen.map(|chosen| seen[chosen])
    }

    /// Tells the user once if several sheets bear the number of an anchor.
    pub(super) fn report_copies(&mut self, entity: Entity, anchor: &MarkerAnchor, camera: Entity, copies: u32) {
        if copies > 1 && !self.is_reported {
            self.is_reported = true;
            warn!(
                "MarkerAnchor of {entity}: {copies} sheets with {} are in a frame of camera {camera}; the one \
                 that was seen first is followed. Cover the others or print them with other numbers",
                anchor.marker()
            );
        }
    }

    /// Index of the marker that is nearest to where the followed one was, compared with where the others were.
    fn nearest(&self, centers: &[DVec2], last: DVec2) -> Option<usize> {
        let to_others = |at: DVec2| self.others.iter().map(|other| other.center.distance(at)).reduce(f64::min);
        let loss = |i: &usize| centers[*i].distance(last) - to_others(centers[*i]).unwrap_or(0.0);
        let best = (0..centers.len()).min_by(|a, b| loss(a).total_cmp(&loss(b)))?;
        // With fewer markers than sheets, the followed one may be the one that is missing.
        let is_missing = centers.len() <= self.others.len() && loss(&best) > 0.0;
        (!is_missing).then_some(best)
    }

    fn remember(&mut self, centers: &[DVec2], chosen: Option<usize>) {
        let mut rest: Vec<DVec2> = (0..centers.len()).filter(|i| Some(*i) != chosen).map(|i| centers[i]).collect();
        let mut shift = chosen.and_then(|chosen| Some(centers[chosen] - self.followed?));
        for other in &mut self.others {
            let nearest = (0..rest.len()).min_by(|a, b| {
                let distance = |i: &usize| rest[*i].distance(other.center);
                distance(a).total_cmp(&distance(b))
            });
            match nearest {
                Some(nearest) => {
                    let center = rest.swap_remove(nearest);
                    shift.get_or_insert(center - other.center);
                    *other = Other { center, missed: 0 };
                }
                None => {
                    // The camera's movement shifts what is not seen too.
                    other.center += shift.unwrap_or_default();
                    other.missed += 1;
                }
            }
        }
        self.others.retain(|other| other.missed < MAX_MISSED_FRAMES);
        self.others.extend(rest.into_iter().map(|center| Other { center, missed: 0 }));
        match chosen {
            Some(chosen) => (self.followed, self.missed) = (Some(centers[chosen]), 0),
            None => {
                self.followed = self.followed.map(|last| last + shift.unwrap_or_default());
                self.missed += 1;
            }
        }
    }
}

fn center(marker: &DetectedMarker) -> DVec2 {
    marker.corners.iter().sum::<DVec2>() / 4.0
}

fn perimeter(marker: &DetectedMarker) -> f64 {
    (0..4).map(|i| marker.corners[i].distance(marker.corners[(i + 1) % 4])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::MarkerFamily;

    fn sheet(x: f64, size: f64) -> DetectedMarker {
        let corners = [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)].map(|(u, v)| DVec2::new(x + u, 50.0 + v));
        DetectedMarker { family: MarkerFamily::Tag36h11, id: 0, corners, corrected_bits: 0 }
    }

    /// Left edges of the sheets that are followed through some frames.
    fn followed(frames: &[&[(f64, f64)]]) -> Vec<Option<f64>> {
        let mut state = SameNumber::default();
        let follow = |sheets: &&[(f64, f64)]| {
            let sheets: Vec<_> = sheets.iter().map(|(x, size)| sheet(*x, *size)).collect();
            state.choose(&sheets.iter().collect::<Vec<_>>()).map(|marker| marker.corners[0].x)
        };
        frames.iter().map(follow).collect()
    }

    #[test]
    fn the_first_is_the_largest_and_stays() {
        let frames: [&[_]; 4] = [
            &[(100.0, 40.0), (300.0, 60.0)],
            &[(280.0, 50.0), (110.0, 70.0)],
            &[(120.0, 70.0), (260.0, 50.0)],
            &[(240.0, 50.0), (130.0, 70.0)],
        ];
        assert_eq!(followed(&frames), [Some(300.0), Some(280.0), Some(260.0), Some(240.0)]);
    }

    #[test]
    fn a_fast_turn_of_the_camera_does_not_swap_them() {
        // They move by three quarters of their distance.
        let frames: [&[_]; 3] =
            [&[(100.0, 50.0), (200.0, 40.0)], &[(275.0, 40.0), (175.0, 50.0)], &[(250.0, 50.0), (350.0, 40.0)]];
        assert_eq!(followed(&frames), [Some(100.0), Some(175.0), Some(250.0)]);
    }

    #[test]
    fn another_sheet_does_not_take_the_place_of_a_missing_one_at_once() {
        let both: &[_] = &[(100.0, 50.0), (300.0, 40.0)];
        let other: &[_] = &[(302.0, 40.0)];
        let found = followed(&[both, other, other, &[(104.0, 50.0)], other, both]);
        assert_eq!(found, [Some(100.0), None, None, Some(104.0), None, Some(100.0)]);
        let mut long = vec![both];
        long.extend([other; MAX_MISSED_FRAMES as usize + 1]);
        assert_eq!(followed(&long).last(), Some(&Some(302.0)), "after a while there is only that one");
    }

    #[test]
    fn a_single_sheet_is_followed_wherever_it_goes() {
        assert_eq!(
            followed(&[&[(0.0, 50.0)], &[(900.0, 50.0)], &[], &[(3.0, 50.0)]]),
            [Some(0.0), Some(900.0), None, Some(3.0)]
        );
    }
}
