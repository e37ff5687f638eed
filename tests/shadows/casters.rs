//! Shadows of skinned, morphed and alpha-masked meshes.

use crate::desk::{Desk, Shot};
use bevy::{
    asset::RenderAssetUsages,
    light::NotShadowCaster,
    mesh::{
        VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::{materials::SurfaceStyle, shadows::DomeState};

/// Rounding to 8 bits, and where edges fall on pixels.
const ALIKE: u8 = 2;
/// Different shadows differ by more.
const DIFFERENT: u8 = 20;
const BOX: Vec3 = Vec3::new(0.05, 0.06, 0.05);
const REST: Vec3 = Vec3::new(-0.05, 0.03, 0.0);
const MOVED: Vec3 = Vec3::new(0.08, 0.05, -0.06);

/// Bounced light too comes from where a mesh has been taken.
fn desk() -> Option<Desk> {
    Desk::new().map(Desk::with_bounces)
}

/// What the desk looks like with a plain box at a place.
fn plain(place: Vec3) -> Option<Shot> {
    let mut desk = desk()?;
    desk.add_virtual(Cuboid::from_size(BOX), place);
    Some(desk.shoot())
}

fn check(name: &str, shot: &Shot, rest: &Shot, moved: &Shot) {
    let (from_rest, from_moved) = (shot.difference(&rest.0), shot.difference(&moved.0));
    println!("{name}: differs by {from_moved}/255 from a plain box there, by {from_rest} from one at rest");
    assert!(from_moved <= ALIKE && from_rest >= DIFFERENT);
}

#[test]
fn a_skinned_mesh_casts_where_its_joints_have_taken_it() {
    let (Some(rest), Some(moved), Some(mut desk)) = (plain(REST), plain(MOVED), desk()) else { return };
    let mut mesh = Mesh::from(Cuboid::from_size(BOX));
    let count = mesh.count_vertices();
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, VertexAttributeValues::Uint16x4(vec![[1, 0, 0, 0]; count]));
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[0.75f32, 0.25, 0.0, 0.0]; count]);
    let world = desk.app.world_mut();
    let still = world.spawn((Transform::from_translation(REST), Visibility::default())).id();
    // Three quarters of the way are this joint's.
    let moving = world.spawn((Transform::from_translation(REST + (MOVED - REST) / 0.75), Visibility::default())).id();
    let poses = vec![Mat4::IDENTITY, Mat4::IDENTITY];
    let inverse_bindposes = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>().add(poses);
    let skinned = desk.add_virtual(mesh, REST);
    desk.app.world_mut().entity_mut(skinned).insert(SkinnedMesh { inverse_bindposes, joints: vec![still, moving] });
    check("skinned", &desk.shoot(), &rest, &moved);

    desk.app.world_mut().entity_mut(moving).insert(Transform::from_translation(REST));
    let back = desk.shoot();
    println!("joint moved back: off by {}/255", back.difference(&rest.0));
    assert!(back.difference(&rest.0) <= ALIKE);
}

#[test]
fn a_morphed_mesh_casts_as_it_is_seen() {
    let (Some(rest), Some(moved), Some(mut desk)) = (plain(REST), plain(MOVED), desk()) else { return };
    // Another morphed mesh before it, so that its displacements do not come first in the buffer.
    for (place, shift, weight) in [(REST, MOVED - REST, 1.0), (REST, 2.0 * (MOVED - REST), 0.5)] {
        let mut mesh = Mesh::from(Cuboid::from_size(BOX));
        let displacement = |by: Vec3| MorphAttributes::from([by, Vec3::ZERO, Vec3::ZERO]);
        let count = mesh.count_vertices();
        let targets = [vec![displacement(Vec3::Y); count], vec![displacement(shift); count]].concat();
        mesh.set_morph_targets(targets);
        let morphed = desk.add_virtual(mesh, place);
        let weights = MeshMorphWeights::Value { weights: vec![0.0, weight] };
        desk.app.world_mut().entity_mut(morphed).insert(weights);
        check("morphed", &desk.shoot(), &rest, &moved);
        desk.app.world_mut().entity_mut(morphed).insert(MeshMorphWeights::Value { weights: vec![0.0, 0.0] });
        let back = desk.shoot();
        assert!(back.difference(&rest.0) <= ALIKE, "off by {} without weights", back.difference(&rest.0));
        desk.app.world_mut().entity_mut(morphed).insert(Visibility::Hidden);
    }
}

/// White, opaque on the left half only.
fn half_opaque() -> Image {
    let extent = Extent3d { width: 64, height: 1, depth_or_array_layers: 1 };
    let texels = (0..64u8).flat_map(|x| [255, 255, 255, if x < 32 { 255 } else { 0 }]).collect();
    Image::new(extent, TextureDimension::D2, texels, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::all())
}

#[test]
fn a_cut_out_sheet_casts_the_shadow_of_what_is_left() {
    let place = Vec3::new(0.0, 0.06, 0.0);
    let sheet = |width: f32| Plane3d::default().mesh().size(width, 0.1).build();
    let shot = |width: f32, x: f32, mask: bool| {
        let mut desk = desk()?;
        let texture = desk.app.world_mut().resource_mut::<Assets<Image>>().add(half_opaque());
        let material = StandardMaterial {
            base_color_texture: mask.then_some(texture),
            alpha_mode: if mask { AlphaMode::Mask(0.5) } else { AlphaMode::Opaque },
            ..default()
        };
        let material = desk.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material);
        desk.add(sheet(width), place + x * Vec3::X, MeshMaterial3d(material));
        Some(desk.shoot())
    };
    let (Some(whole), Some(half), Some(cut)) =
        (shot(0.16, 0.0, false), shot(0.08, -0.04, false), shot(0.16, 0.0, true))
    else {
        return;
    };
    check("cut out", &cut, &whole, &half);
}

#[test]
fn another_style_draws_no_shadow_map() {
    let Some(mut desk) = Desk::new() else { return };
    let things = [REST, MOVED].map(|place| desk.add_virtual(Cuboid::from_size(BOX), place));
    desk.shoot();
    for (thing, style) in [
        (things[0], SurfaceStyle::Toon(default())),
        (things[1], SurfaceStyle::Engine),
        (things[0], SurfaceStyle::Classic(default())),
        (things[0], SurfaceStyle::ImageBased),
    ] {
        desk.app.world_mut().entity_mut(thing).insert(style);
        for _ in 0..3 {
            desk.app.update();
            let state = desk.app.world().get::<DomeState>(desk.dome).expect("it is a dome");
            assert_eq!((state.casters, state.redrawn), (2, 0), "{style:?}");
        }
    }
}

#[test]
fn shadow_maps_are_drawn_when_something_moves_and_only_then() {
    let Some(mut desk) = Desk::new() else { return };
    let thing = desk.add_virtual(Cuboid::from_size(BOX), REST);
    desk.shoot();
    let state = |desk: &Desk| *desk.app.world().get::<DomeState>(desk.dome).expect("it is a dome");
    for _ in 0..4 {
        desk.app.update();
        assert_eq!((state(&desk).redrawn, state(&desk).outdated), (0, 0), "nothing moves");
    }
    assert_eq!(state(&desk).casters, 1);
    desk.app.world_mut().entity_mut(thing).insert(Transform::from_translation(MOVED));
    let mut redrawn = Vec::new();
    for _ in 0..6 {
        desk.app.update();
        redrawn.push(state(&desk).redrawn);
    }
    println!("after one movement: {redrawn:?} directions");
    assert_eq!(redrawn, [16, 16, 16, 16, 0, 0]);

    for step in 1..=24 {
        let place = MOVED + 0.002 * step as f32 * Vec3::X;
        desk.app.world_mut().entity_mut(thing).insert(Transform::from_translation(place));
        desk.app.update();
        assert!(state(&desk).oldest_main <= 8, "{:?}", state(&desk));
        assert_eq!(state(&desk).redrawn, 16);
    }
    assert!(state(&desk).main < 64, "the light of the directions has come back: {:?}", state(&desk));
    desk.app.world_mut().entity_mut(thing).insert(NotShadowCaster);
    desk.shoot();
    assert_eq!(state(&desk).casters, 0);
}

#[test]
fn what_moves_step_by_step_leaves_no_old_shadows() {
    let (Some(there), Some(mut desk)) = (plain(MOVED), desk()) else { return };
    let thing = desk.add_virtual(Cuboid::from_size(BOX), REST);
    desk.shoot();
    for step in 1..=10 {
        let place = REST.lerp(MOVED, step as f32 / 10.0);
        desk.app.world_mut().entity_mut(thing).insert(Transform::from_translation(place));
        desk.app.update();
    }
    let arrived = desk.shoot().difference(&there.0);
    println!("after ten steps: off by {arrived}/255");
    assert!(arrived <= 2 * ALIKE);
}
