//! What a thing looks like: three components.

use crate::{desk::THINGS, ramps::Ramps};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;
use std::collections::BTreeMap;

/// Something on the desk whose look can be edited. Its [`Name`] stands for it in files.
#[derive(Component)]
pub(crate) struct Thing;

/// The components that make a look. They are changed like all others: the next frame shows it.
#[derive(Bundle, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default)]
pub(crate) struct Look {
    pub style: SurfaceStyle,
    pub ramps: Ramps,
    pub measured_light: MeasuredLightWeight,
}

/// Looks by the names of the things.
pub(crate) type Looks = BTreeMap<String, Look>;

impl Look {
    /// Returns this look for all things.
    pub(crate) fn for_all(&self) -> Looks {
        THINGS.map(|name| (name.to_owned(), self.clone())).into()
    }
}

/// Query of all things with the components of their looks, to read and to write.
pub(crate) type Things<'w, 's> = Query<'w, 's, ThingData, With<Thing>>;
pub(crate) type ThingData =
    (Entity, &'static Name, &'static mut SurfaceStyle, &'static mut Ramps, &'static mut MeasuredLightWeight);

/// Changes the looks of things to those of their names. What stays as it is does not count as changed.
pub(crate) fn show(things: &mut Things, looks: &Looks) {
    for (_, name, mut style, mut ramps, mut measured_light) in things {
        if let Some(look) = looks.get(name.as_str()) {
            style.set_if_neq(look.style);
            ramps.set_if_neq(look.ramps);
            measured_light.set_if_neq(look.measured_light);
        }
    }
}
