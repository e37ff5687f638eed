//! The figure of the dancer: a glTF file with an animation for each move.

use super::{
    animations::{MoveAnimation, is_native, of_move, second},
    choreography::{Motion, Move, SLOTS},
    rest_pose::FigureParts,
};
use bevy::{ecs::query::QueryData, gltf::Gltf, platform::collections::HashMap, prelude::*};

/// A glTF file whose figure dances. Its first scene is spawned below the entity.
#[derive(Component)]
pub(crate) struct Dancer(pub Handle<Gltf>);

/// An animation that the player can play.
struct Playable {
    node: AnimationNodeIndex,
    is_native: bool,
    seconds: f32,
}

/// Animations of a figure by move and slot, on the entity that plays them.
#[derive(Component)]
pub(super) struct Moves(HashMap<(Move, usize), Playable>);

/// A figure that can be posed.
#[derive(QueryData)]
#[query_data(mutable)]
pub(super) struct Figure {
    player: &'static mut AnimationPlayer,
    moves: &'static Moves,
}

impl FigureItem<'_, '_> {
    /// Poses the figure at a beat. Moves that it does not have are left out.
    pub(super) fn show(&mut self, motions: &[Motion], beat: f64) {
        for playable in self.moves.0.values() {
            self.player.play(playable.node).pause().set_weight(0.0);
        }
        for motion in motions {
            if let Some(playable) = self.moves.0.get(&(motion.what, motion.slot)) {
                let at = second(motion.what, playable.is_native, playable.seconds, motion.beats, beat);
                self.player.play(playable.node).seek_to(at).set_weight(motion.weight);
            }
        }
    }
}

/// Spawns the scenes of new dancers, and finds the animations in them.
pub(super) fn prepare(
    mut commands: Commands,
    files: Res<Assets<Gltf>>,
    parts: FigureParts,
    clips: Res<Assets<AnimationClip>>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
    dancers: Query<(Entity, &Dancer, Has<Children>)>,
    new_players: Query<Entity, (With<AnimationPlayer>, Without<Moves>)>,
    parents: Query<&ChildOf>,
) {
    for (entity, dancer, has_scene) in &dancers {
        let Some(file) = files.get(&dancer.0) else { continue };
        if let Some(scene) = file.scenes.first().filter(|_| !has_scene) {
            let fit = parts.fit(file, is_native(&names_of(file))).unwrap_or_default();
            commands.entity(entity).with_child((WorldAssetRoot(scene.clone()), fit, Visibility::default()));
        }
        for player in new_players.iter().filter(|player| parents.iter_ancestors(*player).any(|above| above == entity)) {
            let mut graph = AnimationGraph::new();
            let mut moves = HashMap::default();
            for (what, clip, is_native) in moves_of(file) {
                let seconds = clips.get(clip).map_or(0.0, AnimationClip::duration);
                for slot in 0..SLOTS {
                    let node = graph.add_clip(clip.clone(), 1.0, graph.root);
                    moves.insert((what, slot), Playable { node, is_native, seconds });
                }
            }
            commands.entity(player).insert((AnimationGraphHandle(graphs.add(graph)), Moves(moves)));
        }
    }
}

/// Names of the animations of a file, in its order. Those without a name are no moves.
fn names_of(file: &Gltf) -> Vec<&str> {
    let mut named: Vec<_> = file.named_animations.iter().collect();
    named.sort_by_key(|(_, clip)| file.animations.iter().position(|other| other == *clip));
    named.into_iter().map(|(name, _)| &**name).collect()
}

/// Returns the moves that a file has animations for, and whether those are made for this game.
fn moves_of(file: &Gltf) -> impl Iterator<Item = (Move, &Handle<AnimationClip>, bool)> {
    let names = names_of(file);
    Move::ALL.into_iter().filter_map(move |what| {
        let MoveAnimation { index, is_native } = of_move(what, &names)?;
        Some((what, file.named_animations.get(names[index])?, is_native))
    })
}
