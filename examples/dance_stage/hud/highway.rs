//! Lanes on which arrows rise to their targets.

use super::{ArrowImages, Shows};
use crate::{
    game::{Playback, Player},
    rules::Grade,
    song::{Lane, Note, ROWS_PER_BEAT},
};
use bevy::{platform::collections::HashMap, prelude::*};

/// Width of a lane, and of the space on both sides of all lanes.
const LANE: f32 = 10.5;
const MARGIN: f32 = 1.5;
const WIDTH: f32 = LANE * Lane::COUNT as f32 + 2.0 * MARGIN;
/// Middle of the targets, below the upper edge.
const TARGET: f32 = 14.0;
/// How far apart beats are.
const BEAT: f32 = 19.0;
/// Beats after their time for which missed arrows are seen.
const BEATS_BEHIND: f64 = 1.0;
/// Beats ahead for which arrows are seen; far enough for the longer side of an upright picture.
const BEATS_AHEAD: f64 = 9.0;
/// Largest number of arrows and holds that are seen at once.
const ARROWS: usize = 48;
const HOLDS: usize = 8;
/// Time in which the light of a hit fades, in seconds.
const FLASH: f64 = 0.25;

/// Ground of all that a player sees: on the left for the first one, on the right for the second.
pub(super) fn side(number: usize) -> impl Bundle {
    let mut node = Node {
        position_type: PositionType::Absolute,
        top: Val::ZERO,
        width: vmin(WIDTH),
        height: percent(100),
        ..default()
    };
    let inset = vmin(2.0);
    if number == 0 {
        node.left = inset;
    } else {
        node.right = inset;
    }
    (node, BackgroundColor(Color::srgba(0.02, 0.02, 0.05, 0.45)), Name::new(format!("player {}", number + 1)))
}

/// Target of a lane.
#[derive(Component)]
pub(super) struct Target(Lane);

/// Light behind a target.
#[derive(Component)]
pub(super) struct Glow(Lane);

/// Place for an arrow that is seen, one of [`ARROWS`].
#[derive(Component)]
pub(super) struct ArrowPlace(usize);

/// Place for the body of a hold, one of [`HOLDS`].
#[derive(Component)]
pub(super) struct HoldPlace(usize);

pub(super) fn spawn_lanes(side: &mut EntityCommands, player: Entity, images: &ArrowImages) {
    side.with_children(|side| {
        for lane in Lane::ALL {
            let image = |image: &Handle<Image>, alpha: f32| {
                (ImageNode::new(image.clone()).with_color(Color::WHITE.with_alpha(alpha)), square(lane), turned(lane))
            };
            side.spawn((image(&images.glow, 0.0), Glow(lane), Shows(player)));
            side.spawn((image(&images.target, 0.8), Target(lane), Shows(player)));
        }
        for i in 0..HOLDS {
            let node = Node { position_type: PositionType::Absolute, width: vmin(0.42 * LANE), ..default() };
            side.spawn((node, BackgroundColor::default(), Visibility::Hidden, HoldPlace(i), Shows(player)));
        }
        for i in 0..ARROWS {
            let image = ImageNode::new(images.arrow.clone());
            side.spawn((image, square(Lane::Left), Visibility::Hidden, ArrowPlace(i), Shows(player)));
        }
    });
}

/// A square on the target of a lane.
fn square(lane: Lane) -> Node {
    Node {
        position_type: PositionType::Absolute,
        left: vmin(left(lane)),
        top: vmin(TARGET - 0.5 * LANE),
        width: vmin(LANE),
        height: vmin(LANE),
        ..default()
    }
}

fn left(lane: Lane) -> f32 {
    MARGIN + LANE * lane.index() as f32
}

/// Transform that lets an arrow point where its lane says.
fn turned(lane: Lane) -> UiTransform {
    let quarters = match lane {
        Lane::Up => 0.0,
        Lane::Right => 1.0,
        Lane::Down => 2.0,
        Lane::Left => 3.0,
    };
    UiTransform::from_rotation(Rot2::degrees(90.0 * quarters))
}

/// Colors by the part of the beat, as StepMania's players know them: red quarters, blue eighths, purple triplets,
/// yellow sixteenths, green the rest.
fn color(note: &Note) -> Color {
    let row = note.row.0 % ROWS_PER_BEAT;
    if row == 0 {
        Color::srgb(1.0, 0.25, 0.22)
    } else if row.is_multiple_of(ROWS_PER_BEAT / 2) {
        Color::srgb(0.3, 0.55, 1.0)
    } else if row.is_multiple_of(ROWS_PER_BEAT / 3) {
        Color::srgb(0.75, 0.35, 0.95)
    } else if row.is_multiple_of(ROWS_PER_BEAT / 4) {
        Color::srgb(1.0, 0.85, 0.25)
    } else {
        Color::srgb(0.35, 0.9, 0.4)
    }
}

/// An arrow that is seen.
struct Seen<'a> {
    note: &'a Note,
    /// Beats until it is due, and until its hold ends.
    ahead: f64,
    end: Option<f64>,
    is_missed: bool,
}

/// Returns the arrows that are seen now, the earliest first.
fn seen<'a>(player: &'a Player, beat: f64) -> impl Iterator<Item = Seen<'a>> {
    let notes = player.chart.notes();
    // Holds are seen for as long as they are.
    let earliest = beat - BEATS_BEHIND - player.longest_hold_beats;
    let start = notes.partition_point(|note| note.beat() < earliest);
    let notes = notes.iter().enumerate().skip(start).take_while(move |(_, note)| note.beat() < beat + BEATS_AHEAD);
    let is_near = move |note: &Note| note.last_row().beat() >= beat - BEATS_BEHIND;
    notes.filter(move |(_, note)| is_near(note)).filter_map(move |(i, note)| {
        let grade = player.judge.grade_of(i);
        let end = note.tail().map(|tail| tail.beat() - beat);
        let is_held = player.judge.hold_in(note.lane).is_some_and(|(held, _)| held == i);
        let is_gone = grade.is_some_and(|grade| grade != Grade::Miss) && !is_held;
        // A held arrow stays on its target.
        let ahead = if is_held { (note.beat() - beat).max(0.0) } else { note.beat() - beat };
        (!is_gone).then_some(Seen { note, ahead, end, is_missed: grade == Some(Grade::Miss) })
    })
}

/// Puts the arrows where they are now.
pub(super) fn move_arrows(
    playback: Res<Playback>,
    players: Query<(Entity, &Player)>,
    mut arrows: Query<(&ArrowPlace, &Shows, &mut Node, &mut UiTransform, &mut ImageNode, &mut Visibility)>,
    mut holds: Query<(&HoldPlace, &Shows, &mut Node, &mut BackgroundColor, &mut Visibility), Without<ArrowPlace>>,
) {
    let seen: HashMap<_, Vec<_>> =
        players.iter().map(|(entity, player)| (entity, seen(player, playback.beat).collect())).collect();
    for (place, shows, mut node, mut transform, mut image, mut visibility) in &mut arrows {
        let Some(arrow) = seen.get(&shows.0).and_then(|seen| seen.get(place.0)) else {
            visibility.set_if_neq(Visibility::Hidden);
            continue;
        };
        visibility.set_if_neq(Visibility::Inherited);
        node.set_if_neq(square(arrow.note.lane));
        let translation = Val2::new(Val::ZERO, vmin(BEAT * arrow.ahead as f32));
        transform.set_if_neq(UiTransform { translation, ..turned(arrow.note.lane) });
        let color = color(arrow.note);
        let color = if arrow.is_missed { color.with_alpha(0.3) } else { color };
        if image.color != color {
            image.color = color;
        }
    }
    for (place, shows, mut node, mut background, mut visibility) in &mut holds {
        let mut held = seen.get(&shows.0).into_iter().flatten().filter_map(|arrow| Some((arrow.end?, arrow)));
        let Some((end, arrow)) = held.nth(place.0) else {
            visibility.set_if_neq(Visibility::Hidden);
            continue;
        };
        visibility.set_if_neq(Visibility::Inherited);
        let (top, height) = (TARGET + BEAT * arrow.ahead as f32, BEAT * (end - arrow.ahead).max(0.0) as f32);
        let left = vmin(left(arrow.note.lane) + 0.29 * LANE);
        node.set_if_neq(Node { left, top: vmin(top), height: vmin(height), ..node.clone() });
        let alpha = if arrow.is_missed { 0.2 } else { 0.6 };
        background.set_if_neq(BackgroundColor(color(arrow.note).with_alpha(alpha)));
    }
}

/// Lets targets beat, move under feet, and light up with hits.
pub(super) fn light_targets(
    playback: Res<Playback>,
    players: Query<&Player>,
    mut targets: Query<(&Target, &Shows, &mut UiTransform)>,
    mut glows: Query<(&Glow, &Shows, &mut ImageNode)>,
) {
    let pulse = 0.06 * (1.0 - playback.beat.rem_euclid(1.0) as f32).powi(3);
    for (target, shows, mut transform) in &mut targets {
        let Ok(player) = players.get(shows.0) else { continue };
        let size = if player.stands_on[target.0.index()] { 0.88 } else { 1.0 + pulse };
        transform.set_if_neq(UiTransform { scale: Vec2::splat(size), ..turned(target.0) });
    }
    for (glow, shows, mut image) in &mut glows {
        let Ok(player) = players.get(shows.0) else { continue };
        let hit = player.hits[glow.0.index()];
        let color = hit.map_or(Color::NONE, |hit| {
            let age = (playback.now - hit.seconds) / FLASH;
            super::status::color(hit.grade).with_alpha((1.0 - age).clamp(0.0, 1.0) as f32)
        });
        let is_held = player.judge.hold_in(glow.0).is_some_and(|(_, is_on)| is_on);
        let color = if is_held { Color::srgba(1.0, 0.95, 0.7, 0.8) } else { color };
        if image.color != color {
            image.color = color;
        }
    }
}
