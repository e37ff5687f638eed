//! Numbers of styles: their bounds, and equality of those that shaders read.

/// Bounds a number. Not a number counts as 0.
pub(in crate::materials) fn bounded(number: f32, max: f32) -> f32 {
    if number > 0.0 { number.min(max) } else { 0.0 }
}

/// Implements equality and hashes of a uniform by its method `numbers`.
macro_rules! equal_by_numbers {
    ($uniform:ident) => {
        impl PartialEq for $uniform {
            fn eq(&self, other: &Self) -> bool {
                self.numbers() == other.numbers()
            }
        }

        impl Eq for $uniform {}

        impl std::hash::Hash for $uniform {
            fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
                self.numbers().hash(state);
            }
        }
    };
}
pub(in crate::materials) use equal_by_numbers;
