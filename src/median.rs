//! The median of a sample.

use std::cmp::Ordering;

/// The upper median by an order: of an even number of values the higher one of the middle two. `None` of no values.
pub(crate) fn median_by<T: Copy>(values: &mut [T], order: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, order).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_value_in_the_middle() {
        assert_eq!(median_by(&mut [5.0, -1.0, 3.0], f64::total_cmp), Some(3.0));
        assert_eq!(median_by(&mut [4.0, 1.0, 2.0, 3.0], f32::total_cmp), Some(3.0));
        assert_eq!(median_by(&mut [], f32::total_cmp), None);
    }
}
