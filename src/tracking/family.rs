//! Families of AprilTag markers.

use super::TrackingError;
use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A family of AprilTag markers: those of the AprilTag 3 library, under its names.
///
/// The larger the number of bits that tell markers apart (the second number in the name), the less likely is a marker
/// found where there is none. [`Tag36h11`](Self::Tag36h11) is the best choice for most games. The families `Circle`,
/// `Custom` and `Standard` have their border inside, with data around it: for the same width of paper their square is
/// smaller and gives less exact poses.
///
/// ```
/// # use bevy_mirrorball::tracking::MarkerFamily;
/// assert_eq!("tagStandard41h12".parse(), Ok(MarkerFamily::TagStandard41h12));
/// assert_eq!(MarkerFamily::Tag25h9.to_string(), "tag25h9");
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum MarkerFamily {
    /// 587 markers of 6 × 6 bits.
    #[default]
    Tag36h11,
    /// 35 markers of 5 × 5 bits.
    Tag25h9,
    /// 30 markers of 4 × 4 bits. So few bits are found by chance in busy surroundings, thus only clear prints are
    /// accepted.
    Tag16h5,
    /// 2320 markers of 6 × 6 bits.
    Tag36h10,
    /// 38 round markers.
    TagCircle21h7,
    /// 65535 round markers.
    TagCircle49h12,
    /// 42211 markers with room for a smaller marker in the middle.
    TagCustom48h12,
    /// 2115 markers.
    TagStandard41h12,
    /// 48714 markers.
    TagStandard52h13,
}

impl MarkerFamily {
    /// All families.
    pub const ALL: [Self; 9] = [
        Self::Tag36h11,
        Self::Tag25h9,
        Self::Tag16h5,
        Self::Tag36h10,
        Self::TagCircle21h7,
        Self::TagCircle49h12,
        Self::TagCustom48h12,
        Self::TagStandard41h12,
        Self::TagStandard52h13,
    ];

    /// Name in the AprilTag library, for example `tag36h11`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tag36h11 => "tag36h11",
            Self::Tag25h9 => "tag25h9",
            Self::Tag16h5 => "tag16h5",
            Self::Tag36h10 => "tag36h10",
            Self::TagCircle21h7 => "tagCircle21h7",
            Self::TagCircle49h12 => "tagCircle49h12",
            Self::TagCustom48h12 => "tagCustom48h12",
            Self::TagStandard41h12 => "tagStandard41h12",
            Self::TagStandard52h13 => "tagStandard52h13",
        }
    }

    /// Number of markers, which are numbered from 0.
    pub const fn marker_count(self) -> u32 {
        match self {
            Self::Tag36h11 => 587,
            Self::Tag25h9 => 35,
            Self::Tag16h5 => 30,
            Self::Tag36h10 => 2320,
            Self::TagCircle21h7 => 38,
            Self::TagCircle49h12 => 65535,
            Self::TagCustom48h12 => 42211,
            Self::TagStandard41h12 => 2115,
            Self::TagStandard52h13 => 48714,
        }
    }

    /// Whether the square is white with black around it, and data around that, instead of black with white around it.
    pub const fn has_border_inside(self) -> bool {
        !matches!(self, Self::Tag36h11 | Self::Tag25h9 | Self::Tag16h5 | Self::Tag36h10)
    }

    /// Number of cells along a side of the square, whose width is a marker's size.
    pub const fn square_cells(self) -> u32 {
        match self {
            Self::Tag36h11 | Self::Tag36h10 => 8,
            Self::Tag25h9 => 7,
            Self::Tag16h5 | Self::TagCustom48h12 | Self::TagStandard52h13 => 6,
            Self::TagCircle21h7 | Self::TagCircle49h12 | Self::TagStandard41h12 => 5,
        }
    }

    /// Number of cells along a side of the whole print, with the white margin of the families that need one.
    pub const fn print_cells(self) -> u32 {
        match self {
            Self::Tag36h11 | Self::Tag36h10 | Self::TagCustom48h12 | Self::TagStandard52h13 => 10,
            Self::Tag25h9 | Self::TagCircle21h7 | Self::TagStandard41h12 => 9,
            Self::Tag16h5 => 8,
            Self::TagCircle49h12 => 11,
        }
    }

    /// Size of a marker that makes its whole print `print` wide, in the same unit.
    pub fn size_in_print(self, print: f32) -> f32 {
        print * self.square_cells() as f32 / self.print_cells() as f32
    }

    /// Distance from the center of a marker of size 1 to the middle of its ring of white cells.
    pub(crate) fn white_ring(self) -> f32 {
        let cells = self.square_cells() as f32;
        let beside = if self.has_border_inside() { -0.5 } else { 0.5 };
        0.5 + beside / cells
    }
}

impl fmt::Display for MarkerFamily {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for MarkerFamily {
    type Err = TrackingError;

    fn from_str(name: &str) -> Result<Self, TrackingError> {
        let known = Self::ALL.into_iter().find(|family| family.name() == name);
        known.ok_or_else(|| TrackingError::NoSuchFamily(name.to_owned()))
    }
}

/// A number of a marker family: what is printed on a marker.
///
/// ```
/// # use bevy_mirrorball::tracking::{MarkerFamily, MarkerId};
/// assert_eq!(MarkerId::from(7), MarkerId::new(MarkerFamily::Tag36h11, 7));
/// assert_eq!(MarkerId::from(7).to_string(), "tag36h11 number 7");
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub struct MarkerId {
    /// The family.
    pub family: MarkerFamily,
    /// Number in the family, from 0.
    pub id: u32,
}

impl MarkerId {
    /// The marker with a number.
    pub const fn new(family: MarkerFamily, id: u32) -> Self {
        Self { family, id }
    }

    /// Returns an error if the family has no such number.
    ///
    /// # Errors
    /// [`TrackingError::NoSuchMarker`].
    pub fn check(self) -> Result<(), TrackingError> {
        if self.id < self.family.marker_count() { Ok(()) } else { Err(TrackingError::NoSuchMarker(self)) }
    }
}

/// A marker of the family tag36h11.
impl From<u32> for MarkerId {
    fn from(id: u32) -> Self {
        Self::new(MarkerFamily::default(), id)
    }
}

impl fmt::Display for MarkerId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} number {}", self.family, self.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for family in MarkerFamily::ALL {
            assert_eq!(family.name().parse(), Ok(family));
        }
        let error = "tag36H11".parse::<MarkerFamily>().expect_err("families are written as the library does");
        assert!(error.to_string().contains("tag36H11") && error.to_string().contains("tagCircle21h7"), "{error}");
    }

    #[test]
    fn numbers_end_with_the_family() {
        assert_eq!(MarkerId::new(MarkerFamily::Tag16h5, 29).check(), Ok(()));
        let error = MarkerId::new(MarkerFamily::Tag16h5, 30).check().expect_err("there are 30");
        assert_eq!(error.to_string(), "tag16h5 has no marker number 30; numbers go from 0 to 29");
    }
}
