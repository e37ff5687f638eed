//! Light the camera clipped, recovered from what stands on the desk. Needs no GPU.

mod shared_data;
mod truth;

use bevy::prelude::*;
use bevy_mirrorball::lighting::{SolvedLight, SolverCache, solve_light};
use truth::{ROOMS, TrueSky, desk_picture};

/// The marker's normal and seven tilted by 53° against it.
fn normals() -> [Vec3; 8] {
    std::array::from_fn(|i| {
        if i == 7 {
            return Vec3::Y;
        }
        let azimuth = std::f32::consts::TAU * i as f32 / 7.0;
        let (sin, cos) = 53_f32.to_radians().sin_cos();
        Vec3::new(sin * azimuth.sin(), cos, -sin * azimuth.cos())
    })
}

/// Irradiance ÷ π from the upper half; what lies below is the desk, which the true map does not hold.
fn irradiance_from_above(light: &SolvedLight, normal: Vec3) -> Vec3 {
    let above = light.sky().filter(|(dir, ..)| dir.y > 0.0);
    above.map(|(dir, solid_angle, radiance)| radiance * (solid_angle * dir.dot(normal).max(0.0))).sum::<Vec3>()
        / std::f32::consts::PI
}

#[test]
fn recovered_light_shines_like_the_true_room() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    for room in ROOMS {
        let picture = desk_picture(&folder, room);
        let started = std::time::Instant::now();
        let mut cache = SolverCache::default();
        let solved = solve_light(&picture, &mut cache).expect("ball and paper are in view");
        let first = started.elapsed();
        let started = std::time::Instant::now();
        let again = solve_light(&picture, &mut cache).expect("ball and paper are in view");
        assert!(again == solved, "the same picture, the same answer");
        let sky = TrueSky::open(&folder, room);
        println!(
            "{room}: {} regions, {} points ({} paper), residual {:.3}, paper {:.3}, condition {:.0}; {:.0} ms, then {:.0} ms",
            solved.regions.len(),
            solved.points,
            solved.paper_points,
            solved.residual,
            solved.paper_ratio,
            solved.condition,
            first.as_secs_f64() * 1e3,
            started.elapsed().as_secs_f64() * 1e3,
        );
        let mut regions = solved.regions.clone();
        regions
            .sort_by(|a, b| (b.gain.element_sum() * b.solid_angle).total_cmp(&(a.gain.element_sum() * a.solid_angle)));
        for r in regions.iter().take(4) {
            let elevation = r.direction.y.asin().to_degrees();
            let azimuth = r.direction.x.atan2(-r.direction.z).to_degrees();
            println!(
                "   el {elevation:.1} az {azimuth:.1} sr {:.4} gain {:.1} confidence {:.2}",
                r.solid_angle, r.gain, r.confidence
            );
        }
        for light in solved.lights() {
            let d = light.direction;
            println!(
                "   LIGHT el {:.1} az {:.1} share {:.3} E {:.2} radius {:.1}",
                d.y.asin().to_degrees(),
                d.x.atan2(-d.z).to_degrees(),
                light.share,
                light.irradiance,
                light.angular_radius.to_degrees()
            );
        }
        for normal in normals() {
            let (ours, theirs) = (irradiance_from_above(&solved, normal), sky.irradiance_from_above(normal));
            println!("   normal {normal:.2}: {ours:.3} truth {theirs:.3} off {:.2}", (ours - theirs) / theirs);
        }
    }
}
