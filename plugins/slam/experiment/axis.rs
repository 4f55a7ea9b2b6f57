//! What an experiment varies.
use crate::settings::run_document::Declared;
use manifactor_config::{Errors, Field, Node, Place, Problem, Section, Table, Value};

/// Columns of the table that change together, and the ways they do.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) columns: Vec<Column>,
    pub(super) options: Vec<Choice>,
}

/// A column of the table, and where it is named.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) place: Place,
}

/// One way to set the columns of an axis.
#[derive(Debug, Clone)]
pub(super) struct Choice {
    /// As tables show it, by column.
    pub(super) labels: Vec<String>,
    pub(super) place: Place,
    /// What is put over the base, by column.
    pub(super) sets: Vec<Node>,
}

impl Axis {
    /// Reads one of `[[axes]]`; `None` where it is not as it should be, which is reported.
    pub(super) fn read(mut section: Section<'_>) -> Option<Self> {
        let axis = if section.has("columns") {
            Self::of_rows(&mut section)
        } else {
            let name = section.required::<String>("name");
            let options: Vec<_> =
                section.required_items("options").into_iter().filter_map(Declared::read).collect();
            let place = section.place_of("name");
            name.map(|name| Self::of_options(Column { name, place }, options))
        };
        if axis.as_ref().is_some_and(|axis| axis.options.is_empty()) {
            section.report("options", Problem::invalid("an axis without options leaves nothing to run"));
        }
        section.finish();
        axis
    }

    /// One column, each option with a name.
    pub(super) fn of_options(column: Column, options: Vec<Declared>) -> Self {
        let choice = |Declared { name, place, set, .. }| Choice {
            labels: vec![name],
            sets: vec![set.unwrap_or_else(|| Node::new(place.clone(), Value::Table(Table::default())))],
            place,
        };
        Self { columns: vec![column], options: options.into_iter().map(choice).collect() }
    }

    fn of_rows(section: &mut Section<'_>) -> Option<Self> {
        let errors = section.errors();
        let columns = section.take_required("columns")?;
        let Value::Table(columns) = columns.value else {
            let problem = Problem::wrong_type("a table of columns and what they set", columns.in_words());
            errors.report(columns.place, problem);
            return None;
        };
        let (columns, keys): (Vec<Column>, Vec<Node>) = columns
            .into_iter()
            .map(|(name, Field { key, node })| (Column { name, place: key }, node))
            .unzip();
        let paths: Vec<Option<String>> = keys.into_iter().map(|key| key.read(errors)).collect();
        let paths: Vec<String> = paths.into_iter().collect::<Option<_>>()?;
        let rows = section.nodes("rows").into_iter().map(|row| choice(row, &paths, errors));
        let options: Vec<Option<Choice>> = rows.collect();
        Some(Self { columns, options: options.into_iter().collect::<Option<_>>()? })
    }
}

/// A row: a value for each column, or the value itself where there is one column.
fn choice(row: Node, paths: &[String], errors: &Errors) -> Option<Choice> {
    let place = row.place.clone();
    let values = match row.value {
        Value::Array(items) if paths.len() > 1 => items,
        value => vec![Node::new(place.clone(), value)],
    };
    if values.len() != paths.len() {
        let (expected, found) = (paths.len(), values.len());
        let problem = Problem::wrong_type(format!("{expected} values, one a column"), format!("{found}"));
        errors.report(place, problem);
        return None;
    }
    let labels = values.iter().map(label).collect();
    let sets = paths.iter().zip(values).map(|(path, value)| nested(path, value)).collect();
    Some(Choice { labels, place, sets })
}

/// `a.b.c` and a value as tables within tables.
fn nested(path: &str, value: Node) -> Node {
    path.rsplit('.').fold(value, |node, key| {
        let place = node.place.clone();
        let field = Field { key: place.clone(), node };
        Node::new(place, Value::Table(Box::new([(key.trim().to_owned(), field)].into_iter().collect())))
    })
}

/// A value as a table shows it.
fn label(value: &Node) -> String {
    match &value.value {
        Value::String(text) => text.clone(),
        // as it is written: 0.1 and 1e-1 are two labels
        _ => value.place.text().split_whitespace().collect::<Vec<_>>().join(" "),
    }
}
