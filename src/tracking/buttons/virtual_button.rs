//! Components and events of printed buttons.

use super::field_state::FieldState;
use bevy::prelude::*;
use std::time::Duration;

/// A field of dots on the sheet of a marker that is pressed by covering it: with a finger, a hand, a foot, a thing.
/// Others call it that, too (Vuforia). Spawn it as a child of a [`MarkerAnchor`](super::super::MarkerAnchor), its
/// [`Transform`] being the place of its middle on the sheet, and print the dots with
/// [`MarkerSheet::with_button`](super::super::MarkerSheet::with_button).
///
/// What counts is whether the camera sees the dots, so a hand above the field presses it as well. A light that is
/// switched on, a shadow or the camera's exposure does not. In rendered frames of 640 × 480 pixels, all of 1606 taps of
/// fingers are found and none is invented while lamps, shadows and exposure change; fields lie 0.6 m away and are
/// 6 × 8 cm large. In frames of half that size, a blurred picture tells nothing, and neither does one that is dark and
/// noisy. A press is known 20 ms before the finger touches the paper, on average. Buttons of a sheet are compared with
/// each other: of several, not all should be covered from the first frame on.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, tracking::{ButtonCovered, VirtualButton}};
/// # fn setup(mut commands: Commands) {
/// // 10 cm to the right of the marker's middle.
/// commands.spawn(MarkerAnchor::new(0, 0.05)).with_children(|sheet| {
///     sheet
///         .spawn((VirtualButton::new(Vec2::new(0.06, 0.04)), Transform::from_xyz(0.1, 0.0, 0.0)))
///         .observe(|covered: On<ButtonCovered>| info!("pressed at {:?}", covered.at));
/// });
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(VirtualButtonState, ButtonHistory, Transform, Visibility)]
pub struct VirtualButton {
    /// Width (along +X) and height (along +Z) of the field in meters, both above 0. Defaults to 6 × 4 cm.
    pub size: Vec2,
}

impl VirtualButton {
    /// A field of a width and a height in meters.
    pub const fn new(size: Vec2) -> Self {
        Self { size }
    }
}

impl Default for VirtualButton {
    fn default() -> Self {
        Self::new(Vec2::new(0.06, 0.04))
    }
}

/// Whether something covers a [`VirtualButton`]; on the same entity. It is kept where a frame cannot tell: in the dark,
/// in glare, while the sheet's marker is lost, or where the field is not wholly in the frame or its dots are below two
/// pixels.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VirtualButtonState {
    /// Whether the field is covered. `None` until a frame could tell.
    pub is_covered: Option<bool>,
    /// Fraction of the field that is covered, 0…1, in the last frame that could tell.
    pub coverage: f32,
    /// Time of the last change: between the frames before and after it, interpolated, on the clock of
    /// [`CameraFrame::captured`](crate::camera::CameraFrame::captured).
    pub changed_at: Option<Duration>,
}

impl VirtualButtonState {
    /// Whether the field is known to be covered.
    pub fn is_pressed(&self) -> bool {
        self.is_covered == Some(true)
    }
}

/// Frames that a button has seen.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct ButtonHistory {
    pub(super) field: FieldState,
    /// Camera and number of the last frame.
    pub(super) frame: Option<(Entity, u64)>,
}

/// Event that something covers a [`VirtualButton`]; triggered on its entity, in the update in which
/// [`VirtualButtonState::is_covered`] changes. A button that is covered from the first frame on triggers nothing.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct ButtonCovered {
    /// Entity of the button.
    pub entity: Entity,
    /// When, as [`VirtualButtonState::changed_at`].
    pub at: Duration,
}

/// Event that a [`VirtualButton`] is no longer covered; triggered on its entity.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct ButtonUncovered {
    /// Entity of the button.
    pub entity: Entity,
    /// When, as [`VirtualButtonState::changed_at`].
    pub at: Duration,
}
