//! Light that the facets of a mirror ball throw.

use bevy::prelude::*;
use std::f32::consts::TAU;

/// Heights of the rings of facets, as the sine of their angle above the equator, and facets of a ring. These throw
/// light down to the desk; those above throw it to the ceiling.
const RINGS: [f32; 3] = [-0.12, 0.1, 0.32];
const FACETS_OF_RING: usize = 8;
pub(super) const FACETS: usize = RINGS.len() * FACETS_OF_RING;
/// Beats in which the ball turns once.
const BEATS_PER_TURN: f32 = 32.0;

/// Normal of a facet at a beat.
fn normal(facet: usize, beat: f32) -> Vec3 {
    let (ring, place) = (facet / FACETS_OF_RING, facet % FACETS_OF_RING);
    // Rings are turned against each other, as bricks are.
    let angle = TAU * ((place as f32 + 0.5 * (ring % 2) as f32) / FACETS_OF_RING as f32 + beat / BEATS_PER_TURN);
    let height = RINGS[ring % RINGS.len()];
    let around = (1.0 - height * height).sqrt();
    Vec3::new(around * angle.cos(), height, around * angle.sin())
}

/// Direction in which a facet mirrors the light that comes from `towards`, and its strength 0…1: the share of the
/// facet that the light sees. 0 for facets on the other side.
pub(super) fn reflected(facet: usize, beat: f32, towards: Vec3) -> (Vec3, f32) {
    let normal = normal(facet, beat);
    let cosine = normal.dot(towards);
    // Facets that turn into the light fade in.
    ((2.0 * cosine * normal - towards).normalize_or(normal), cosine.max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_facet_throws_light_to_the_other_side_of_its_normal() {
        let towards = Vec3::new(0.4, 0.8, -0.3).normalize();
        for facet in 0..FACETS {
            let (direction, strength) = reflected(facet, 3.7, towards);
            let normal = normal(facet, 3.7);
            assert!(direction.is_normalized() && (0.0..=1.0).contains(&strength));
            assert!((direction.dot(normal) - towards.dot(normal)).abs() < 1e-5);
            assert!((direction + towards).cross(normal).length() < 1e-5);
            assert_eq!(strength > 0.0, normal.dot(towards) > 0.0);
        }
    }

    #[test]
    fn a_lamp_above_is_thrown_down_to_the_desk() {
        let lit = (0..FACETS).map(|facet| reflected(facet, 0.0, Vec3::Y)).filter(|(_, strength)| *strength > 0.0);
        let lit: Vec<_> = lit.collect();
        assert_eq!(lit.len(), 2 * FACETS_OF_RING);
        assert!(lit.iter().all(|(direction, _)| direction.y < -0.7));
    }

    #[test]
    fn the_ball_turns_smoothly_and_once_in_its_beats() {
        for facet in 0..FACETS {
            assert!(normal(facet, 0.0).distance(normal(facet, BEATS_PER_TURN)) < 1e-4);
            assert!(normal(facet, 0.0).angle_between(normal(facet, 0.02)) < 0.01);
        }
    }
}
