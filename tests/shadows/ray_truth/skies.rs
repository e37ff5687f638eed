//! Shadows under whole skies, uniform and photographed.

use super::rays::{CUBE_EDGE, compare, furnished_desk, set_dome, sky, things, truth};
use crate::shared_data;
use bevy::prelude::*;
use bevy_mirrorball::{
    environment_map::{EnvironmentCube, EquirectPixels},
    prelude::*,
    shadows::{DomeCoverage, ShadowFilter, VisibilitySamples},
};

const REAL_SKIES: [&str; 6] = [
    "studio_small_03_1k.hdr",
    "lebombo_1k.hdr",
    "venice_sunset_1k.hdr",
    "empty_warehouse_01_1k.hdr",
    "potsdamer_platz_1k.hdr",
    "night.exr",
];

#[test]
fn under_an_even_sky_shadows_are_those_of_rays() {
    let Some(mut desk) = furnished_desk() else { return };
    let truth = truth(&things(), &sky(|_| Vec3::ONE));
    let shaded = truth.iter().filter(|(_, ratio)| ratio.y < 0.95).count();
    println!("{} places, {shaded} of them in shadow", truth.len());
    assert!(shaded > 500, "there are shadows to compare");
    let bilinear = ShadowFilter::Bilinear;
    let soft = ShadowFilter::Pcss { angular_radius: 0.1 };
    for (directions, samples, filter, goal) in [
        (64, VisibilitySamples::Interleaved, bilinear, 0.02),
        (64, VisibilitySamples::Half, bilinear, 0.02),
        (64, VisibilitySamples::Full, bilinear, 0.02),
        (64, VisibilitySamples::Fragment, bilinear, 0.02),
        (64, VisibilitySamples::Full, soft, 0.01),
        (256, VisibilitySamples::Interleaved, bilinear, 0.01),
        (256, VisibilitySamples::Half, bilinear, 0.01),
        (256, VisibilitySamples::Full, bilinear, 0.01),
    ] {
        set_dome(&mut desk, ShadowDomeLight { directions, samples, filter, ..default() });
        let errors = compare(&desk.shoot(), &truth);
        println!(
            "{directions} directions, {samples:?}, {filter:?}: RMSE {:.4} (in shadow {:.4}), worst {:.3}",
            errors.rms, errors.rms_in_shadow, errors.worst
        );
        assert!(errors.rms <= goal);
    }
}

#[test]
fn under_real_skies_shadows_are_close_to_those_of_rays() {
    let Some(mut desk) = furnished_desk() else { return };
    desk.forget_light();
    for name in REAL_SKIES {
        let Some(file) = shared_data::find(&format!("hdr/{name}")) else { return };
        let picture = EquirectPixels::open(&file).expect("an environment");
        let cube = picture.to_cube(CUBE_EDGE, Quat::IDENTITY);
        let truth = truth(&things(), &sky(|dir| cube.sample(dir)));
        let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(cube.to_image());
        let probe = desk.app.world_mut().spawn(EnvironmentCube(image)).id();
        for directions in [64, 256] {
            set_dome(&mut desk, ShadowDomeLight { directions, ..default() });
            let errors = compare(&desk.shoot(), &truth);
            println!(
                "{name}, {directions} directions: RMSE {:.4} (in shadow {:.4}), worst {:.3}",
                errors.rms, errors.rms_in_shadow, errors.worst
            );
            assert!(errors.rms <= 0.15);
        }
        desk.app.world_mut().despawn(probe);
    }
}

#[test]
fn a_dome_all_around_shadows_like_one_above() {
    let Some(mut desk) = furnished_desk() else { return };
    let truth = truth(&things(), &sky(|_| Vec3::ONE));
    set_dome(&mut desk, ShadowDomeLight { directions: 128, coverage: DomeCoverage::Sphere, ..default() });
    let errors = compare(&desk.shoot(), &truth);
    println!("128 directions all around: RMSE {:.4}, worst {:.3}", errors.rms, errors.worst);
    assert!(errors.rms <= 0.02);
}
