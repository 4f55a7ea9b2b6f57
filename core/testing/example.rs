//! Examples in the docs of registered types.
use crate::error::LawError;
use manifactor_document::Node;
use manifactor_graph::Variable;
use manifactor_graph::catalogue::{self, Entry, Kind};
use serde_json::Value;
use std::any::TypeId;

/// Reads the example in the docs of a registered type.
///
/// # Errors
/// If there is none, or it cannot be read.
pub fn example<K: Kind + ?Sized>(entry: &'static Entry) -> Result<Box<K>, LawError> {
    entry.read::<K>(&example_fields(entry)?).map_err(|e| problem(entry, format!("its example: {e}")))
}

/// Reads the example of a manifold, for a factor of this entry.
pub(crate) fn example_point(of: &'static Entry, id: TypeId) -> Result<Box<dyn Variable>, LawError> {
    let kind = <dyn Variable as Kind>::NAME;
    let entry = catalogue::entries(kind).into_iter().find(|e| (e.type_id)() == id);
    example(entry.ok_or_else(|| problem(of, "one of its variables is of no registered type".into()))?)
}

/// Returns the fields of the example: its table with the entry's name as `type`.
pub(crate) fn example_fields(entry: &'static Entry) -> Result<Node, LawError> {
    let missing = || problem(entry, format!("its example has no table with type = \"{}\"", entry.name));
    let table = table_of_type(&example_document(entry)?, entry.name).ok_or_else(missing)?;
    serde_json::from_value(table).map_err(|e| problem(entry, e.to_string()))
}

fn example_document(entry: &'static Entry) -> Result<Value, LawError> {
    let text = entry.example().ok_or_else(|| problem(entry, "its docs have no ```toml example".into()))?;
    let document: toml::Value =
        toml::from_str(&text).map_err(|e| problem(entry, format!("its example is no TOML: {e}")))?;
    serde_json::to_value(document).map_err(|e| problem(entry, e.to_string()))
}

/// Returns the keys of a factor in its example; empty if the example only has the factor.
pub(crate) fn example_keys(entry: &'static Entry) -> Vec<String> {
    let document = example_document(entry).unwrap_or_default();
    let factors = document.get("factors").and_then(Value::as_array).cloned().unwrap_or_default();
    let this = |f: &&Value| f.pointer("/factor/type").and_then(Value::as_str) == Some(entry.name);
    let keys = factors.iter().find(this).and_then(|f| f.get("keys")).and_then(Value::as_array).cloned();
    keys.unwrap_or_default().iter().filter_map(Value::as_str).map(str::to_owned).collect()
}

fn table_of_type(value: &Value, name: &str) -> Option<Value> {
    match value {
        Value::Object(table) if table.get("type").and_then(Value::as_str) == Some(name) => {
            let mut fields = table.clone();
            fields.shift_remove("type");
            Some(Value::Object(fields))
        }
        Value::Object(table) => table.values().find_map(|v| table_of_type(v, name)),
        Value::Array(all) => all.iter().find_map(|v| table_of_type(v, name)),
        _ => None,
    }
}

pub(crate) fn problem(entry: &'static Entry, problem: String) -> LawError {
    LawError::Entry { kind: entry.kind, name: entry.name, problem }
}
