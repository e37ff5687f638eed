//! Distribution of the faces of a frame among the probes.

use super::{NeighborReflections, neighbor_probe::NeighborProbe};
use crate::{environment_map::PendingCubes, prefilter::SceneProbe};
use bevy::prelude::*;

/// Number of faces for each probe, given the faces left of its round and whether more rounds follow. Probes take turns
/// by rounds; `turn` is the index of the one whose turn it is.
fn distribute(left_of_round: &[u32], budget: u32, turn: &mut usize) -> Vec<u32> {
    let mut faces = vec![0; left_of_round.len()];
    let mut budget = budget;
    for _ in 0..left_of_round.len() {
        *turn %= left_of_round.len();
        let given = budget.min(left_of_round[*turn]);
        faces[*turn] = given;
        budget -= given;
        if given < left_of_round[*turn] {
            break;
        }
        *turn += 1;
    }
    faces
}

/// Decides which faces the next frame renders.
pub(super) fn schedule_faces(
    settings: Res<NeighborReflections>,
    mut probes: Query<(Entity, &mut NeighborProbe, &mut SceneProbe)>,
    mut pending: ResMut<PendingCubes>,
    mut turn: Local<usize>,
) {
    let mut ordered: Vec<_> = probes.iter_mut().collect();
    ordered.sort_by_key(|(entity, ..)| *entity);
    let left: Vec<u32> = ordered.iter().map(|(_, probe, _)| probe.faces_left_of_round()).collect();
    let faces = distribute(&left, settings.faces_per_frame, &mut turn);
    let mut is_pending = false;
    for ((_, probe, scene), faces) in ordered.iter_mut().zip(faces) {
        if scene.faces_per_frame != faces {
            scene.faces_per_frame = faces;
        }
        if faces > 0 {
            if faces == probe.faces_left_of_round() && probe.frames_since_first_round.is_none() {
                probe.frames_since_first_round = Some(0);
            }
            probe.faces_left -= faces;
        }
        let is_shown = probe.frames_since_first_round.is_some();
        is_pending |= settings.faces_per_frame > 0 && (faces > 0 || probe.faces_left > 0 || !is_shown);
    }
    if pending.0 != is_pending {
        pending.0 = is_pending;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_take_turns_by_rounds() {
        let mut turn = 0;
        assert_eq!(distribute(&[6, 6], 1, &mut turn), [1, 0]);
        assert_eq!(distribute(&[5, 6], 4, &mut turn), [4, 0]);
        assert_eq!(distribute(&[1, 6], 4, &mut turn), [1, 3]);
        assert_eq!(distribute(&[6, 3], 4, &mut turn), [1, 3], "the second goes first");
        assert_eq!(distribute(&[5, 0], 20, &mut turn), [5, 0]);
    }

    #[test]
    fn nothing_is_rendered_without_a_budget_or_work() {
        let mut turn = 3;
        assert_eq!(distribute(&[6, 6], 0, &mut turn), [0, 0]);
        assert_eq!(distribute(&[0, 0, 0], 6, &mut turn), [0, 0, 0]);
        assert!(distribute(&[], 6, &mut turn).is_empty());
    }
}
