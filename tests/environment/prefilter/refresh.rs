//! When maps are filtered again, and which entities share them.

use super::{cube, diffuse_and_glossy, lit_app, maps_source, shown};
use crate::radiance_cube::texel;
use bevy::{camera::Exposure, light::EnvironmentMapLight, math::DVec3, prelude::*};
use bevy_mirrorball::prefilter::{DeskParallax, EnvironmentState, FilteredEnvironment, LiveEnvironment, Refresh};

fn refreshes(app: &App, camera: Entity) -> u32 {
    match app.world().get::<EnvironmentState>(camera) {
        Some(EnvironmentState::Live { refreshes, .. }) => *refreshes,
        other => panic!("not live: {other:?}"),
    }
}

#[test]
fn what_does_not_change_is_not_filtered_again() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let source = maps_source(&app, camera);
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source.clone()).with_refresh(Refresh::OnChange));
    for _ in 0..6 {
        app.update();
    }
    let settled = refreshes(&app, camera);
    for _ in 0..5 {
        app.update();
    }
    assert!(settled > 0 && refreshes(&app, camera) == settled);
    let brighter = cube(16, |_| DVec3::splat(2.0));
    app.world_mut().resource_mut::<Assets<Image>>().insert(&source, brighter).expect("same handle");
    for _ in 0..3 {
        app.update();
    }
    assert!(refreshes(&app, camera) > settled);
    assert!((shown(&mut app, camera) - 2.0).abs() < 2e-3);
}

#[test]
fn a_budget_shows_whole_sets_only() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let source = maps_source(&app, camera);
    let budget = Refresh::Budget { dispatches: 1 };
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source).with_refresh(budget));
    for _ in 0..3 {
        app.update();
    }
    let before = refreshes(&app, camera);
    // Reading, the diffuse map and levels 1 and 2 (8 and 4 texels wide) are four dispatches.
    for _ in 0..12 {
        app.update();
    }
    assert_eq!(refreshes(&app, camera) - before, 3);
    assert!((shown(&mut app, camera) - 1.0).abs() < 2e-3);
}

#[test]
fn what_is_refreshed_on_request_waits_for_it() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let source = maps_source(&app, camera);
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source.clone()).with_refresh(Refresh::OnRequest));
    for _ in 0..4 {
        app.update();
    }
    let settled = refreshes(&app, camera);
    let mut images = app.world_mut().resource_mut::<Assets<Image>>();
    let bytes = cube(16, |_| DVec3::splat(2.0)).data;
    let texture = images.get_mut(&source).map(|mut image| image.data = bytes);
    assert!(settled == 1 && texture.is_some());
    for _ in 0..3 {
        app.update();
    }
    app.world().get::<FilteredEnvironment>(camera).expect("is lit").request_refresh();
    for _ in 0..3 {
        app.update();
    }
    assert!(refreshes(&app, camera) > settled);
    assert!((shown(&mut app, camera) - 2.0).abs() < 2e-3);
}

#[test]
fn light_goes_with_its_component_and_maps_of_one_source_are_shared() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let environment = app.world().get::<LiveEnvironment>(camera).expect("it has one").clone();
    let probe = app.world_mut().spawn((LightProbe::default(), environment)).id();
    app.update();
    let glossy = |app: &App, entity| app.world().get::<FilteredEnvironment>(entity).expect("is lit").specular.clone();
    assert_eq!(glossy(&app, camera), glossy(&app, probe));
    app.world_mut().entity_mut(probe).remove::<LiveEnvironment>();
    app.update();
    assert!(!app.world().entity(probe).contains::<EnvironmentMapLight>());
    assert!(app.world().entity(camera).contains::<EnvironmentMapLight>());
}

/// A desk with a pattern, and a gray sky, seen from a place above it.
fn desk_from(eye: Vec3, dir: DVec3) -> DVec3 {
    if dir.y >= 0.0 {
        return DVec3::splat(0.5);
    }
    let place = eye.as_dvec3() - dir * (f64::from(eye.y) / dir.y);
    // Flat far away, where texels are wide.
    DVec3::new(1.0 + (8.0 * place.x).tanh(), 1.0 + (8.0 * place.z).tanh(), 1.0)
}

#[test]
fn a_probe_beside_the_ball_mirrors_the_desk_that_is_under_it() {
    let (ball, eye) = (Vec3::new(0.1, 0.15, 0.0), Vec3::new(0.4, 0.1, 0.2));
    let Some((mut app, camera, _)) = lit_app(cube(128, |dir| desk_from(ball, dir))) else { return };
    let environment = LiveEnvironment::new(maps_source(&app, camera)).with_refresh(Refresh::OnChange);
    let parallax = DeskParallax { captured_from: ball, height: 0.0 };
    let start = Transform::from_translation(ball);
    let probe = app.world_mut().spawn((LightProbe::default(), environment, parallax, start)).id();
    let error = |app: &mut App, probe: Entity, from: Vec3| {
        let (_, glossy) = diffuse_and_glossy(app, probe);
        let errors = glossy.texels.iter().enumerate().filter_map(|(i, got)| {
            let dir = texel(128, i).0;
            (dir.y < -0.4).then(|| got.as_dvec3().distance(desk_from(from, dir)))
        });
        errors.fold(0.0, f64::max)
    };
    for _ in 0..4 {
        app.update();
    }
    let at_ball = error(&mut app, probe, ball);
    let before = error(&mut app, probe, eye);
    app.world_mut().get_mut::<Transform>(probe).expect("it is somewhere").translation = eye;
    for _ in 0..3 {
        app.update();
    }
    let after = error(&mut app, probe, eye);
    println!("desk from the ball off by {at_ball:.3}, from beside it by {after:.3}, without parallax by {before:.3}");
    // Four lookups across a texel 0.7° wide.
    assert!(at_ball < 0.01 && after < 0.01 && before > 0.5);
}

#[test]
fn light_probes_follow_the_exposure_of_the_camera_that_looks() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let environment = LiveEnvironment::new(maps_source(&app, camera));
    let probe = app.world_mut().spawn((LightProbe::default(), environment)).id();
    app.world_mut().entity_mut(camera).insert(Exposure { ev100: 3.0 });
    app.update();
    app.update();
    let intensity = |app: &App, entity| app.world().get::<EnvironmentMapLight>(entity).expect("is lit").intensity;
    assert_eq!(intensity(&app, probe), 1.0 / Exposure { ev100: 3.0 }.exposure());
    assert_eq!(intensity(&app, probe), intensity(&app, camera));
    app.world_mut().entity_mut(probe).insert(Exposure { ev100: 5.0 });
    app.update();
    assert_eq!(intensity(&app, probe), 1.0 / Exposure { ev100: 5.0 }.exposure(), "its own");
}
