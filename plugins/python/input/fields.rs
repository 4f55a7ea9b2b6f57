//! Fields of many values as arrays with one row per value.
use super::arrays::to_array;
use crate::errors;
use manifactor::graph::Variable;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value as Json;

/// Returns the fields of values of one type, each as an array with one row per value.
pub(crate) fn fields<'py, 'v>(
    py: Python<'py>,
    values: impl ExactSizeIterator<Item = &'v dyn Variable>,
) -> PyResult<Bound<'py, PyDict>> {
    let count = values.len();
    let mut fields: Vec<FieldColumn> = vec![];
    for value in values {
        let json = serde_json::to_value(value).map_err(errors::internal)?;
        let mut place = 0;
        gather("", &json, &mut place, &mut fields);
    }
    let dict = PyDict::new(py);
    for FieldColumn { name, shape, numbers, whole } in fields {
        // a field that some of the values lack is no column
        if numbers.len() == count * shape.iter().product::<usize>() {
            let shape: Vec<_> = std::iter::once(count).chain(shape).collect();
            let array = to_array(py, &shape, numbers)?.into_any();
            dict.set_item(name, if whole { array.call_method1("astype", ("int64",))? } else { array })?;
        }
    }
    Ok(dict)
}

/// A field of all values.
struct FieldColumn {
    name: String,
    shape: Vec<usize>,
    numbers: Vec<f64>,
    /// Whether its numbers are whole by their type, such as the width of an image.
    whole: bool,
}

/// Appends the numbers of a value to its fields, such as `translation` or `camera.fx`.
fn gather(path: &str, json: &Json, place: &mut usize, fields: &mut Vec<FieldColumn>) {
    if let Json::Object(inner) = json {
        for (name, value) in inner.iter().filter(|(name, _)| *name != "type") {
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            gather(&path, value, place, fields);
        }
        return;
    }
    let Some(shape) = shape(json) else { return };
    // fields usually have a constant order in all values
    let found = match fields.get(*place) {
        Some(field) if field.name == path => Some(*place),
        _ => fields.iter().position(|field| field.name == path),
    };
    let at = found.unwrap_or_else(|| {
        let whole = json.is_u64() || json.is_i64();
        fields.push(FieldColumn { name: path.to_owned(), shape, numbers: vec![], whole });
        fields.len() - 1
    });
    *place = at + 1;
    if let Some(field) = fields.get_mut(at) {
        flatten(json, &mut field.numbers);
    }
}

/// The shape of nested arrays of numbers; `None` for anything else.
fn shape(json: &Json) -> Option<Vec<usize>> {
    match json {
        Json::Number(_) => Some(vec![]),
        Json::Array(items) => {
            let inner = shape(items.first()?)?;
            Some(std::iter::once(items.len()).chain(inner).collect())
        }
        _ => None,
    }
}

fn flatten(json: &Json, numbers: &mut Vec<f64>) {
    match json {
        Json::Array(items) => items.iter().for_each(|item| flatten(item, numbers)),
        json => numbers.extend(json.as_f64()),
    }
}
