//! Outlines of balls and phantoms as a distant light sees them: where the edges of their shadows begin.

use super::desk_frame::{DeskGeometry, MirrorBall};
use glam::Vec3;
use std::{collections::BTreeMap, f32::consts::TAU};

/// Point on an outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutlinePoint {
    /// World space, meters.
    pub pos: Vec3,
    /// Unit vector at right angles to the outline and to the direction of the light, away from the solid.
    pub outward: Vec3,
}

/// Balls, and the edges of phantoms that cast shadows.
#[derive(Clone, Debug, Default)]
pub(super) struct Silhouettes {
    balls: Vec<MirrorBall>,
    edges: Vec<MeshEdge>,
}

/// Edge of a mesh where two triangles meet at an angle, or where a mesh ends.
#[derive(Clone, Copy, Debug)]
struct MeshEdge {
    ends: [Vec3; 2],
    /// Normals of the two triangles; at the end of a mesh, that of the triangle and its opposite.
    normals: [Vec3; 2],
    /// Third corner of one of the triangles.
    apex: Vec3,
}

/// Vertices closer than this are one, meters. Meshes repeat vertices where normals differ.
const WELD_DISTANCE: f32 = 1e-5;
/// Largest cosine between the normals of two triangles that form an edge.
const MAX_FLAT_COSINE: f32 = 0.9999;

impl Silhouettes {
    pub(super) fn new(geometry: DeskGeometry) -> Self {
        let meshes = geometry.phantoms.iter().filter(|phantom| phantom.casts);
        let edges = meshes.flat_map(|phantom| mesh_edges(phantom.triangles())).collect();
        Self { balls: geometry.balls.to_vec(), edges }
    }

    /// Points at equal distances along the outlines as seen from a direction, some `count` of them.
    pub(super) fn outline(&self, dir: Vec3, count: usize) -> Vec<OutlinePoint> {
        let (right, up) = dir.any_orthonormal_pair();
        let outline: Vec<&MeshEdge> = self.edges.iter().filter(|edge| edge.is_outline(dir)).collect();
        let length_across = |edge: &MeshEdge| (edge.ends[1] - edge.ends[0]).reject_from_normalized(dir).length();
        let round: f32 = self.balls.iter().map(|ball| TAU * ball.radius).sum();
        let total = round + outline.iter().map(|edge| length_across(edge)).sum::<f32>();
        let step = total / count.max(1) as f32;
        let mut points = Vec::with_capacity(count + self.balls.len());
        if !(step > 0.0 && step.is_finite()) {
            return points;
        }
        for ball in &self.balls {
            let around = (TAU * ball.radius / step).ceil().max(1.0);
            points.extend((0..around as usize).map(|i| {
                let (sin, cos) = (TAU * i as f32 / around).sin_cos();
                let outward = cos * right + sin * up;
                OutlinePoint { pos: ball.center + ball.radius * outward, outward }
            }));
        }
        // What one edge leaves of a step continues on the next one, so that fine meshes get no more points.
        let mut next = 0.5 * step;
        for edge in outline {
            let along = edge.ends[1] - edge.ends[0];
            let length = length_across(edge);
            let across = dir.cross(along).normalize_or_zero();
            let outward = if across.dot(edge.apex - edge.ends[0]) > 0.0 { -across } else { across };
            while next < length && outward != Vec3::ZERO {
                points.push(OutlinePoint { pos: edge.ends[0] + along * (next / length), outward });
                next += step;
            }
            next = (next - length).max(0.0);
        }
        points
    }
}

impl MeshEdge {
    /// Whether one triangle faces a direction and the other one does not.
    fn is_outline(&self, dir: Vec3) -> bool {
        self.normals[0].dot(dir) * self.normals[1].dot(dir) < 0.0
    }
}

fn mesh_edges(triangles: &[[Vec3; 3]]) -> Vec<MeshEdge> {
    let place = |p: Vec3| (p / WELD_DISTANCE).round().as_ivec3();
    let mut edges: BTreeMap<[[i32; 3]; 2], (MeshEdge, bool)> = BTreeMap::new();
    for [a, b, c] in triangles {
        let normal = (*b - *a).cross(*c - *a).normalize_or_zero();
        if normal == Vec3::ZERO {
            continue;
        }
        for [from, to, apex] in [[a, b, c], [b, c, a], [c, a, b]] {
            let mut ends = [place(*from), place(*to)].map(|p| p.to_array());
            ends.sort_unstable();
            let alone = MeshEdge { ends: [*from, *to], normals: [normal, -normal], apex: *apex };
            let (edge, is_new) = edges.entry(ends).or_insert((alone, true));
            // The first triangle has just been inserted; the second one replaces the end of the mesh.
            if *is_new {
                *is_new = false;
            } else if edge.normals[1] == -edge.normals[0] {
                edge.normals[1] = normal;
            }
        }
    }
    let is_sharp = |edge: &MeshEdge| edge.normals[0].dot(edge.normals[1]) < MAX_FLAT_COSINE;
    edges.into_values().map(|(edge, _)| edge).filter(is_sharp).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{lighting::solver::PhantomSolid, probe::BallSurface};
    use bevy::{math::Affine3A, prelude::*};

    #[test]
    fn outlines_lie_on_the_solids_and_point_away_from_them() {
        let center = Vec3::new(0.3, 0.05, 0.0);
        let balls = [MirrorBall { center, radius: 0.05, reflectance: 0.9, surface: BallSurface::Mirror }];
        let cube = Cuboid::new(0.1, 0.1, 0.1).mesh().build();
        let phantoms = [PhantomSolid::from_mesh(&cube, &Affine3A::IDENTITY).expect("a cube")];
        let geometry = DeskGeometry { balls: &balls, papers: &[], phantoms: &phantoms };
        let silhouettes = Silhouettes::new(geometry);
        assert_eq!(silhouettes.edges.len(), 12, "the diagonals of the faces are no edges");
        let dir = Vec3::new(0.3, 0.8, 0.5).normalize();
        let points = silhouettes.outline(dir, 200);
        assert!((190..215).contains(&points.len()), "{}", points.len());
        let (round, flat): (Vec<&OutlinePoint>, Vec<&OutlinePoint>) =
            points.iter().partition(|point| point.pos.distance(center) < 0.0501);
        // A cube shows six of its edges in outline.
        assert!(round.len() > 60 && flat.len() > 90);
        for point in points {
            assert!(point.outward.is_normalized() && point.outward.dot(dir).abs() < 1e-4, "{point:?}");
            let hidden = |offset: f32| geometry.is_hidden(point.pos + offset * point.outward - dir, dir, &mut [0]);
            assert!(hidden(-1e-3) && !hidden(1e-3), "{point:?}");
        }
    }
}
