//! Averaging of images to a smaller size.

use glam::{UVec2, Vec3};

/// Averages an image to a size that is not larger, each pixel over the area that it covers, and passes the rows from
/// top to bottom to `emit`.
pub(crate) fn shrink(from: UVec2, to: UVec2, read: impl Fn(u32, u32) -> Vec3, mut emit: impl FnMut(&[Vec3])) {
    let to = to.min(from).max(UVec2::ONE);
    let columns: Vec<_> = (0..from.x).map(|x| Cover::new(x, from.x, to.x)).collect();
    let mut line = vec![Vec3::ZERO; to.x as usize];
    let mut row = vec![Vec3::ZERO; to.x as usize + 1];
    let mut next = vec![Vec3::ZERO; to.x as usize + 1];
    for y in 0..from.y {
        row.fill(Vec3::ZERO);
        for (x, cover) in columns.iter().enumerate() {
            let value = read(x as u32, y);
            row[cover.first] += value * cover.weight;
            row[cover.first + 1] += value * cover.rest;
        }
        let cover = Cover::new(y, from.y, to.y);
        for ((line, next), value) in line.iter_mut().zip(&mut next).zip(&row) {
            *line += *value * cover.weight;
            *next += *value * cover.rest;
        }
        let is_complete = Cover::new(y + 1, from.y, to.y).first > cover.first;
        if is_complete {
            emit(&line);
            line.copy_from_slice(&next[..to.x as usize]);
            next.fill(Vec3::ZERO);
        }
    }
}

/// The one or two pixels that a pixel of the larger image falls into, and its part of their means.
struct Cover {
    first: usize,
    weight: f32,
    rest: f32,
}

impl Cover {
    fn new(at: u32, from: u32, to: u32) -> Self {
        let scale = f64::from(to) / f64::from(from);
        // In whole numbers, so that the last pixel ends exactly at the border.
        let first = u64::from(at) * u64::from(to) / u64::from(from);
        let start = f64::from(at) * scale;
        let inside = ((first + 1) as f64 - start).min(scale);
        Self { first: first as usize, weight: inside as f32, rest: (scale - inside).max(0.0) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_places_are_kept() {
        for (from, to) in
            [((9, 7), (4, 3)), ((8, 4), (4, 2)), ((5, 5), (5, 5)), ((31, 3), (1, 1)), ((1000, 2), (999, 1))]
        {
            let (from, to) = (UVec2::from(from), UVec2::from(to));
            let mut rows = Vec::new();
            shrink(from, to, |x, y| Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 1.0), |row| rows.push(row.to_vec()));
            assert_eq!((rows.len(), rows[0].len()), (to.y as usize, to.x as usize));
            for (y, row) in rows.iter().enumerate() {
                for (x, value) in row.iter().enumerate() {
                    // A value that grows evenly has its mean in the middle.
                    let middle = (UVec2::new(x as u32, y as u32).as_vec2() + 0.5) * from.as_vec2() / to.as_vec2();
                    let expected = middle.extend(1.0);
                    assert!(value.distance(expected) < 0.26, "{x}, {y}: {value} instead of {expected}");
                    assert!((value.z - 1.0).abs() < 1e-3);
                }
            }
        }
    }
}
