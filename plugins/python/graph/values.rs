//! Values of variables.
use super::{Reduced, Shared, html, pickled, unpickled};
use crate::algebra::ValueArray;
use crate::chosen::{What, known, untagged_fields, variable};
use crate::errors;
use crate::input::{Columns, dict_of, fields, key_of, key_rows};
use indexmap::IndexMap;
use manifactor::graph::catalogue::{Entry, find};
use manifactor::graph::{Key, Values as Inner, Variable};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyMapping};
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
        if let Ok(values) = values.cast::<PyDict>() {
            for (key, value) in values {
                made.__setitem__(&key, &value)?;
            }
            return Ok(made);
        }
        for item in values.cast::<PyMapping>()?.items()? {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
            made.__setitem__(&key, &value)?;
        }
        Ok(made)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let key = key_of("Values", key)?;
        match self.0.variable(key.as_str()) {
            Some(value) => What::Variable(value.erased().clone_box().into()).into_python(py),
            None => Err(PyKeyError::new_err(format!("there is no variable `{key}`"))),
        }
    }

    fn __setitem__(&mut self, key: &Bound<'_, PyAny>, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let (key, value) = (key_of("Values", key)?, variable("value", value)?);
        self.0.change("values")?.insert_boxed(key, value.erased().clone_box());
        Ok(())
    }

    fn __delitem__(&mut self, key: &Bound<'_, PyAny>) -> PyResult<()> {
        let key = key_of("Values", key)?;
        match self.0.change("values")?.remove(key.as_str()) {
            Some(_) => Ok(()),
            None => Err(PyKeyError::new_err(format!("there is no variable `{key}`"))),
        }
    }

    fn __contains__(&self, key: &Bound<'_, PyAny>) -> bool {
        key_of("Values", key).is_ok_and(|key| self.0.contains(key.as_str()))
    }

    /// Returns the value of a key, or `default` if there is none.
    #[pyo3(signature = (key, default = None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        key: &Bound<'py, PyAny>,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        match self.0.contains(key_of("Values", key)?.as_str()) {
            true => self.__getitem__(py, key).map(Some),
            false => Ok(default),
        }
    }

    /// Returns all keys with their values, in insertion order.
    fn items<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
        let item = |(key, value): (&Key, &dyn Variable)| {
            let value = What::Variable(value.erased().clone_box().into()).into_python(py)?;
            Ok((key.as_str().to_owned(), value))
        };
        self.0.iter().map(item).collect()
    }

    /// Inserts the values of a dict or of another `Values`. Existing values of these keys are replaced.
    fn update(slf: &Bound<'_, Self>, values: &Bound<'_, PyAny>) -> PyResult<()> {
        // a copy, because `values` may be this object
        let other = Self::new(Some(values))?;
        let mut this = slf.borrow_mut();
        let inner = this.0.change("values")?;
        for (key, value) in other.0.iter() {
            inner.insert_boxed(key.clone(), value.erased().clone_box());
        }
        Ok(())
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

    /// Inserts many values of one type, from an array of values or from a type and its fields.
    #[pyo3(signature = (keys, r#type, fields = None, *, prefix = None))]
    fn insert_many(
        slf: &Bound<'_, Self>,
        keys: &Bound<'_, PyAny>,
        r#type: &Bound<'_, PyAny>,
        fields: Option<&Bound<'_, PyAny>>,
        prefix: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (keys, width) = key_rows("insert_many", keys, prefix)?;
        if width != 1 {
            return Err(errors::argument(
                "insert_many",
                "keys",
                format!("expected one key for each, got {width}"),
            ));
        }
        let fields = fields.map(dict_of).transpose()?;
        let mut rows = Rows::new(keys.len(), r#type, fields.as_ref())?;
        let mut made: IndexMap<Key, Box<dyn Variable>> = IndexMap::with_capacity(keys.len());
        for (row, key) in keys.into_iter().enumerate() {
            if let Some(first) = made.get_index_of(&key) {
                let message = format!("`{key}` is in rows {first} and {row}: expected each key once");
                return Err(errors::argument("insert_many", "keys", message));
            }
            made.insert(key, rows.row(row)?);
        }
        // reading the arguments may run Python, and so other threads
        let mut this = slf.try_borrow_mut()?;
        let values = this.0.change("values")?;
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
        let dict = fields(py, values.iter().map(|(_, value)| *value))?;
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

/// Values by row.
enum Rows {
    Array(ValueArray),
    Read { entry: &'static Entry, columns: Columns },
}

impl Rows {
    /// Creates the rows from an array of values, or from a type and fields whose arrays are columns.
    fn new(rows: usize, of: &Bound<'_, PyAny>, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        if let Ok(array) = of.cast::<ValueArray>() {
            let found = array.get().values.len();
            if found != rows {
                let message = format!("expected {rows} values, one for each key, got {found}");
                return Err(errors::argument("insert_many", "values", message));
            }
            if fields.is_some() {
                let message = "an array of values has its fields: leave them out";
                return Err(errors::argument("insert_many", "fields", message));
            }
            return Ok(Self::Array(array.get().clone()));
        }
        let name: String = match of.extract() {
            Ok(name) => name,
            Err(_) => of.getattr("TYPE")?.extract()?,
        };
        known("variable", &name)?;
        let Some(fields) = fields else {
            let message =
                format!("expected the fields of a `{name}`, or an array of values in place of the type");
            return Err(errors::argument("insert_many", "fields", message));
        };
        let entry = find("variable", &name).ok_or_else(|| errors::internal(&name))?;
        Ok(Self::Read { entry, columns: Columns::new(&name, rows, &untagged_fields(&name, fields)?)? })
    }

    fn row(&mut self, row: usize) -> PyResult<Box<dyn Variable>> {
        match self {
            Self::Array(array) => {
                let value = array.values.get(row).ok_or_else(|| errors::internal("insert_many"))?;
                Ok(value.erased().clone_box())
            }
            Self::Read { entry, columns } => {
                let read = entry.read::<dyn Variable>(columns.row(row));
                read.map_err(|error| errors::row(entry.name, row, &error, "fields"))
            }
        }
    }
}
