//! Tables that may be left out, and numbers within bounds.
use manifactor_config::{Node, Problem, Section, Table, Value};
use std::ops::RangeInclusive;

/// Reads a table; one that is not there as an empty one. `None` for what is no table, and reported.
pub(super) fn table<T>(
    parent: &mut Section<'_>,
    field: &str,
    read: impl FnOnce(&mut Section<'_>) -> T,
) -> Option<T> {
    let place = parent.place_of(field);
    let node = parent.take(field).unwrap_or_else(|| empty(place));
    let mut section = Section::new(node, parent.errors())?;
    let value = read(&mut section);
    section.finish();
    Some(value)
}

fn empty(place: manifactor_config::Place) -> Node {
    Node::new(place, Value::Table(Table::default()))
}

/// A number within bounds, or its default.
pub(super) fn within(
    section: &mut Section<'_>,
    field: &str,
    default: f64,
    bounds: RangeInclusive<f64>,
) -> f64 {
    let number = section.optional::<f64>(field).unwrap_or(default);
    if !bounds.contains(&number) {
        let (least, most) = (bounds.start(), bounds.end());
        let expected = match most.is_finite() {
            true => format!("a number from {least} to {most}"),
            false => format!("a number of at least {least}"),
        };
        section.report(field, Problem::wrong_type(expected, format!("the number {number}")));
    }
    number
}

/// A number from 0 to 1. Default: 0.
pub(crate) fn share(section: &mut Section<'_>, field: &str) -> f64 {
    within(section, field, 0.0, 0.0..=1.0)
}
