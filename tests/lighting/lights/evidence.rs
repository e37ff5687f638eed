//! The error of recovered light by the kind of evidence, through the whole chain.

use super::{SELF_CHECK, TILTED_TOLERANCE, desk_app::desk_app};
use crate::{
    shared_data,
    solved::{irradiance_from_above, normals},
    truth::{ROOMS, TrueSky, desk_picture},
};
use bevy::prelude::*;
use bevy_mirrorball::{
    lighting::{RecoveredLight, SelfCheck, solver::MirrorBall},
    prelude::*,
    probe::{ClipEvidence, ClipRecovery},
};

/// The kinds of evidence for the brightness of clipped light, from none to the whole desk, each with its name.
fn evidence() -> [(&'static str, ClipRecovery); 3] {
    [
        ("clipped light as white", ClipRecovery { is_enabled: false, ..default() }),
        ("one gain, from the paper", ClipRecovery { evidence: ClipEvidence::Paper, ..default() }),
        ("a gain per piece, from the desk", ClipRecovery::default()),
    ]
}

/// The table of the module's documentation, its columns without a renderer: each room through the whole chain, tracking
/// included.
#[test]
fn a_table_of_rooms_by_evidence_shows_that_the_desk_tells_most() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    println!("| room | evidence | equations | irradiance off, marker / tilted | virtual ball RMSE | key light |");
    for room in ROOMS {
        let picture = desk_picture(&folder, room);
        let sky = TrueSky::open(&folder, room);
        let tilted = evidence().map(|(name, recovery)| {
            let MirrorBall { center, radius, reflectance, .. } = picture.ball;
            let probe = LightProbeSphere { radius, reflectance, ..default() };
            let feed = CameraFeed::pixels(picture.frame.clone()).with_pace(FeedPace::Lockstep);
            let probe = (probe, Transform::from_translation(center));
            let camera = (ArCamera::new(picture.intrinsics), feed);
            let (mut app, probe) = desk_app(camera, probe, &folder.join("desk.glb"));
            app.world_mut().entity_mut(probe).insert(recovery);
            app.update();
            app.update();
            // Another question about the same picture: now there is light that it can be compared with.
            app.world_mut().entity_mut(probe).insert(ClipRecovery { max_gain: recovery.max_gain - 1.0, ..recovery });
            app.update();
            app.update();
            let light = app.world().get::<RecoveredLight>(probe).expect("ball and paper are in view");
            let off = normals().map(|normal| {
                let truth = sky.irradiance_from_above(normal);
                ((irradiance_from_above(&light.light, normal) - truth) / truth).abs().max_element()
            });
            let tilted = off[..7].iter().copied().fold(0.0, f32::max);
            let check = app.world().get::<SelfCheck>(probe).expect("the second answer was checked");
            println!(
                "| {room} | {name} | {} paper + {} desk, {} unknown | {:.3} / {tilted:.3} | {:.3} | {:.2?}° |",
                light.light.paper_points,
                light.light.points - light.light.paper_points,
                light.light.regions.len(),
                off[7],
                check.rmse,
                check.key_light_angle.map(f32::to_degrees)
            );
            assert!(check.rmse <= SELF_CHECK, "{check:?}");
            assert_eq!(light.is_solved, name.contains("piece"));
            tilted
        });
        assert!(tilted[2] < tilted[0] && tilted[2] <= TILTED_TOLERANCE, "{room}: {tilted:?}");
    }
}
