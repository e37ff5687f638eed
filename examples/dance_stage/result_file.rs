//! What players have reached, as JSON.

use crate::{
    game::{Playback, Player, Song},
    rules::Grade,
    support::Outcome,
};
use bevy::prelude::*;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Writes the results of all players so far.
pub(crate) fn write(app: &mut App, file: &Path) -> Outcome<()> {
    let text = serde_json::to_string_pretty(&json!({ "players": players(app.world_mut()) }))?;
    std::fs::write(file, text + "\n").map_err(|error| format!("cannot write {}: {error}", file.display()).into())
}

/// A line for each player: arrows of the chart, those that are judged, hits by grade, arrows that are overdue without a
/// verdict, and what all that is worth.
fn players(world: &mut World) -> Vec<Value> {
    let mut query = world.query::<&Player>();
    let mut players: Vec<_> = query.iter(world).collect();
    players.sort_by_key(|player| player.number);
    let (Some(song), Some(playback)) = (world.get_resource::<Song>(), world.get_resource::<Playback>()) else {
        return Vec::new();
    };
    players.into_iter().map(|player| line(player, player.dropped(song.timing(), playback.now))).collect()
}

fn line(player: &Player, dropped: usize) -> Value {
    let tally = &player.tally;
    let grades: Map<_, _> =
        Grade::ALL.into_iter().map(|grade| (grade.name().to_lowercase(), json!(tally.hits(grade)))).collect();
    let judged = Grade::ALL.into_iter().map(|grade| tally.hits(grade)).sum::<u32>();
    let (held, let_go) = tally.holds();
    json!({
        "difficulty": player.chart.difficulty.name(),
        "notes": player.chart.notes().len(),
        "judged": judged,
        "hits": grades,
        "dropped": dropped,
        "holds": { "held": held, "let_go": let_go },
        "best_combo": tally.best_combo(),
        "score": tally.score(),
        "life": tally.life(),
    })
}
