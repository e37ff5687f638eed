//! The figure of the dancer: a glTF file with an animation for each move.

use super::choreography::{Motion, Move, SLOTS};
use bevy::{ecs::query::QueryData, gltf::Gltf, platform::collections::HashMap, prelude::*};

/// A glTF file whose figure dances. Its first scene is spawned below the entity.
#[derive(Component)]
pub(crate) struct Dancer(pub Handle<Gltf>);

/// Animations of a figure by move and slot, on the entity that plays them.
#[derive(Component)]
pub(super) struct Moves(HashMap<(Move, usize), AnimationNodeIndex>);

/// A figure that can be posed.
#[derive(QueryData)]
#[query_data(mutable)]
pub(super) struct Figure {
    player: &'static mut AnimationPlayer,
    moves: &'static Moves,
}

impl FigureItem<'_, '_> {
    /// Poses the figure. Moves that it does not have are left out.
    pub(super) fn show(&mut self, motions: &[Motion]) {
        for node in self.moves.0.values() {
            self.player.play(*node).pause().set_weight(0.0);
        }
        for motion in motions {
            if let Some(node) = self.moves.0.get(&(motion.what, motion.slot)) {
                self.player.play(*node).seek_to(motion.beats).set_weight(motion.weight);
            }
        }
    }
}

/// Spawns the scenes of new dancers, and finds the animations in them.
pub(super) fn prepare(
    mut commands: Commands,
    files: Res<Assets<Gltf>>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
    dancers: Query<(Entity, &Dancer, Has<WorldAssetRoot>)>,
    new_players: Query<Entity, (With<AnimationPlayer>, Without<Moves>)>,
    parents: Query<&ChildOf>,
) {
    for (entity, dancer, has_scene) in &dancers {
        let Some(file) = files.get(&dancer.0) else { continue };
        if let Some(scene) = file.scenes.first().filter(|_| !has_scene) {
            commands.entity(entity).insert(WorldAssetRoot(scene.clone()));
        }
        for player in new_players.iter().filter(|player| parents.iter_ancestors(*player).any(|above| above == entity)) {
            let places = Move::ALL.into_iter().flat_map(|what| (0..SLOTS).map(move |slot| (what, slot)));
            let clip = |place: (Move, usize)| Some((place, file.named_animations.get(place.0.name())?.clone()));
            let (moves, clips): (Vec<_>, Vec<_>) = places.filter_map(clip).unzip();
            let (graph, nodes) = AnimationGraph::from_clips(clips);
            let graph = AnimationGraphHandle(graphs.add(graph));
            commands.entity(player).insert((graph, Moves(moves.into_iter().zip(nodes).collect())));
        }
    }
}
