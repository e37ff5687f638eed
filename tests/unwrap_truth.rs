//! What the unwrapped ball says against the light that the photographs were made with.

mod cubes;
mod gpu;
mod shared_data;
mod truth;

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels, srgb_to_linear},
    environment::CubePixels,
    lighting::{DeskPicture, PhantomSolid},
    prelude::*,
    probe::{BallView, ClipRecovery, EnvironmentCube, ProbePlugin},
};
use truth::TrueSky;

/// Worst channel of the irradiance from above against that of the clipped map; the studio's and the warehouse's lamps are smaller than a pixel of the
/// ball, which clips after mixing and not before.
const IRRADIANCE_TOLERANCE: [f32; 5] = [0.30, 0.03, 0.03, 0.30, 0.03];
/// Of the photograph, for balls 170, 85 and 29 pixels wide.
const REPRODUCTION_TOLERANCE: [f32; 3] = [0.02, 0.02, 0.05];
const REDUCTIONS: [u32; 3] = [1, 2, 6];
/// What the photograph mixes with the background.
const EDGE_MARGIN_PIXELS: f32 = 1.5;
/// Clipped, with a step of noise.
const CLIPPED_FROM: u8 = 253;

/// The environment that the ball of a picture shows, without recovery.
fn unwrap(picture: &DeskPicture) -> Option<CubePixels> {
    let mut app = gpu::app(|app| {
        app.add_plugins((CameraPlugin, ProbePlugin));
    })?;
    let feed = CameraFeed::pixels(picture.frame.clone()).with_pace(FeedPace::Lockstep);
    let pose = Transform::from_matrix(picture.camera_from_world.inverse().into());
    app.world_mut().spawn((ArCamera::new(picture.intrinsics), pose, Camera { is_active: false, ..default() }, feed));
    let ball = picture.ball;
    let sphere = LightProbeSphere { radius: ball.radius, reflectance: ball.reflectance, ..default() };
    let recovery = ClipRecovery { is_enabled: false, ..default() };
    let probe = app.world_mut().spawn((sphere, recovery, Transform::from_translation(ball.center))).id();
    for _ in 0..20 {
        app.update();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let cube = app.world().get::<EnvironmentCube>(probe).expect("every probe gets a cube").0.clone();
    Some(cubes::read(&mut app, &cube))
}

fn ball_view(picture: &DeskPicture) -> BallView {
    let center = picture.camera_from_world.transform_point3(picture.ball.center);
    BallView::new(center, picture.ball.radius).expect("in front of the camera")
}

/// The cells of a fine cube: directions and solid angles.
fn sphere(count: usize) -> impl Iterator<Item = Vec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        let (sin, cos) = (i as f64 * golden_angle).sin_cos();
        let across = (1.0 - y * y).sqrt();
        Vec3::new((across * cos) as f32, y as f32, (across * sin) as f32)
    })
}

/// Whether a phantom stands where the ball looks.
fn is_hidden(phantoms: &[PhantomSolid], triangles: &[[Vec3; 3]], origin: Vec3, dir: Vec3) -> bool {
    let _ = phantoms;
    triangles.iter().any(|[a, b, c]| {
        let (ab, ac) = (*b - *a, *c - *a);
        let p = dir.cross(ac);
        let det = ab.dot(p);
        if det.abs() < 1e-12 {
            return false;
        }
        let t = origin - *a;
        let u = t.dot(p) / det;
        let q = t.cross(ab);
        let v = dir.dot(q) / det;
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ac.dot(q) / det > 0.0
    })
}

#[test]
fn the_ball_sees_the_light_that_the_room_was_made_with() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    // Up, to the four sides, and three slanted ones.
    let slanted = |degrees: f32| Vec3::new(degrees.to_radians().cos(), 1.0, degrees.to_radians().sin()).normalize();
    let normals = [Vec3::Y, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, slanted(30.0), slanted(150.0), slanted(270.0)];
    let mut failed = Vec::new();
    for (room, tolerance) in truth::ROOMS.into_iter().zip(IRRADIANCE_TOLERANCE) {
        let picture = truth::desk_picture(&folder, room);
        let Some(cube) = unwrap(&picture) else { return };
        let sky = TrueSky::open(&folder, room);
        let triangles: Vec<[Vec3; 3]> = truth::phantom_meshes(&folder.join("desk.glb"))
            .into_iter()
            .filter(|mesh| mesh.casts && !mesh.triangles.iter().flatten().all(|p| p.distance(picture.ball.center) < 1.2 * picture.ball.radius))
            .flat_map(|mesh| mesh.triangles)
            .collect();
        let (mut found, mut wanted) = ([Vec3::ZERO; 8], [Vec3::ZERO; 8]);
        for dir in sphere(200_000).filter(|dir| dir.y > 0.0) {
            if is_hidden(&picture.phantoms, &triangles, picture.ball.center, dir) {
                continue;
            }
            let (seen, true_radiance) = (cube.sample(dir), sky.clipped_radiance(dir, picture.ball.reflectance));
            for (i, normal) in normals.iter().enumerate() {
                let cosine = normal.dot(dir).max(0.0);
                found[i] += cosine * seen;
                wanted[i] += cosine * true_radiance;
            }
        }
        let errors: Vec<f32> = (0..8).map(|i| ((found[i] - wanted[i]) / wanted[i]).abs().max_element()).collect();
        let gray: Vec<String> = (0..8).map(|i| format!("{:+.1}", 100.0 * (found[i].element_sum() / wanted[i].element_sum() - 1.0))).collect();
        let worst = errors.iter().copied().fold(0.0, f32::max);
        println!("{room}: worst channel of eight normals {:.2} %, gray {gray:?}", 100.0 * worst);
        if worst > tolerance {
            failed.push(room);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// The picture with every `factor`² pixels mixed into one.
fn reduced(picture: &DeskPicture, factor: u32) -> DeskPicture {
    let size = picture.frame.size / factor;
    let pixel = |i: u32| {
        let corner = UVec2::new(i % size.x, i / size.x) * factor;
        let inside = (0..factor * factor).map(|k| corner + UVec2::new(k % factor, k / factor));
        let mean = inside.map(|p| picture.frame.linear(p.x as i32, p.y as i32)).sum::<Vec3>() / (factor * factor) as f32;
        let srgb = Srgba::from(LinearRgba::from_vec3(mean)).to_u8_array();
        [srgb[0], srgb[1], srgb[2], 255]
    };
    let rgba = (0..size.x * size.y).flat_map(pixel).collect();
    DeskPicture {
        frame: FramePixels::new(size, rgba).expect("as many bytes as the size says").into(),
        intrinsics: picture.intrinsics.scaled_to(size),
        ..picture.clone()
    }
}

#[test]
fn the_ball_rendered_from_its_cube_is_the_ball_of_the_photograph() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    let mut failed = Vec::new();
    for room in ["open_studio", "open_lebombo", "open_potsdamer"] {
        for (factor, tolerance) in REDUCTIONS.into_iter().zip(REPRODUCTION_TOLERANCE) {
            let picture = reduced(&truth::desk_picture(&folder, room), factor);
            let Some(cube) = unwrap(&picture) else { return };
            let ball = ball_view(&picture);
            let outline = ball.outline(&picture.intrinsics);
            let (mut error, mut total, mut relative, mut count) = (0.0, 0.0, 0.0, 0.0);
            for i in 0..picture.frame.size.element_product() {
                let (x, y) = ((i % picture.frame.size.x) as i32, (i / picture.frame.size.x) as i32);
                let center = Vec2::new(x as f32, y as f32) + 0.5;
                let outward = center + (center - outline.center).normalize_or_zero() * EDGE_MARGIN_PIXELS;
                let is_clipped = picture.frame.rgb8(x, y).into_iter().any(|value| value >= CLIPPED_FROM);
                if !outline.contains(center) || !outline.contains(outward) || is_clipped {
                    continue;
                }
                const RAYS: u32 = 4;
                let rays = (0..RAYS * RAYS).filter_map(|k| {
                    let offset = (Vec2::new((k % RAYS) as f32, (k / RAYS) as f32) + 0.5) / RAYS as f32 - 0.5;
                    ball.mirrored_direction(picture.intrinsics.ray(center + offset))
                });
                let world_from_camera = picture.camera_from_world.inverse();
                let (mut sum, mut n) = (Vec3::ZERO, 0.0);
                for dir in rays {
                    sum += cube.sample(world_from_camera.transform_vector3(dir));
                    n += 1.0;
                }
                let rendered = (picture.ball.reflectance * sum / n).min(Vec3::ONE);
                let photographed = picture.frame.linear(x, y);
                error += (rendered - photographed).abs().element_sum();
                total += photographed.element_sum();
                relative += (rendered - photographed).abs().element_sum() / photographed.element_sum().max(3.0 * srgb_to_linear(10));
                count += 1.0;
            }
            println!(
                "{room}: ball {:.0} px wide: mean error {:.2} % of the mean, mean of relative errors {:.2} %, {count} pixels",
                2.0 * outline.semi_axes.x,
                100.0 * error / total,
                100.0 * relative / count
            );
            if error / total > tolerance {
                failed.push((room, factor));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}
