//! Surface styles: the choice of the material that draws a mesh.
//!
//! **Enters:** [`SurfaceStyle`], [`StyleFade`] and [`MeasuredLightWeight`] on entities, and the `StandardMaterial`s of
//! meshes.
//! **Leaves:** a material that extends the original on each mesh whose style needs one, and [`Styled`], which keeps the
//! original; copies of meshes whose style fades out.

mod classic_style;
mod exchange;
mod measured_light;
mod numbers;
mod style_fade;
mod styled_materials;
mod surface_style;
mod toon_style;

pub use classic_style::{ClassicModel, ClassicStyle, CombinedModel, MixedModel, SphereMapModel};
pub(super) use exchange::{Styles, apply_styles, restore_originals, update_styled_materials};
pub use measured_light::MeasuredLightWeight;
pub(super) use numbers::{bounded, equal_by_numbers};
pub use style_fade::StyleFade;
pub(super) use style_fade::{OutlineFades, advance_fades, start_fades};
pub(super) use styled_materials::{
    MeshContext, SharedBindings, StyleExtension, Styled, StyledMaterials, without_layers,
};
pub use surface_style::SurfaceStyle;
pub use toon_style::{PhongToon, ToonKey, ToonModel, ToonStyle};
