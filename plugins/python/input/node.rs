//! Conversion between Python values and nodes of a document.
use super::arrays::{Numbers, any_numbers, array, frozen, is_array_like};
use super::serialized::serialized;
use crate::errors;
use manifactor::config::{Field, MAX_DEPTH, Node, Place, SourceText, Value};
use manifactor::graph::Variable;
use numpy::PyUntypedArray;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMappingProxy, PyString, PyTuple};
use serde_json::Value as Json;
use std::fmt::Display;
use std::sync::Arc;

/// The fields of a value without its type, for a field that accepts only one type.
#[pyclass(module = "manifactor._native", frozen)]
pub(crate) struct Untagged(pub Arc<dyn Variable>);

impl Untagged {
    /// Returns the fields as a node, all of whose parts have one place.
    pub(crate) fn node(&self, place: &Place) -> PyResult<Node> {
        let mut node = serialized(&*self.0, place).map_err(errors::internal)?;
        node.retain(|name| name != "type");
        Ok(node)
    }
}

/// The location of a value among the arguments, for messages.
trait Location: Sized {
    /// The error of a value that no document can hold.
    type Wrong: From<PyErr>;
    /// The place of the value, with a text that errors can show.
    fn place(&self, text: &str) -> Place;
    /// A field of the value.
    fn field(&self, name: &str) -> Self;
    /// An item of the value.
    fn item(&self, index: usize) -> Self;
    fn wrong(&self, message: impl Display) -> Self::Wrong;
    /// Accepts a value that is not finite only if its reader reports it.
    fn check_finite(&self, is_finite: bool) -> Result<(), Self::Wrong>;
    /// Reads the numbers of an array, which have to be finite.
    fn numbers(&self, array: &Bound<'_, PyAny>) -> PyResult<Numbers>;
}

/// A value of an argument such as `camera.fx`.
struct Argument<'a> {
    what: &'a str,
    path: String,
}

impl Location for Argument<'_> {
    type Wrong = PyErr;

    fn place(&self, text: &str) -> Place {
        SourceText::new(&self.path, text).place(0..text.len())
    }

    fn field(&self, name: &str) -> Self {
        Self { what: self.what, path: within(&self.path, name) }
    }

    fn item(&self, index: usize) -> Self {
        Self { what: self.what, path: format!("{}[{index}]", self.path) }
    }

    fn wrong(&self, message: impl Display) -> PyErr {
        errors::argument(self.what, &self.path, message)
    }

    fn check_finite(&self, _is_finite: bool) -> PyResult<()> {
        Ok(())
    }

    fn numbers(&self, value: &Bound<'_, PyAny>) -> PyResult<Numbers> {
        any_numbers(self.what, &self.path, &array(self.what, &self.path, value)?)
    }
}

/// No location: a message about the value is lost.
struct NoLocation;

/// Something that no document can hold.
struct Unreadable;

impl From<PyErr> for Unreadable {
    fn from(_: PyErr) -> Self {
        Self
    }
}

impl Location for NoLocation {
    type Wrong = Unreadable;

    fn place(&self, _text: &str) -> Place {
        Place::nowhere()
    }

    fn field(&self, _name: &str) -> Self {
        Self
    }

    fn item(&self, _index: usize) -> Self {
        Self
    }

    fn wrong(&self, _message: impl Display) -> Unreadable {
        Unreadable
    }

    fn check_finite(&self, is_finite: bool) -> Result<(), Unreadable> {
        if is_finite { Ok(()) } else { Err(Unreadable) }
    }

    fn numbers(&self, value: &Bound<'_, PyAny>) -> PyResult<Numbers> {
        any_numbers("", "", &array("", "", value)?)
    }
}

/// The path of a field within an argument.
pub(crate) fn within(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

/// Converts a value to a node, as if it had been read from a document. Errors use the name `path`.
///
/// # Errors
/// If no document can hold a value.
pub(crate) fn node(what: &str, path: &str, value: &Bound<'_, PyAny>) -> PyResult<Node> {
    nested(&Argument { what, path: path.to_owned() }, value, 0)
}

/// Converts a value to a node without places. `None` for everything that [`node`] or a reader might reject.
pub(crate) fn plain_node(value: &Bound<'_, PyAny>) -> Option<Node> {
    nested(&NoLocation, value, 0).ok()
}

fn nested<W: Location>(at: &W, value: &Bound<'_, PyAny>, depth: usize) -> Result<Node, W::Wrong> {
    if depth > MAX_DEPTH {
        return Err(at.wrong(format_args!("nested more than {MAX_DEPTH} levels deep")));
    }
    let plain = if value.is_none() {
        Value::Null
    } else if let Ok(value) = value.cast::<PyBool>() {
        Value::Bool(value.is_true())
    } else if let Ok(value) = value.cast::<PyInt>() {
        match value.extract::<i64>() {
            Ok(whole) => Value::Integer(whole),
            Err(_) => match value.extract() {
                Ok(large) => Value::Float(large),
                Err(_) => return Err(at.wrong("expected a number of at most 64 bits")),
            },
        }
    } else if let Ok(value) = value.cast::<PyFloat>() {
        at.check_finite(value.value().is_finite())?;
        Value::Float(value.value())
    } else if let Ok(text) = value.cast::<PyString>() {
        let text = text.to_cow()?.into_owned();
        return Ok(Node::new(at.place(&text), Value::String(text)));
    } else if let Ok(fields) = value.cast::<PyMappingProxy>() {
        // fields of an immutable object
        return nested(at, &fields.call_method0("copy")?, depth);
    } else if let Ok(dict) = value.cast::<PyDict>() {
        let mut table = manifactor::config::Table::default();
        for (name, value) in dict {
            let Ok(name) = name.extract::<String>() else {
                return Err(at.wrong(format_args!("expected names as keys, got {name}")));
            };
            let inner = at.field(&name);
            let node = nested(&inner, &value, depth + 1)?;
            table.insert(name, Field { key: inner.place(""), node });
        }
        Value::Table(table)
    } else if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.enumerate();
        let item = |(i, item): (usize, PyResult<_>)| nested(&at.item(i), &item?, depth + 1);
        Value::Array(items.map(item).collect::<Result<_, W::Wrong>>()?)
    } else if let Ok(value) = value.cast::<Untagged>() {
        at.check_finite(value.get().0.erased().is_finite())?;
        return Ok(value.get().node(&at.place(""))?);
    } else if value.cast::<PyUntypedArray>().is_ok() || is_array_like(value)? {
        let numbers = at.numbers(value)?;
        return Ok(array_node(&at.place(""), &numbers.shape, &numbers.values, numbers.whole));
    } else if let Ok(fields) = value.call_method0("to_dict") {
        return nested(at, &fields, depth + 1);
    } else if let Ok(path_like) = value.call_method0("__fspath__") {
        return nested(at, &path_like, depth + 1);
    } else {
        let found = value.get_type().name()?;
        return Err(at.wrong(format_args!("expected numbers, texts, lists, dicts or arrays, got {found}")));
    };
    Ok(Node::new(at.place(""), plain))
}

/// Converts numbers to nested arrays.
pub(crate) fn array_node(place: &Place, shape: &[usize], values: &[f64], whole: bool) -> Node {
    let value = match shape.split_first() {
        None => number(values.first().copied().unwrap_or_default(), whole),
        Some((_, inner)) => {
            let width = inner.iter().product::<usize>().max(1);
            let rows = values.chunks_exact(width);
            Value::Array(rows.map(|row| array_node(place, inner, row, whole)).collect())
        }
    };
    Node::new(place.clone(), value)
}

pub(crate) fn number(x: f64, whole: bool) -> Value {
    // a whole number above the range of integers
    let is_integer = whole && x.abs() < i64::MAX as f64;
    if is_integer { Value::Integer(x as i64) } else { Value::Float(x) }
}

/// Converts a field of an immutable object to a read-only value, so that a change is an error and not lost.
pub(crate) fn unchangeable<'py>(py: Python<'py>, json: &Json) -> PyResult<Bound<'py, PyAny>> {
    match json {
        Json::Array(items) if is_numeric(items) => {
            let made = py.import("numpy")?.call_method1("array", (json_to_python(py, json)?, "float64"))?;
            frozen(made)
        }
        Json::Array(items) => {
            let items = items.iter().map(|item| unchangeable(py, item)).collect::<PyResult<Vec<_>>>()?;
            Ok(PyTuple::new(py, items)?.into_any())
        }
        Json::Object(fields) => {
            let dict = PyDict::new(py);
            for (name, value) in fields {
                dict.set_item(name, unchangeable(py, value)?)?;
            }
            Ok(PyMappingProxy::new(py, dict.as_mapping()).into_any())
        }
        other => json_to_python(py, other),
    }
}

fn is_numeric(items: &[Json]) -> bool {
    !items.is_empty()
        && items.iter().all(|item| match item {
            Json::Array(inner) => is_numeric(inner),
            other => other.is_number(),
        })
}

/// Converts a serializable value to dicts, lists and numbers.
pub(crate) fn to_python<'py>(
    py: Python<'py>,
    value: &(impl serde::Serialize + ?Sized),
) -> PyResult<Bound<'py, PyAny>> {
    json_to_python(py, &serde_json::to_value(value).map_err(errors::internal)?)
}

/// Converts JSON to dicts, lists and numbers.
pub(crate) fn json_to_python<'py>(py: Python<'py>, json: &Json) -> PyResult<Bound<'py, PyAny>> {
    match json {
        Json::Null => Ok(py.None().into_bound(py)),
        Json::Bool(value) => value.into_bound_py_any(py),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => whole.into_bound_py_any(py),
            None => number.as_f64().unwrap_or(f64::NAN).into_bound_py_any(py),
        },
        Json::String(text) => text.into_bound_py_any(py),
        Json::Array(items) => {
            let items = items.iter().map(|item| json_to_python(py, item)).collect::<PyResult<Vec<_>>>()?;
            Ok(PyList::new(py, items)?.into_any())
        }
        Json::Object(fields) => {
            let dict = PyDict::new(py);
            for (name, value) in fields {
                dict.set_item(name, json_to_python(py, value)?)?;
            }
            Ok(dict.into_any())
        }
    }
}
