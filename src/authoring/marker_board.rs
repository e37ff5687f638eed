//! Boards of markers in extras: layouts that refer to the anchor beside them, and lists of markers.

use super::{
    component::{FromExtras, choice, read_value},
    error::ExtrasProblem,
    fields::Fields,
    marker_components::FAMILIES,
    number_rules::{Number, Positive, Three, Whole},
};
use crate::tracking::{BoardMarker, MarkerAnchor, MarkerBoard, MarkerFamily, MarkerId};
use bevy::prelude::*;

/// Largest number of rows and of columns of a grid.
const MAX_ROWS: u32 = 50;

const METERS: Number = Number { unit: "meters" };

impl FromExtras for MarkerBoard {
    const EXAMPLE: &'static str = r#"{"grid": {"columns": 3, "rows": 2, "spacing": 0.13}}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let anchor = anchor_beside(fields);
        // The fields are read in any case, so that no mistake hides another.
        let known = anchor.clone().unwrap_or_else(|| MarkerAnchor::new(0, 1.0));
        let grid = fields.optional_object("grid", "MarkerBoard.grid", |fields| grid(fields, &known));
        let around_ball =
            fields.optional_object("around_ball", "MarkerBoard.around_ball", |fields| around_ball(fields, &known));
        let box_sides =
            fields.optional_object("box_sides", "MarkerBoard.box_sides", |fields| box_sides(fields, &known));
        let markers = fields.optional_objects("markers", "MarkerBoard.markers", |fields| marker(fields, &known));

        let layouts = [grid, around_ball, box_sides].into_iter().flatten().flatten();
        let board = Self::new(layouts.flat_map(|board| board.markers).chain(markers.into_iter().flatten()));
        if fields.is_empty() {
            fields.note(ExtrasProblem::MissingField {
                component: "MarkerBoard",
                field: "markers",
                expected: "a list of markers, or one of grid, around_ball and box_sides".into(),
                example: Self::EXAMPLE,
            });
        }
        if let Err(error) = board.check(&anchor?) {
            fields.note(ExtrasProblem::Contradiction { component: "MarkerBoard", reason: error.to_string() });
        }
        Some(board)
    }
}

/// The anchor in the same extras. Notes a problem if there is none; a mistake in it is reported with it.
fn anchor_beside(fields: &mut Fields) -> Option<MarkerAnchor> {
    let Some(value) = fields.beside("MarkerAnchor") else {
        let (component, needed, example) = ("MarkerBoard", "MarkerAnchor", MarkerAnchor::EXAMPLE);
        fields.note(ExtrasProblem::MissingNeighbor { component, needed, example });
        return None;
    };
    read_value("MarkerAnchor", value, &default()).ok()
}

fn grid(fields: &mut Fields, anchor: &MarkerAnchor) -> Option<MarkerBoard> {
    let columns = fields.required("columns", Whole { min: 1, max: MAX_ROWS });
    let rows = fields.required("rows", Whole { min: 1, max: MAX_ROWS });
    let spacing = fields.required("spacing", Positive::METERS);
    Some(MarkerBoard::grid(anchor, columns?, rows?, spacing?))
}

fn around_ball(fields: &mut Fields, anchor: &MarkerAnchor) -> Option<MarkerBoard> {
    let (x, z) = (fields.required("x", METERS), fields.required("z", METERS));
    let radius = fields.required("radius", Positive::METERS);
    Some(MarkerBoard::around_ball(anchor, Vec2::new(x?, z?), radius?))
}

fn box_sides(fields: &mut Fields, anchor: &MarkerAnchor) -> Option<MarkerBoard> {
    let box_size = fields.required("box_size", Three(Positive::METERS));
    let size = fields.optional("size", Positive::METERS).unwrap_or(anchor.size);
    Some(MarkerBoard::box_sides(anchor, box_size?, size))
}

fn marker(fields: &mut Fields, anchor: &MarkerAnchor) -> Option<BoardMarker> {
    let family = choice(fields, "family", &FAMILIES, &MarkerFamily::ALL).unwrap_or(anchor.family);
    let id = fields.required("id", Whole { min: 0, max: family.marker_count() - 1 });
    let size = fields.optional("size", Positive::METERS).unwrap_or(anchor.size);
    let position = fields.required("position", Three(METERS));
    let degrees = fields.optional("rotation_degrees", Three(Number { unit: "degrees" })).unwrap_or_default();
    let [x, y, z] = degrees.to_array().map(f32::to_radians);
    // About the fixed axes x, y and z in this order, which Blender calls XYZ.
    let rotation = Quat::from_euler(EulerRot::ZYX, z, y, x);
    Some(BoardMarker::new(MarkerId::new(family, id?), size, Isometry3d::new(position?, rotation)))
}

#[cfg(test)]
mod tests {
    use crate::{
        authoring::{AuthoredComponent, NodeContext, ParsedExtras, parse_node_extras},
        tracking::{BoardMarker, MarkerAnchor, MarkerBoard, MarkerFamily, MarkerId},
    };
    use bevy::prelude::*;

    fn parse(json: &str) -> ParsedExtras {
        parse_node_extras(json, &NodeContext::new("set.glb", "sheet"))
    }

    /// Reads a board beside marker 3, 8 cm wide, and returns its markers.
    fn markers(board: &str) -> Vec<BoardMarker> {
        let json = format!(r#"{{"MarkerAnchor": {{"id": 3, "size": 0.08}}, "MarkerBoard": {board}}}"#);
        let components = parse(&json).into_result().expect("no mistake");
        match &components[..] {
            [AuthoredComponent::MarkerAnchor(_), AuthoredComponent::MarkerBoard(board)] => board.markers.clone(),
            other => panic!("{other:?}"),
        }
    }

    /// Returns the messages about a board beside marker 3, without their context.
    fn complaints(board: &str) -> Vec<String> {
        let json = format!(r#"{{"MarkerAnchor": {{"id": 3, "size": 0.08}}, "MarkerBoard": {board}}}"#);
        let parsed = parse(&json);
        assert!(parsed.components.iter().all(|component| component.name() == "MarkerAnchor"), "{board}: {parsed:?}");
        parsed.errors.iter().map(|error| error.problem.to_string()).collect()
    }

    fn anchor() -> MarkerAnchor {
        MarkerAnchor::new(3, 0.08)
    }

    #[test]
    fn layouts_are_those_of_the_constructors() {
        let grid = markers(r#"{"grid": {"columns": 3, "rows": 2, "spacing": 0.1}}"#);
        assert_eq!(grid, MarkerBoard::grid(&anchor(), 3, 2, 0.1).markers);
        let around = markers(r#"{"around_ball": {"x": 0.17, "z": -0.01, "radius": 0.05}}"#);
        assert_eq!(around, MarkerBoard::around_ball(&anchor(), Vec2::new(0.17, -0.01), 0.05).markers);
        let sides = markers(r#"{"box_sides": {"box_size": [0.2, 0.12, 0.15], "size": 0.06}}"#);
        assert_eq!(sides, MarkerBoard::box_sides(&anchor(), Vec3::new(0.2, 0.12, 0.15), 0.06).markers);
        let sides = markers(r#"{"box_sides": {"box_size": [0.2, 0.12, 0.15]}}"#);
        assert!(sides.iter().all(|marker| marker.size == 0.08));
    }

    #[test]
    fn markers_are_listed_with_place_and_turn() {
        let found = markers(
            r#"{"markers": [{"id": 9, "position": [0.1, 0, 0]},
                {"id": 0, "size": 0.05, "family": "tag25h9", "position": [0, -0.1, 0.2], "rotation_degrees": [90, 0, 0]}]}"#,
        );
        assert_eq!(found[0], BoardMarker::beside(9, 0.08, 0.1, 0.0));
        assert_eq!((found[1].marker(), found[1].size), (MarkerId::new(MarkerFamily::Tag25h9, 0), 0.05));
        // Turned about x by 90°, the paper faces the bottom edge of the anchor's marker: a side of a box.
        assert!((found[1].place.rotation * Vec3::Y).distance(Vec3::Z) < 1e-6);
        assert!((found[1].place.rotation * Vec3::Z).distance(Vec3::NEG_Y) < 1e-6);
        let turned = markers(r#"{"markers": [{"id": 9, "position": [0, 0, 0], "rotation_degrees": [90, 90, 0]}]}"#);
        assert!((turned[0].place.rotation * Vec3::Y).distance(Vec3::X) < 1e-6, "about x first, then about the fixed y");
    }

    #[test]
    fn layouts_and_listed_markers_make_one_board() {
        let found = markers(
            r#"{"grid": {"columns": 2, "rows": 1, "spacing": 0.1}, "markers": [{"id": 90, "position": [0, 0, 0.3]}]}"#,
        );
        assert_eq!(found.iter().map(|marker| marker.id).collect::<Vec<_>>(), [4, 90]);
    }

    #[test]
    fn texts_are_read_as_blender_writes_them() {
        let json = r#"{"MarkerAnchor": "{\"id\": 0, \"size\": 0.1}",
            "MarkerBoard": "{\"grid\": {\"columns\": 2, \"rows\": 1, \"spacing\": 0.15}}"}"#;
        let parsed = parse(json);
        assert_eq!((parsed.components.len(), &parsed.errors[..]), (2, &[][..]));
    }

    #[test]
    fn a_board_belongs_to_an_anchor() {
        let json = r#"{"MarkerBoard": {"grid": {"columns": 2, "rows": 1, "spacing": 0.1}}}"#;
        let message = parse(json).errors[0].problem.to_string();
        let expected = "MarkerBoard needs MarkerAnchor beside it; add that to the extras of the same node, for example \
            {\"id\": 0, \"size\": 0.1}";
        assert_eq!(message, expected);
        // A mistake in the anchor is named once; the board is left out with it.
        let json = r#"{"MarkerAnchor": {"id": 3}, "MarkerBoard": {"grid": {"columns": 2, "rows": 1, "spacing": 0.1}}}"#;
        let parsed = parse(json);
        assert_eq!((parsed.components.len(), parsed.errors.len()), (0, 1), "{parsed:?}");
        assert!(parsed.errors[0].problem.to_string().starts_with("MarkerAnchor.size is missing"));
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let mistakes = [
            (r#"{}"#, "MarkerBoard.markers is missing, expected a list of markers, or one of grid"),
            (r#"{"gird": {}}"#, "MarkerBoard.gird is unknown; rename it to \"grid\" or remove it"),
            (r#"{"grid": {"columns": 2, "rows": 1, "spaceing": 0.1}}"#, "MarkerBoard.grid.spacing is missing"),
            (r#"{"grid": {"columns": 0, "rows": 1, "spacing": 0.1}}"#, "MarkerBoard.grid.columns is 0"),
            (r#"{"around_ball": {"x": 0.1, "z": "0", "radius": 0.1}}"#, "MarkerBoard.around_ball.z is \"0\""),
            (r#"{"box_sides": {"box_size": [0.1, 0.1]}}"#, "MarkerBoard.box_sides.box_size is [0.1,0.1]"),
            (
                r#"{"markers": {"id": 4}}"#,
                "MarkerBoard.markers is {\"id\":4}, which is of the wrong type; write a list",
            ),
            (
                r#"{"markers": [{"id": 4, "position": [0, 0, 1]}, {"id": 5}]}"#,
                "number 2 of the list: MarkerBoard.markers.position is missing, expected a list of three, for x, y and z",
            ),
            (
                r#"{"markers": [{"id": 3, "position": [0, 0, 1]}]}"#,
                "MarkerBoard is not accepted: tag36h11 number 3 is on the board twice",
            ),
            (
                r#"{"grid": {"columns": 30, "rows": 30, "spacing": 0.1}}"#,
                "MarkerBoard is not accepted: tag36h11 has no marker number 587; numbers go from 0 to 586",
            ),
        ];
        for (board, expected) in mistakes {
            let found = complaints(board);
            assert!(found[0].starts_with(expected), "{board}: {found:?}");
        }
        assert_eq!(complaints(r#"{"grid": {"columns": 0, "rows": 0}}"#).len(), 3);
        assert_eq!(complaints(r#"{"gird": {}}"#).len(), 1);
    }
}
