//! Directions of a dome from a file in RON format: a list of named lights with their positions and targets.

use super::{
    directions::Directions,
    dome_light::{DomeCoverage, ShadowDomeLight},
    view::{LightView, PerspectiveView},
};
use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    prelude::*,
};
use serde::Deserialize;
use std::sync::Arc;

/// Asset with the lights of a dome, loaded from a file whose name ends in `.lights.ron`.
///
/// ```ron
/// (lights: [
///     (id: "window", kind: Directional, position: (-1.0, 1.2, 0.4), look_at: (0.0, 0.0, 0.0)),
///     (id: "lamp", kind: Spot, position: (0.3, 0.6, 0.1), look_at: (0.0, 0.0, 0.0),
///      field_of_view: 60.0, aspect: 1.0, near: 0.05, far: 2.0),
/// ])
/// ```
///
/// ```
/// use bevy_mirrorball::shadows::LightsFile;
///
/// let text = r#"(lights: [(id: "sun", kind: Directional, position: (1.0, 2.0, 0.0), look_at: (0.0, 0.0, 0.0))])"#;
/// let file = LightsFile::parse(text)?;
/// assert_eq!(file.lights[0].id, "sun");
/// # Ok::<(), bevy_mirrorball::shadows::LightsFileError>(())
/// ```
#[derive(Asset, TypePath, Deserialize, Clone, Debug, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct LightsFile {
    /// The lights, 1…1024 of them. Their order does not matter.
    pub lights: Vec<FileLight>,
}

/// One light of a [`LightsFile`]. Positions are in meters, in the dome's frame.
#[derive(Deserialize, Clone, Debug, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct FileLight {
    /// Unique name, which error messages use.
    pub id: String,
    /// Whether the light is directional or a spot.
    pub kind: FileLightKind,
    /// Position of the light. For a directional light only the direction from `look_at` to it matters.
    pub position: Vec3,
    /// Position at which the light is aimed; must differ from `position`.
    pub look_at: Vec3,
    /// Vertical field of view of a spot's shadow map in degrees, 1…170. Defaults to 60.
    #[serde(default = "default_field_of_view")]
    pub field_of_view: f32,
    /// Aspect ratio (width ÷ height) of a spot's shadow map, 0.1…10. Defaults to 1.
    #[serde(default = "default_aspect")]
    pub aspect: f32,
    /// Distance of the near plane from a spot in meters, above 0. Closer objects do not cast. Defaults to 0.05.
    #[serde(default = "default_near")]
    pub near: f32,
    /// Distance of the far plane from a spot in meters, above `near`. Farther objects do not cast. Defaults to 10.
    #[serde(default = "default_far")]
    pub far: f32,
}

fn default_field_of_view() -> f32 {
    60.0
}

fn default_aspect() -> f32 {
    1.0
}

fn default_near() -> f32 {
    0.05
}

fn default_far() -> f32 {
    10.0
}

/// Kind of a light in a [`LightsFile`].
#[derive(Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileLightKind {
    /// Light with parallel rays.
    Directional,
    /// Light whose rays spread from a position. Nothing outside its field of view casts shadows.
    Spot,
}

/// Error in a [`LightsFile`].
#[derive(thiserror::Error, Debug)]
#[non_exhaustive]
pub enum LightsFileError {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] std::io::Error),
    /// The text does not follow the format.
    #[error("line {}, column {}: {}; see LightsFile for an example", .0.span.start.line, .0.span.start.col, .0.code)]
    Syntax(#[from] ron::error::SpannedError),
    /// The number of lights is out of range.
    #[error("has {0} lights; write 1 to {most}", most = ShadowDomeLight::MAX_DIRECTIONS)]
    Count(usize),
    /// Two lights have the same name.
    #[error("there are two lights with the id {0:?}; rename one")]
    SameId(String),
    /// A field of a light has an invalid value.
    #[error("light {id:?}: {field} is {value}; write {remedy}")]
    Field {
        /// Name of the light.
        id: String,
        /// Name of the field.
        field: &'static str,
        /// Value of the field.
        value: String,
        /// Accepted values.
        remedy: &'static str,
    },
}

impl LightsFile {
    /// Parses the text of a file.
    pub fn parse(text: &str) -> Result<Self, LightsFileError> {
        let file: Self = ron::from_str(text)?;
        if !(1..=ShadowDomeLight::MAX_DIRECTIONS as usize).contains(&file.lights.len()) {
            return Err(LightsFileError::Count(file.lights.len()));
        }
        for (i, light) in file.lights.iter().enumerate() {
            if file.lights[..i].iter().any(|other| other.id == light.id) {
                return Err(LightsFileError::SameId(light.id.clone()));
            }
            light.check()?;
        }
        Ok(file)
    }

    /// Returns the directions of a dome with these lights, and its views in world space.
    pub(super) fn views(&self, coverage: DomeCoverage, world_from_dome: &GlobalTransform) -> FileViews {
        // The file is in meters, whatever the scale of the dome's parents.
        let world_from_dome = world_from_dome.to_isometry();
        let views: Arc<[LightView]> = self.lights.iter().map(|light| light.view(world_from_dome)).collect();
        let directions = views.iter().map(|view| world_from_dome.rotation.inverse() * view.direction).collect();
        FileViews { directions: Directions::given(coverage, directions), views }
    }
}

/// Directions of a dome, and views of its lights in the same order. The views are empty if all light is parallel.
pub(super) struct FileViews {
    pub(super) directions: Directions,
    pub(super) views: Arc<[LightView]>,
}

impl FileLight {
    fn check(&self) -> Result<(), LightsFileError> {
        let complain =
            |field, value: String, remedy| Err(LightsFileError::Field { id: self.id.clone(), field, value, remedy });
        let is_within = |value: f32, low: f32, high: f32| value.is_finite() && (low..=high).contains(&value);
        if !self.position.is_finite() {
            return complain("position", self.position.to_string(), "three numbers in meters");
        }
        if !self.look_at.is_finite() || self.look_at.distance(self.position) < 1e-6 {
            return complain("look_at", self.look_at.to_string(), "a place other than the position");
        }
        if !is_within(self.field_of_view, 1.0, 170.0) {
            return complain("field_of_view", self.field_of_view.to_string(), "1 to 170 degrees");
        }
        if !is_within(self.aspect, 0.1, 10.0) {
            return complain("aspect", self.aspect.to_string(), "width ÷ height from 0.1 to 10");
        }
        if !(self.near.is_finite() && self.near > 0.0) {
            return complain("near", self.near.to_string(), "meters above 0");
        }
        if !(self.far.is_finite() && self.far > self.near) {
            return complain("far", self.far.to_string(), "meters above near");
        }
        Ok(())
    }

    fn view(&self, world_from_dome: Isometry3d) -> LightView {
        let position = world_from_dome * self.position;
        let direction = (position - world_from_dome * self.look_at).normalize_or(Vec3::Y);
        let perspective = (self.kind == FileLightKind::Spot).then(|| {
            let half_height = (0.5 * self.field_of_view.to_radians()).tan();
            PerspectiveView {
                position,
                up: world_from_dome.rotation * Vec3::Y,
                half_size: Vec2::new(half_height * self.aspect, half_height),
                near: self.near,
                far: self.far,
                measured_at: 0.0,
            }
        });
        LightView { direction, perspective, tangent_radius: 0.0 }
    }
}

/// Directions of a [`ShadowDomeLight`] from a file, used instead of its `directions`.
///
/// Each light stands for the part of the sphere that is nearer to its direction than to any other, and takes its
/// color from the environment map. Until the file has been loaded, or if it cannot be read (which logs an error),
/// directions are spread evenly.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, shadows::DomeLights};
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn((ShadowDomeLight::default(), DomeLights(assets.load("desk.lights.ron"))));
/// }
/// ```
#[derive(Component, FromTemplate, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct DomeLights(pub Handle<LightsFile>);

/// Loader of [`LightsFile`]s.
#[derive(Default, TypePath)]
pub(super) struct LightsFileLoader;

impl AssetLoader for LightsFileLoader {
    type Asset = LightsFile;
    type Settings = ();
    type Error = LightsFileError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        _context: &mut LoadContext<'_>,
    ) -> Result<LightsFile, LightsFileError> {
        let mut text = String::new();
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        text.push_str(&String::from_utf8_lossy(&bytes));
        LightsFile::parse(&text)
    }

    fn extensions(&self) -> &[&str] {
        &["lights.ron"]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAMP: &str = r#"(id: "lamp", kind: Spot, position: (0.0, 1.0, 0.0), look_at: (0.0, 0.0, 0.0))"#;

    fn complaint(lights: &str) -> String {
        LightsFile::parse(&format!("(lights: [{lights}])")).expect_err("has a mistake").to_string()
    }

    #[test]
    fn mistakes_are_named_with_light_field_and_remedy() {
        assert_eq!(complaint(""), "has 0 lights; write 1 to 1024");
        assert_eq!(complaint(&format!("{LAMP}, {LAMP}")), r#"there are two lights with the id "lamp"; rename one"#);
        for (from, to, expected) in [
            (
                "(0.0, 0.0, 0.0)",
                "(0.0, 1.0, 0.0)",
                r#"light "lamp": look_at is [0, 1, 0]; write a place other than the position"#,
            ),
            ("(0.0, 0.0, 0.0)", "(0.0, 0.0, 0.0), near: 0.0", r#"light "lamp": near is 0; write meters above 0"#),
            ("(0.0, 0.0, 0.0)", "(0.0, 0.0, 0.0), far: 0.01", r#"light "lamp": far is 0.01; write meters above near"#),
            (
                "(0.0, 0.0, 0.0)",
                "(0.0, 0.0, 0.0), aspect: 0.0",
                r#"light "lamp": aspect is 0; write width ÷ height from 0.1 to 10"#,
            ),
            (
                "(0.0, 0.0, 0.0)",
                "(0.0, 0.0, 0.0), field_of_view: 180.0",
                r#"light "lamp": field_of_view is 180; write 1 to 170 degrees"#,
            ),
        ] {
            assert_eq!(complaint(&LAMP.replace(from, to)), expected);
        }
        let unknown = complaint(&LAMP.replace("position", "place"));
        assert!(unknown.starts_with("line 1, column ") && unknown.contains("place"), "{unknown}");
    }

    #[test]
    fn lights_turn_and_move_with_the_dome() {
        let file = LightsFile::parse(&format!("(lights: [{LAMP}])")).expect("valid");
        let dome = Transform::from_xyz(1.0, 0.0, 0.0).with_rotation(Quat::from_rotation_z(-0.5 * std::f32::consts::PI));
        for scale in [1.0, 0.01, 2.0] {
            let found = file.views(DomeCoverage::Sphere, &dome.with_scale(Vec3::splat(scale)).into());
            let perspective = found.views[0].perspective.expect("a spot");
            assert!(found.views[0].direction.distance(Vec3::X) < 1e-6);
            assert!(perspective.position.distance(Vec3::new(2.0, 0.0, 0.0)) < 1e-6, "a lamp hangs at one meter");
            assert!(perspective.up.distance(Vec3::X) < 1e-6);
            assert!(found.directions.shadowed[0].distance(Vec3::Y) < 1e-6);
            assert_eq!(found.directions.below.len(), 0);
        }
    }
}
