//! Axes of an experiment.
use manifactor_config::{Errors, Fault, Field, Node, Place, Placed, Table, Value, deserialize_with};
use manifactor_mapping::settings::run_document::DeclaredVariant;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;

/// Columns of the table that change together, and their possible values.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) columns: Vec<Column>,
    pub(super) options: Vec<AxisChoice>,
}

/// A column of the table, and the position of its name in the document.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) place: Place,
}

/// One choice of values for the columns of an axis.
#[derive(Debug, Clone)]
pub(super) struct AxisChoice {
    /// Labels in tables, by column.
    pub(super) labels: Vec<String>,
    pub(super) place: Place,
    /// Settings that replace settings of the base, by column.
    pub(super) sets: Vec<Node>,
}

/// An axis: columns with rows of values, or a name with options.
#[derive(JsonSchema)]
#[serde(untagged)]
pub(super) enum AxisDocument {
    Rows(AxisRows),
    Options(AxisOptions),
}

/// Columns that change together.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Rows")]
pub(super) struct AxisRows {
    /// Columns, each with the setting that it changes: { seed = "source.seed" }.
    #[schemars(with = "BTreeMap<String, String>")]
    columns: Node,
    /// Values of the columns: a list for each row, or the value itself if there is only one column.
    #[schemars(with = "Vec<serde_json::Value>")]
    rows: Placed<Vec<Node>>,
}

/// One column of options.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Options")]
pub(super) struct AxisOptions {
    /// Name of the column.
    #[schemars(with = "String")]
    name: Placed<String>,
    /// Options of the column.
    #[schemars(with = "Vec<DeclaredVariant>")]
    options: Placed<Vec<DeclaredVariant>>,
}

impl<'de> Deserialize<'de> for AxisDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| {
            Ok(Box::new(match node.field("columns") {
                Some(_) => Self::Rows(node.try_read()?),
                None => Self::Options(node.try_read()?),
            }))
        })
    }
}

impl Axis {
    /// Reads one of `[[axes]]`. Returns `None` if it is invalid; errors are reported.
    pub(super) fn read(document: AxisDocument, errors: &Errors) -> Option<Self> {
        let (place, axis) = match document {
            AxisDocument::Rows(rows) => (rows.rows.place.clone(), Self::of_rows(rows, errors)?),
            AxisDocument::Options(AxisOptions { name: Placed { place, value: name }, options }) => {
                (options.place, Self::of_options(Column { name, place }, options.value))
            }
        };
        if axis.options.is_empty() {
            errors.report(place, Fault::invalid("an axis without options leaves nothing to run"));
        }
        Some(axis)
    }

    /// Creates an axis with one column and a name for each option.
    pub(super) fn of_options(column: Column, options: Vec<DeclaredVariant>) -> Self {
        let choice = |DeclaredVariant { name: Placed { place, value: name }, set, .. }| AxisChoice {
            labels: vec![name],
            sets: vec![set.unwrap_or_else(|| Node::new(place.clone(), Value::Table(Table::default())))],
            place,
        };
        Self { columns: vec![column], options: options.into_iter().map(choice).collect() }
    }

    fn of_rows(AxisRows { columns, rows }: AxisRows, errors: &Errors) -> Option<Self> {
        let Value::Table(columns) = columns.value else {
            let problem = Fault::wrong_type("a table of columns and what they set", columns.in_words());
            errors.report(columns.place, problem);
            return None;
        };
        let (columns, keys): (Vec<Column>, Vec<Node>) = columns
            .into_iter()
            .map(|(name, Field { key, node })| (Column { name, place: key }, node))
            .unzip();
        let paths: Vec<Option<String>> = keys.into_iter().map(|key| key.read(errors)).collect();
        let paths: Vec<String> = paths.into_iter().collect::<Option<_>>()?;
        let options: Vec<Option<AxisChoice>> =
            rows.value.into_iter().map(|row| read_choice(row, &paths, errors)).collect();
        Some(Self { columns, options: options.into_iter().collect::<Option<_>>()? })
    }
}

/// Reads a row: a value for each column, or the value itself if there is only one column.
fn read_choice(row: Node, paths: &[String], errors: &Errors) -> Option<AxisChoice> {
    let place = row.place.clone();
    let values = match row.value {
        Value::Array(items) if paths.len() > 1 => items,
        value => vec![Node::new(place.clone(), value)],
    };
    if values.len() != paths.len() {
        let (expected, found) = (paths.len(), values.len());
        let problem = Fault::wrong_type(format!("{expected} values, one a column"), format!("{found}"));
        errors.report(place, problem);
        return None;
    }
    let labels = values.iter().map(label).collect();
    let sets = paths.iter().zip(values).map(|(path, value)| nested(path, value)).collect();
    Some(AxisChoice { labels, place, sets })
}

/// Returns nested tables for a path `a.b.c` and a value.
fn nested(path: &str, value: Node) -> Node {
    path.rsplit('.').fold(value, |node, key| {
        let place = node.place.clone();
        let field = Field { key: place.clone(), node };
        Node::new(place, Value::Table(Box::new([(key.trim().to_owned(), field)].into_iter().collect())))
    })
}

/// Returns the label of a value in tables.
fn label(value: &Node) -> String {
    match &value.value {
        Value::String(text) => text.clone(),
        // labels follow the notation: 0.1 and 1e-1 are two labels
        _ => value.place.text().split_whitespace().collect::<Vec<_>>().join(" "),
    }
}
