//! Outlines: width, corners and skinned meshes.

use crate::studio::{EXTENT, RADIUS, SIZE, Studio, toon};
use bevy::{
    mesh::{
        VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_mirrorball::prelude::*;

#[test]
fn the_outline_is_a_ring_of_its_width() {
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    let green = Color::linear_rgb(0.0, 1.0, 0.0);
    for wanted in [0, 2, 5, 0, 1] {
        studio.set_style(SurfaceStyle::Toon(ToonStyle {
            outline_width: wanted as f32,
            outline_color: green,
            ..default()
        }));
        let picture = studio.shoot();
        let row = SIZE.y / 2;
        let widths = [0..SIZE.x / 2, SIZE.x / 2..SIZE.x].map(|columns| picture.outline_in_row(row, columns));
        let ring: usize = (0..SIZE.y).map(|row| picture.outline_in_row(row, 0..SIZE.x)).sum();
        let radius = RADIUS / EXTENT * 0.5 * SIZE.y as f32;
        let expected = std::f32::consts::PI * ((radius + wanted as f32).powi(2) - radius.powi(2));
        println!("{wanted} pixels wanted: {widths:?} at the sides, {ring} in all, expected {expected:.0}");
        // A pixel belongs to the ring or not; the ball is a polyhedron.
        assert!(widths.iter().all(|width| width.abs_diff(wanted) <= usize::from(wanted > 0)));
        assert!((ring as f32 - expected).abs() <= 0.15 * expected + 1.0);
    }
}

#[test]
fn the_outline_of_a_box_has_no_gaps_at_its_corners() {
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let style = ToonStyle { outline_width: 4.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let turned = Transform::from_rotation(Quat::from_euler(EulerRot::YXZ, 0.6, 0.5, 0.2));
    studio.add(Cuboid::from_length(0.5), Color::WHITE, (SurfaceStyle::Toon(style), turned));
    let picture = studio.shoot();
    // Walking from the box outwards in any direction, one meets the outline before the background.
    for step in 0..180 {
        let dir = Vec2::from_angle(step as f32 * std::f32::consts::TAU / 180.0);
        let first_outside = (0..SIZE.x / 2)
            .map(|t| picture.linear((0.5 * SIZE.as_vec2() + dir * t as f32).as_uvec2()))
            .find(|color| color.y > 0.9 || color.z > 0.4);
        assert!(first_outside.is_some_and(|color| color.y > 0.9), "a gap at {}°", 2 * step);
    }
}

#[test]
fn the_outline_follows_bones() {
    const SHIFT: f32 = 0.3;
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let style = ToonStyle { outline_width: 3.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let small = Sphere::new(0.2).mesh().ico(12).expect("few enough");
    let count = small.count_vertices();
    let small = small
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, VertexAttributeValues::Uint16x4(vec![[0; 4]; count]))
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0, 0.0, 0.0, 0.0]; count]);
    let world = studio.app.world_mut();
    let poses = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]);
    let inverse_bindposes = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>().add(poses);
    let bone = world.spawn((Transform::default(), Visibility::default())).id();
    let skin = SkinnedMesh { inverse_bindposes, joints: vec![bone] };
    studio.add(small, Color::WHITE, (SurfaceStyle::Toon(style), skin));
    let mut edges = Vec::new();
    for shift in [0.0, SHIFT] {
        studio.app.world_mut().entity_mut(bone).insert(Transform::from_xyz(shift, 0.0, 0.0));
        let picture = studio.shoot();
        let row = SIZE.y / 2;
        let ring: Vec<u32> = (0..SIZE.x).filter(|x| picture.outline_in_row(row, *x..*x + 1) == 1).collect();
        println!("shifted by {shift} m: outline at {ring:?}");
        assert_eq!(ring.len(), 6);
        edges.push(ring);
    }
    let moved = (SHIFT / EXTENT * 0.5 * SIZE.y as f32) as u32;
    assert!(edges[0].iter().zip(&edges[1]).all(|(before, after)| after - before == moved));
}
