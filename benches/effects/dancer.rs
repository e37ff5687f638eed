//! A dancing figure of round parts, 15 cm tall.
//!
//! Feet and hands follow simple curves in time with the beat. Knees and elbows follow from the lengths of the limbs.

use bevy::prelude::*;
use std::f32::consts::PI;

/// Progress of the dance.
#[derive(Resource, Default)]
pub(crate) struct Dance {
    pub beats: f32,
    pub is_held: bool,
}

const BEATS_PER_SECOND: f32 = 2.0;

/// The dancer. Her feet are at the entity's origin, and she faces −Z.
#[derive(Component)]
pub(crate) struct Dancer;

/// Part of the dancer's body, a child of the [`Dancer`].
#[derive(Component, Clone, Copy)]
pub(crate) enum Part {
    Hips,
    Chest,
    Head,
    Hair,
    Eye(Side),
    UpperArm(Side),
    Forearm(Side),
    Hand(Side),
    Thigh(Side),
    Shin(Side),
    Foot(Side),
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Side {
    Left,
    Right,
}

impl Side {
    const BOTH: [Self; 2] = [Self::Left, Self::Right];

    fn sign(self) -> f32 {
        if self == Self::Left { -1.0 } else { 1.0 }
    }
}

// Lengths in meters.
const UPPER_ARM: f32 = 0.031;
const FOREARM: f32 = 0.030;
const THIGH: f32 = 0.036;
const SHIN: f32 = 0.036;
const HIP_HEIGHT: f32 = 0.074;
const FOOT_HEIGHT: f32 = 0.006;

/// Spawns the parts of a dancer as children of an entity.
pub(crate) fn spawn(dancer: &mut EntityCommands, meshes: &mut Assets<Mesh>, materials: &mut Assets<StandardMaterial>) {
    let mut paint = |color: Color, roughness: f32| {
        materials.add(StandardMaterial { base_color: color, perceptual_roughness: roughness, ..default() })
    };
    let skin = paint(Color::srgb(0.80, 0.56, 0.44), 0.6);
    let shirt = paint(Color::srgb(0.86, 0.22, 0.25), 0.8);
    let trousers = paint(Color::srgb(0.16, 0.30, 0.55), 0.8);
    let shoes = paint(Color::srgb(0.93, 0.92, 0.88), 0.25);
    let hair = paint(Color::srgb(0.16, 0.09, 0.05), 0.45);
    let ball = |radius: f32| Sphere::new(radius).mesh().uv(24, 12);
    // A capsule's mesh is centered, but limbs turn about their upper end.
    let capsule = |radius: f32, length: f32| Capsule3d::new(radius, length).mesh().longitudes(16).latitudes(8).build();
    let limb = |radius: f32, length: f32| capsule(radius, length).translated_by(Vec3::Y * -0.5 * length);
    let mut part = |part: Part, mesh: Mesh, material: &Handle<StandardMaterial>| {
        dancer.with_child((part, Mesh3d(meshes.add(mesh)), MeshMaterial3d(material.clone()), Transform::default()));
    };
    part(Part::Hips, ball(0.0155).scaled_by(Vec3::new(1.05, 0.85, 0.85)), &trousers);
    part(Part::Chest, capsule(0.0155, 0.022).scaled_by(Vec3::new(1.1, 1.0, 0.85)), &shirt);
    part(Part::Head, ball(0.0185), &skin);
    part(Part::Hair, ball(0.0195), &hair);
    for side in Side::BOTH {
        part(Part::Eye(side), ball(0.0028), &hair);
        part(Part::UpperArm(side), limb(0.0068, UPPER_ARM), &shirt);
        part(Part::Forearm(side), limb(0.0056, FOREARM), &skin);
        part(Part::Hand(side), ball(0.0078), &skin);
        part(Part::Thigh(side), limb(0.0095, THIGH), &trousers);
        part(Part::Shin(side), limb(0.0078, SHIN), &trousers);
        part(Part::Foot(side), ball(0.0085).scaled_by(Vec3::new(0.9, 0.7, 1.6)), &shoes);
    }
}

pub(crate) fn keep_the_beat(mut dance: ResMut<Dance>, time: Res<Time>) {
    if !dance.is_held {
        dance.beats += time.delta_secs() * BEATS_PER_SECOND;
    }
}

pub(crate) fn dance(
    dance: Res<Dance>,
    mut dancers: Query<(&mut Transform, &Children), With<Dancer>>,
    mut parts: Query<(&Part, &mut Transform), Without<Dancer>>,
) {
    for (mut dancer, children) in &mut dancers {
        let pose = Pose::at(dance.beats);
        // What stays where it is does not count as changed, so that nothing is drawn anew for it.
        let turned = Transform { rotation: Quat::from_rotation_y(pose.turn), ..*dancer };
        dancer.set_if_neq(turned);
        for child in children {
            if let Ok((part, mut transform)) = parts.get_mut(*child) {
                transform.set_if_neq(pose.place(*part));
            }
        }
    }
}

/// Pose of the dancer at one moment, in her own frame of reference.
struct Pose {
    turn: f32,
    hips: Vec3,
    lean: Quat,
    nod: Quat,
    beats: f32,
}

impl Pose {
    fn at(beats: f32) -> Self {
        let sway = (PI * beats).sin();
        let bounce = (2.0 * PI * beats).cos();
        Self {
            turn: 0.7 * (PI * beats / 8.0).sin(),
            hips: Vec3::new(0.008 * sway, HIP_HEIGHT + 0.0035 * bounce, 0.0),
            lean: Quat::from_euler(EulerRot::YXZ, 0.25 * sway, -0.06 - 0.05 * bounce, -0.12 * sway),
            nod: Quat::from_euler(EulerRot::YXZ, 0.3 * (PI * beats / 2.0).sin(), -0.12 * bounce, 0.1 * sway),
            beats,
        }
    }

    fn place(&self, part: Part) -> Transform {
        let chest = self.hips + self.lean * Vec3::new(0.0, 0.026, 0.0);
        let head = self.hips + self.lean * Vec3::new(0.0, 0.068, -0.001);
        let head_rotation = self.lean * self.nod;
        match part {
            Part::Hips => Transform::from_translation(self.hips).with_rotation(self.lean),
            Part::Chest => Transform::from_translation(chest).with_rotation(self.lean),
            Part::Head => Transform::from_translation(head).with_rotation(head_rotation),
            Part::Hair => Transform::from_translation(head + head_rotation * Vec3::new(0.0, 0.0035, 0.0045)),
            Part::Eye(side) => {
                Transform::from_translation(head + head_rotation * Vec3::new(0.0065 * side.sign(), 0.0015, -0.0168))
            }
            Part::UpperArm(side) => self.arm(side).upper(),
            Part::Forearm(side) => self.arm(side).lower(),
            Part::Hand(side) => Transform::from_translation(self.arm(side).end),
            Part::Thigh(side) => self.leg(side).upper(),
            Part::Shin(side) => self.leg(side).lower(),
            Part::Foot(side) => {
                let leg = self.leg(side);
                Transform::from_translation(leg.end + Vec3::new(0.0, 0.0, -0.005))
            }
        }
    }

    fn arm(&self, side: Side) -> Limb {
        let sign = side.sign();
        let shoulder = self.hips + self.lean * Vec3::new(0.0215 * sign, 0.041, 0.0);
        // One hand is up and one is out; they change places on every beat.
        let wave = 0.5 + 0.5 * (PI * self.beats + if side == Side::Left { 0.0 } else { PI }).sin();
        let reach = Vec3::new(sign * (0.040 - 0.012 * wave), -0.018 + 0.066 * wave, -0.018);
        Limb::bent(shoulder, shoulder + self.lean * reach, UPPER_ARM, FOREARM, Vec3::new(sign, -0.6, 0.6))
    }

    fn leg(&self, side: Side) -> Limb {
        let sign = side.sign();
        let hip = self.hips + self.lean * Vec3::new(0.0095 * sign, -0.006, 0.0);
        // Each foot taps to the side on every other beat.
        let tap = (PI * self.beats + if side == Side::Left { PI } else { 0.0 }).sin().max(0.0);
        let foot = Vec3::new(sign * (0.014 + 0.016 * tap), FOOT_HEIGHT + 0.014 * tap * (1.0 - tap), -0.004 * tap);
        Limb::bent(hip, foot, THIGH, SHIN, Vec3::new(0.35 * sign, 0.0, -1.0))
    }
}

/// Two bones between a joint and an end.
struct Limb {
    start: Vec3,
    middle: Vec3,
    end: Vec3,
}

impl Limb {
    /// Solves the limb for a target, as far as the bones reach. The middle joint bends in the direction `towards`.
    fn bent(start: Vec3, target: Vec3, upper: f32, lower: f32, towards: Vec3) -> Self {
        let span = target - start;
        let distance = span.length().clamp((upper - lower).abs() + 1e-4, upper + lower - 1e-4);
        let along = span.normalize_or(Vec3::NEG_Y);
        let aside = towards.reject_from_normalized(along).normalize_or(Vec3::X);
        let cosine = (upper * upper + distance * distance - lower * lower) / (2.0 * upper * distance);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let middle = start + upper * (cosine * along + sine * aside);
        Self { start, middle, end: start + distance * along }
    }

    fn upper(&self) -> Transform {
        hanging(self.start, self.middle)
    }

    fn lower(&self) -> Transform {
        hanging(self.middle, self.end)
    }
}

/// Transform of an object that hangs down from its origin, placed at `from` and turned to point at `to`.
fn hanging(from: Vec3, to: Vec3) -> Transform {
    let direction = (to - from).normalize_or(Vec3::NEG_Y);
    Transform::from_translation(from).with_rotation(Quat::from_rotation_arc(Vec3::NEG_Y, direction))
}
