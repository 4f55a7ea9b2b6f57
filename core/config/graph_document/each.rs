//! Factors that differ in some fields only: one entry of a document stands for many.
use manifactor_document::{Errors, Fault, Field, Node, Table, Value, merge};
use schemars::JsonSchema;
use serde::Deserialize;
use std::borrow::Cow;

/// The name of the field.
const EACH: &str = "each";

/// Fields that differ between factors: a table in the form of the factor's own, with an array of values, one for
/// each factor, in place of each value.
///
/// ```toml
/// each.factor.constants = { x = [1.0, 2.0, 3.0], y = [1.1, 1.9, 3.2] }     # three factors
/// each.noise.sigma = [0.1, 0.1, 0.5]
/// ```
#[derive(Deserialize, JsonSchema)]
#[serde(transparent)]
pub(crate) struct Each(
    #[allow(dead_code, reason = "for the schema; rows are read as factors")]
    serde_json::Map<String, serde_json::Value>,
);

/// Returns the entries of an entry in the document: one for each value of `each`, or the entry itself. Without
/// entries, an error was reported.
pub(super) fn entries<'a>(node: &'a Node, errors: &Errors) -> Vec<Cow<'a, Node>> {
    let Some(each) = node.field(EACH) else { return vec![Cow::Borrowed(node)] };
    let mut base = node.clone();
    base.retain(|name| name != EACH);
    let mut columns = vec![];
    let before = errors.len();
    find_columns(each, Some(&base), &mut vec![], &mut columns, errors);
    let Some((reference, first)) = columns.first() else {
        if errors.len() == before {
            errors.report(each.place.clone(), expects_columns());
        }
        return vec![];
    };
    let count = first.len();
    if count == 0 {
        errors.report(each.place.clone(), expects_columns());
    }
    for (name, column) in &columns {
        if column.len() != count {
            let message = format!("`{name}` has {} values, `{reference}` has {count}", column.len());
            let help = "each column needs one value for each factor";
            let place = column.first().map_or(&each.place, |value| &value.place);
            errors.report(place.clone(), Fault::with_help(message, help));
        }
    }
    if errors.len() > before {
        return vec![];
    }
    let entry = |row| {
        let mut entry = base.clone();
        merge(&mut entry, row_of(each, row));
        Cow::Owned(entry)
    };
    (0..count).map(entry).collect()
}

fn expects_columns() -> Fault {
    let help = "for example `each.factor.constants = { x = [1.0, 2.0], y = [1.1, 1.9] }`";
    Fault::with_help("expected fields with an array of values, one for each factor", help)
}

/// Collects the arrays of `each` with their names. Reports values that are neither arrays nor tables, and fields that
/// the entry has as well.
fn find_columns<'a>(
    node: &'a Node,
    base: Option<&Node>,
    path: &mut Vec<&'a str>,
    columns: &mut Vec<(String, &'a [Node])>,
    errors: &Errors,
) {
    match &node.value {
        Value::Table(table) => {
            for (name, field) in table.iter() {
                path.push(name);
                find_columns(&field.node, base.and_then(|base| base.field(name)), path, columns, errors);
                path.pop();
            }
        }
        Value::Array(_) if path.is_empty() => errors.report(node.place.clone(), expects_columns()),
        Value::Array(values) => {
            let name = path.join(".");
            if let Some(there) = base {
                let message =
                    format!("`{name}` is given here for all factors, and in `each` for each of them");
                errors.report(there.place.clone(), Fault::with_help(message, "remove one of them"));
            }
            columns.push((name, values));
        }
        _ => errors.report(node.place.clone(), expects_columns()),
    }
}

/// Returns a table in the form of `each`, with one value of each array.
fn row_of(each: &Node, row: usize) -> Node {
    match &each.value {
        // all arrays are of the same length
        Value::Array(values) => values.get(row).cloned().unwrap_or_else(Node::empty_table),
        Value::Table(table) => {
            let mut fields = Table::default();
            for (name, field) in table.iter() {
                fields.insert(name.clone(), Field { key: field.key.clone(), node: row_of(&field.node, row) });
            }
            Node::new(each.place.clone(), Value::Table(fields))
        }
        value => Node::new(each.place.clone(), value.clone()),
    }
}
