//! Steps on the fields of a mat, in an app without camera and renderer.

use crate::{
    game::{Choice, DanceGamePlugin, Latency, Playback, Player, Screen, Shoe, Song, StepField},
    song::{Lane, Simfile},
};
use bevy::{prelude::*, state::app::StatesPlugin, time::TimeUpdateStrategy};
use bevy_mirrorball::{
    prelude::*,
    tracking::{MarkerState, MarkerTracking},
};
use std::{path::Path, time::Duration};

/// Steps of a calibration.
const STEPS: usize = 24;
const STEP: Duration = Duration::from_millis(20);

struct Mat {
    app: App,
    fields: [Entity; 4],
}

impl Mat {
    /// A screen of the game with a mat whose fields are 20 cm apart, left to right.
    fn on(screen: Screen) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/music");
        let file = Simfile::open(&folder.join("vibe_ace.sm")).expect("the shipped song");
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, StatesPlugin, DanceGamePlugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(STEP))
            .insert_resource(Song { file, folder })
            .insert_resource(Choice::default())
            .insert_state(screen);
        app.finish();
        let fields = Lane::ALL.map(|lane| {
            let place = Transform::from_xyz(0.2 * lane.index() as f32, 0.0, 0.0);
            app.world_mut().spawn((StepField::new(lane), VirtualButton::new(Vec2::splat(0.18)), place)).id()
        });
        app.update();
        Self { app, fields }
    }

    fn cover(&mut self, lane: usize, is_covered: bool) {
        self.cover_earlier(lane, is_covered, Duration::ZERO);
    }

    /// Covers a field in a frame that arrives so much later.
    fn cover_earlier(&mut self, lane: usize, is_covered: bool, by: Duration) {
        let at = self.app.world().resource::<Time<Real>>().elapsed() + STEP - by;
        let mut state = self.app.world_mut().get_mut::<VirtualButtonState>(self.fields[lane]).expect("a button");
        *state = VirtualButtonState { is_covered: Some(is_covered), coverage: 0.2, changed_at: Some(at) };
        self.app.update();
    }

    fn put(&mut self, shoe: Entity, x: f32, y: f32) {
        self.app.world_mut().entity_mut(shoe).insert(Transform::from_xyz(x, y, 0.0));
        self.app.update();
    }

    fn stands(&mut self) -> [bool; 4] {
        let world = self.app.world_mut();
        world.query::<&Player>().single(world).expect("one player").stands_on
    }
}

#[test]
fn covering_a_field_is_a_step() {
    let mut mat = Mat::on(Screen::Dance);
    mat.cover(2, true);
    assert_eq!(mat.stands(), [false, false, true, false]);
    mat.cover(0, true);
    mat.cover(2, false);
    assert_eq!(mat.stands(), [true, false, false, false]);
}

#[test]
fn a_shoe_steps_when_it_stands_and_not_when_it_is_above_the_mat() {
    let mut mat = Mat::on(Screen::Dance);
    let seen = MarkerTracking { state: MarkerState::Tracked, ..default() };
    let shoe = mat.app.world_mut().spawn((Shoe::default(), seen, Transform::from_xyz(-1.0, 0.08, 0.0))).id();
    mat.app.update();
    mat.put(shoe, -1.0, 0.08);
    assert_eq!(mat.stands(), [false; 4]);
    // Over the second field, and what the camera sees of it is covered.
    mat.cover(1, true);
    mat.put(shoe, 0.2, 0.16);
    assert_eq!(mat.stands(), [false; 4]);
    mat.put(shoe, 0.2, 0.085);
    assert_eq!(mat.stands(), [false, true, false, false]);
    // The heel rises, the shoe slides to the edge.
    mat.put(shoe, 0.295, 0.1);
    assert_eq!(mat.stands(), [false, true, false, false]);
    mat.put(shoe, 0.4, 0.1);
    assert_eq!(mat.stands(), [false; 4]);
    mat.put(shoe, 0.4, 0.08);
    assert_eq!(mat.stands(), [false, false, true, false]);
}

#[test]
fn the_timing_is_set_by_steps_on_the_mat_when_the_camera_sees_them() {
    let mut mat = Mat::on(Screen::Calibration);
    // Frames arrive 60 ms after they were taken, in the update after the one that is a tenth of a beat late.
    let mut beat = mat.app.world().resource::<Playback>().beat.ceil();
    for _ in 0..STEPS {
        while mat.app.world().resource::<Playback>().beat < beat + 0.1 {
            mat.app.update();
        }
        mat.cover_earlier(1, true, Duration::from_millis(60));
        mat.cover(1, false);
        beat += 1.0;
    }
    // A tenth of a beat of 0.6 s, and up to two updates of 20 ms, less the way of the frame.
    let Latency(latency) = *mat.app.world().resource::<Latency>();
    assert!((0.019..0.041).contains(&latency), "{latency}");
}
