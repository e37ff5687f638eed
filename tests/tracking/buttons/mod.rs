//! Fields of a printed sheet as buttons, in rendered feeds whose truth is known.

#[path = "../../../src/tracking/buttons/dots.rs"]
mod dots;
mod facts;
mod feed;
#[path = "../../../src/tracking/buttons/field_state.rs"]
mod field_state;
mod hands;
mod in_the_world;
mod lighting;
mod random;
mod renderer;
mod score;
#[path = "../../../src/tracking/buttons/sense.rs"]
mod sense;
#[path = "../../../src/tracking/buttons/sheet_contrast.rs"]
mod sheet_contrast;
mod sheet_view;
mod sub_frame;
