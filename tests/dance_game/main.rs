//! The dance game of the example `dance_stage` without a renderer: songs, rules, composer and whole dances.

#[path = "../../examples/dance_stage/dancer/animations.rs"]
mod animations;
#[expect(dead_code, reason = "the figure needs more of it")]
#[path = "../../examples/dance_stage/dancer/choreography.rs"]
mod choreography;
#[path = "../../examples/dance_stage/composer/mod.rs"]
mod composer;
#[expect(dead_code, unused_imports, reason = "the program needs more of it")]
#[path = "../../examples/dance_stage/game/mod.rs"]
mod game;
#[path = "../../examples/dance_stage/random.rs"]
mod random;
#[path = "../../examples/dance_stage/dancer/rest_pose.rs"]
mod rest_pose;
#[path = "../../examples/dance_stage/rules/mod.rs"]
mod rules;
#[path = "../../examples/dance_stage/stage_lights/mirror_ball.rs"]
mod mirror_ball;
#[path = "../../examples/dance_stage/places/sky.rs"]
mod sky;
#[path = "../../examples/dance_stage/song/mod.rs"]
mod song;
#[expect(dead_code, reason = "tested by itself")]
#[path = "../../examples/dance_stage/stage_lights/sweep.rs"]
mod sweep;
#[expect(dead_code, reason = "tested by itself")]
#[path = "../../examples/dance_stage/places/view_point.rs"]
mod view_point;

mod any_dancer;
mod audio_device;
mod choreography_poses;
mod composing;
mod controls;
mod dancer_model;
mod demo_dance;
mod judging;
mod latency;
mod mat;
mod simfile_mistakes;
mod simfiles;
mod song_clocks;
mod ssc_files;
mod step_charts;
mod tallying;
mod timing;
mod whole_dances;
