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
    let mut fields: Vec<(String, Vec<usize>, Vec<f64>)> = vec![];
    for value in values {
        let json = serde_json::to_value(value).map_err(errors::internal)?;
        let mut place = 0;
        gather("", &json, &mut place, &mut fields);
    }
    let dict = PyDict::new(py);
    for (field, shape, numbers) in fields {
        // a field that some of the values lack is no column
        if numbers.len() == count * shape.iter().product::<usize>() {
            let shape: Vec<_> = std::iter::once(count).chain(shape).collect();
            dict.set_item(field, to_array(py, &shape, numbers)?)?;
        }
    }
    Ok(dict)
}

/// Appends the numbers of a value to its fields, such as `translation` or `camera.fx`.
fn gather(path: &str, json: &Json, place: &mut usize, fields: &mut Vec<(String, Vec<usize>, Vec<f64>)>) {
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
        Some((name, ..)) if name == path => Some(*place),
        _ => fields.iter().position(|(name, ..)| name == path),
    };
    let at = found.unwrap_or_else(|| {
        fields.push((path.to_owned(), shape, vec![]));
        fields.len() - 1
    });
    *place = at + 1;
    if let Some((_, _, numbers)) = fields.get_mut(at) {
        flatten(json, numbers);
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
