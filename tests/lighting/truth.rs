//! The path-traced desks of `shared/data/ar_truth`: pictures, what stands there, and the light they were made with.

use bevy::{
    math::{Affine3A, Quat},
    prelude::*,
};
use bevy_mirrorball::{
    camera::{FramePixels, Intrinsics},
    lighting::solver::{DeskFrame, MirrorBall, Paper, PhantomSolid},
    probe::BallSurface,
};
use serde_json::Value;
use std::{
    f32::consts::{PI, TAU},
    path::Path,
    sync::Arc,
};

pub(crate) const ROOMS: [&str; 5] = ["open_studio", "open_lebombo", "open_venice", "open_warehouse", "open_potsdamer"];

pub(crate) fn vector(value: &Value) -> Vec3 {
    let number = |i: usize| value[i].as_f64().expect("three numbers") as f32;
    Vec3::new(number(0), number(1), number(2))
}

pub(crate) fn sidecar(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("the sidecar")).expect("valid JSON")
}

/// A room as its photograph shows it, with the true pose of the camera.
pub(crate) fn desk_picture(folder: &Path, room: &str) -> DeskFrame {
    let truth = sidecar(&folder.join(format!("{room}.json")));
    let frame = FramePixels::open(folder.join(format!("{room}_frame.png"))).expect("the photograph");
    let k = |key: &str| truth["intrinsics"][key].as_f64().expect("a number") as f32;
    let intrinsics = Intrinsics::new(Vec2::new(k("fx"), k("fy")), Vec2::new(k("cx"), k("cy")), frame.size);
    let pose = &truth["camera_to_marker"];
    let world_from_camera =
        Transform::from_translation(vector(&pose["origin"])).looking_at(vector(&pose["target"]), Vec3::Y);
    let number = |v: &Value| v.as_f64().expect("a number") as f32;
    let ball = MirrorBall {
        center: vector(&truth["ball"]["center_m"]),
        radius: number(&truth["ball"]["radius_m"]),
        reflectance: number(&truth["ball"]["reflectance"]),
        surface: BallSurface::Mirror,
    };
    DeskFrame {
        frame: Arc::new(frame),
        intrinsics,
        camera_from_world: Affine3A::from_mat4(world_from_camera.to_matrix()).inverse(),
        ball,
        other_balls: Vec::new(),
        bracketed_exposures: Vec::new(),
        papers: vec![Paper {
            world_from_marker: Affine3A::from_translation(Vec3::new(0.0, 0.0006, 0.0)),
            size: number(&truth["marker"]["size_m"]),
            reflectance: 0.80,
        }],
        phantoms: Arc::new(phantoms(&folder.join("desk.glb"), &ball)),
        max_gain: 1000.0,
    }
}

/// The phantoms of a glTF file, without the one that stands for the ball.
fn phantoms(path: &Path, ball: &MirrorBall) -> Vec<PhantomSolid> {
    let solids = phantom_meshes(path).into_iter().map(|mesh| {
        let mut solid = PhantomSolid::from_triangles(mesh.triangles).expect("triangles");
        (solid.casts, solid.receives) = (mesh.casts, mesh.receives);
        solid
    });
    solids.filter(|solid| !solid.is_within(ball.center, 1.1 * ball.radius)).collect()
}

/// A phantom's triangles in the marker's frame.
pub(crate) struct PhantomMesh {
    pub triangles: Vec<[Vec3; 3]>,
    pub casts: bool,
    pub receives: bool,
}

/// The phantoms of a glTF file whose nodes lie flat at its root.
pub(crate) fn phantom_meshes(path: &Path) -> Vec<PhantomMesh> {
    let file = gltf::Gltf::open(path).expect("a glTF file");
    let bytes = file.blob.as_deref().expect("a binary chunk");
    let read = |accessor: &gltf::Accessor| {
        let view = accessor.view().expect("data");
        let (start, size) = (view.offset() + accessor.offset(), accessor.size());
        let stride = view.stride().unwrap_or(size);
        (0..accessor.count()).map(move |i| &bytes[start + i * stride..start + i * stride + size])
    };
    let float = |b: &[u8], i: usize| f32::from_le_bytes([b[4 * i], b[4 * i + 1], b[4 * i + 2], b[4 * i + 3]]);
    let mut solids = Vec::new();
    for node in file.nodes() {
        let extras: Value =
            node.extras().as_ref().map_or(Value::Null, |text| serde_json::from_str(text.get()).expect("valid JSON"));
        let Some(phantom) = extras.get("PhantomObject") else { continue };
        let (translation, rotation, scale) = node.transform().decomposed();
        let world =
            Affine3A::from_scale_rotation_translation(scale.into(), Quat::from_array(rotation), translation.into());
        for primitive in node.mesh().expect("a phantom has a mesh").primitives() {
            let positions = primitive.get(&gltf::Semantic::Positions).expect("positions");
            let positions: Vec<Vec3> = read(&positions)
                .map(|b| world.transform_point3(Vec3::new(float(b, 0), float(b, 1), float(b, 2))))
                .collect();
            let indices: Vec<usize> = match primitive.indices() {
                Some(accessor) => read(&accessor)
                    .map(|b| {
                        if b.len() == 2 {
                            usize::from(u16::from_le_bytes([b[0], b[1]]))
                        } else {
                            u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize
                        }
                    })
                    .collect(),
                None => (0..positions.len()).collect(),
            };
            let triangles = indices.chunks_exact(3).map(|t| [positions[t[0]], positions[t[1]], positions[t[2]]]);
            solids.push(PhantomMesh {
                triangles: triangles.collect(),
                casts: phantom["casts"].as_bool().unwrap_or(true),
                receives: phantom["receives"].as_bool().unwrap_or(true),
            });
        }
    }
    solids
}

/// An equirectangular map, turned as the room's sidecar says, in camera units.
pub(crate) struct TrueSky {
    width: usize,
    pixels: Vec<Vec3>,
    rotation_degrees: f32,
}

impl TrueSky {
    pub(crate) fn open(folder: &Path, room: &str) -> Self {
        let truth = sidecar(&folder.join(format!("{room}.json")));
        let file = folder.join("../hdr").join(truth["env"].as_str().expect("a name"));
        let picture = image::open(file).expect("a Radiance picture").into_rgb32f();
        let exposure = truth["exposure"].as_f64().expect("a number") as f32;
        Self {
            width: picture.width() as usize,
            pixels: picture.pixels().map(|p| Vec3::from_array(p.0).max(Vec3::ZERO) * exposure).collect(),
            rotation_degrees: truth["env_rotation_deg"].as_f64().expect("a number") as f32,
        }
    }

    /// Radiance from a direction as a ball of a given reflectance shows it where no lamp mixes with its surroundings.
    pub(crate) fn clipped_radiance(&self, dir: Vec3, reflectance: f32) -> Vec3 {
        let height = self.pixels.len() / self.width;
        let azimuth = (dir.x.atan2(-dir.z) + self.rotation_degrees.to_radians()).rem_euclid(TAU);
        let column = ((azimuth / TAU * self.width as f32) as usize).min(self.width - 1);
        let row = ((dir.y.clamp(-1.0, 1.0).acos() / PI * height as f32) as usize).min(height - 1);
        (self.pixels[row * self.width + column] * reflectance).min(Vec3::ONE) / reflectance
    }

    /// Irradiance at a surface that faces a direction, from what lies within an angle of it, in radians.
    pub(crate) fn irradiance_around(&self, towards: Vec3, angle: f32) -> Vec3 {
        let near = self.texels().filter(|(dir, ..)| dir.angle_between(towards) < angle);
        near.map(|(_, solid_angle, radiance)| radiance * solid_angle).sum()
    }

    /// Irradiance ÷ π at a surface. Below the horizon the map is not what the desk sees, so only the upper half counts.
    pub(crate) fn irradiance_from_above(&self, normal: Vec3) -> Vec3 {
        let above = self.texels().filter(|(dir, ..)| dir.y > 0.0);
        above.map(|(dir, solid_angle, radiance)| radiance * (solid_angle * dir.dot(normal).max(0.0))).sum::<Vec3>() / PI
    }

    /// Direction, solid angle and radiance of each texel.
    fn texels(&self) -> impl Iterator<Item = (Vec3, f32, Vec3)> {
        let height = self.pixels.len() / self.width;
        self.pixels.iter().enumerate().map(move |(i, radiance)| {
            let (row, column) = (i / self.width, i % self.width);
            let polar = PI * (row as f32 + 0.5) / height as f32;
            let solid_angle = polar.sin() * (PI / height as f32) * (TAU / self.width as f32);
            let azimuth = TAU * (column as f32 + 0.5) / self.width as f32 - self.rotation_degrees.to_radians();
            let dir = Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
            (dir, solid_angle, *radiance)
        })
    }
}
