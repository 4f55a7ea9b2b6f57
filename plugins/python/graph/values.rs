//! Values of variables.
use super::{Reduced, Shared, html, pickled, unpickled};
use crate::chosen::{What, known, variable};
use crate::errors;
use crate::input::{Columns, key, key_rows, to_array};
use indexmap::IndexMap;
use manifactor::graph::catalogue::find;
use manifactor::graph::{Key, Values as Inner, Variable};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use serde_json::Value as Json;
use std::collections::BTreeMap;

/// The values of the variables by key, in insertion order.
#[pyclass(module = "manifactor", mapping)]
#[derive(Default)]
pub(crate) struct Values(pub Shared<Inner>);

#[pymethods]
impl Values {
    /// Creates empty values, or copies those of a dict or of another `Values`.
    #[new]
    #[pyo3(signature = (values = None))]
    fn new(values: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let Some(values) = values else { return Ok(Self::default()) };
        if let Ok(values) = values.cast::<Self>() {
            return Ok(values.borrow().__copy__());
        }
        let mut made = Self::default();
        for (key, value) in values.cast::<PyDict>()? {
            made.__setitem__(&key.extract::<String>()?, &value)?;
        }
        Ok(made)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        match self.0.variable(key) {
            Some(value) => What::Variable(value.erased().clone_box().into()).into_python(py),
            None => Err(PyKeyError::new_err(format!("there is no variable `{key}`"))),
        }
    }

    fn __setitem__(&mut self, key: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let (key, value) = (self::key("Values", key)?, variable("value", value)?);
        self.0.change("values")?.insert_boxed(key, value.erased().clone_box());
        Ok(())
    }

    fn __delitem__(&mut self, key: &str) -> PyResult<()> {
        match self.0.change("values")?.remove(key) {
            Some(_) => Ok(()),
            None => Err(PyKeyError::new_err(format!("there is no variable `{key}`"))),
        }
    }

    fn __contains__(&self, key: &str) -> bool {
        self.0.contains(key)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.keys(py)?.try_iter()?.into_any())
    }

    /// Returns all keys in insertion order.
    fn keys<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.0.iter().map(|(key, _)| key.as_str()))
    }

    /// Inserts many values of one type.
    #[pyo3(signature = (keys, r#type, fields, *, prefix = None))]
    fn insert_many(
        &mut self,
        keys: &Bound<'_, PyAny>,
        r#type: &Bound<'_, PyAny>,
        fields: &Bound<'_, PyDict>,
        prefix: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let name: String = match r#type.extract() {
            Ok(name) => name,
            Err(_) => r#type.getattr("TYPE")?.extract()?,
        };
        let (keys, width) = key_rows("insert_many", keys, prefix)?;
        if width != 1 {
            return Err(errors::argument(
                "insert_many",
                "keys",
                format!("expected one key for each, got {width}"),
            ));
        }
        known("variable", &name)?;
        let entry = find("variable", &name).ok_or_else(|| errors::internal(&name))?;
        let mut columns = Columns::new(&name, keys.len(), fields)?;
        let mut made: IndexMap<Key, Box<dyn Variable>> = IndexMap::with_capacity(keys.len());
        for (row, key) in keys.into_iter().enumerate() {
            if let Some(first) = made.get_index_of(&key) {
                let message = format!("`{key}` is in rows {first} and {row}: expected each key once");
                return Err(errors::argument("insert_many", "keys", message));
            }
            let read = entry.read::<dyn Variable>(columns.row(row));
            made.insert(key, read.map_err(|error| errors::row(&name, row, &error, "fields"))?);
        }
        let values = self.0.change("values")?;
        made.into_iter().for_each(|(key, value)| drop(values.insert_boxed(key, value)));
        Ok(())
    }

    fn _repr_html_(&self) -> String {
        html(
            &["variable", "number"],
            self.types().into_iter().map(|(name, n)| [name.to_owned(), n.to_string()]),
        )
    }

    /// Returns the number of values of each type.
    fn types(&self) -> BTreeMap<&'static str, usize> {
        let mut types = BTreeMap::new();
        for (_, value) in self.0.iter() {
            *types.entry(value.typetag_name()).or_default() += 1;
        }
        types
    }

    /// Returns the keys and fields of all values of one type; each field is an array with one row per
    /// value.
    fn columns<'py>(
        &self,
        py: Python<'py>,
        r#type: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyList>, Bound<'py, PyDict>)> {
        let name: String = match r#type.extract() {
            Ok(name) => name,
            Err(_) => r#type.getattr("TYPE")?.extract()?,
        };
        known("variable", &name)?;
        let values: Vec<_> = self.0.iter().filter(|(_, value)| value.typetag_name() == name).collect();
        let mut fields: Vec<(String, Vec<usize>, Vec<f64>)> = vec![];
        for (_, value) in &values {
            let json = serde_json::to_value(value).map_err(errors::internal)?;
            let mut place = 0;
            gather("", &json, &mut place, &mut fields);
        }
        let dict = PyDict::new(py);
        for (field, shape, numbers) in fields {
            // a field that some of the values lack is no column
            if numbers.len() == values.len() * shape.iter().product::<usize>() {
                let shape: Vec<_> = std::iter::once(values.len()).chain(shape).collect();
                dict.set_item(field, to_array(py, &shape, numbers)?)?;
            }
        }
        Ok((PyList::new(py, values.iter().map(|(key, _)| key.as_str()))?, dict))
    }

    fn __copy__(&self) -> Self {
        Self(self.0.copy())
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        Self(self.0.copy())
    }

    /// For `pickle`: the content as bytes.
    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        pickled(py, &*self.0)
    }

    fn __setstate__(&mut self, state: &[u8]) -> PyResult<()> {
        self.0 = unpickled("Values", state)?;
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        Ok((slf.get_type().into_any(), (), slf.borrow().__getstate__(slf.py())?))
    }

    fn __repr__(&self) -> String {
        let types: Vec<_> = self.types().into_iter().map(|(name, n)| format!("{n} {name}")).collect();
        format!("Values({})", types.join(", "))
    }
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
