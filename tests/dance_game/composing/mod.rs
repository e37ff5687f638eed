//! Charts that the dance game composes for any song: whether arrows are on the beat, and whether they can be danced.

mod dance;
mod files;
mod on_the_beat;
mod synthetic_track;
mod ten_tracks;
