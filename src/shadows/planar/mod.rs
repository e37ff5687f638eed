//! Planar shadows: casters are projected onto a flat receiver, once per point of each light.
//!
//! **Enters:** [`PlanarShadow`] on receivers, the casters of the scene, and lights: [`RealLight`]s or those placed by
//! hand. **Leaves:** a [`PlanarTexture`] on each receiver, by which the [`materials`](crate::materials) multiply what
//! is drawn there.
//!
//! # Method
//! A matrix projects all vertices of a caster onto the plane, away from a light ([`planar_projection`]). Seen from
//! straight above the receiver, the union of all projected casters is the shadow of a point light. An area light is a
//! jittered grid of points (Karlsson and Selegård 2005, chapter 3.2): their shadows are averaged and blurred by a
//! Gaussian about as wide as the distance between them. Each light then takes its share of the light, per color:
//! `1 − Σ share · hidden`. What no listed light gives comes from directions all around, each of which has the light
//! that the environment map shows there, and is blurred more; without a map, all of them have the same.
//!
//! The texture covers the bounding boxes of the shadows, clipped to the receiver. Things behind the receiver and things
//! beyond a near light do not cast (no false shadows, no anti-shadows), and lights below it do not shine.
//!
//! # Cost
//! One draw call per light, point and caster, and per direction and caster; and two passes of a Gaussian over the
//! texture per light, when lights, casters or the environment have changed; otherwise a rectangle.
//!
//! # Limits
//! Flat receivers only: things do not cast onto each other or onto themselves. A receiver's shadows darken all that it
//! shows, reflections too, and they know nothing of what real things hide: where a real light is hidden from the
//! receiver already, its shadow is drawn once more.
//!
//! [`RealLight`]: crate::lighting::RealLight

mod ambient;
mod light_points;
mod planar_shadow;
mod planned;
mod projection;
mod receiver_plan;
mod render;
mod window;

pub use planar_shadow::{
    PlanarCasters, PlanarLight, PlanarLightPlace, PlanarLights, PlanarShadow, PlanarShadowState, PlanarStandIn,
};
pub use projection::planar_projection;

pub(crate) use planned::PlanarTexture;
pub(super) use planned::{PlanarPlans, plan_shadows};
pub(super) use render::build;
