//! Arrays of values of one type.
use crate::chosen::{Chosen, What, known, untagged_fields};
use crate::errors;
use crate::input::{Columns, array_like, fields, to_array};
use manifactor::graph::Variable;
use manifactor::graph::catalogue::find;
use manifactor::graph::quantity::variable_quantity;
use numpy::{PyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyAttributeError, PyIndexError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyInt};
use std::sync::Arc;

/// An immutable array of values of one type.
#[pyclass(module = "manifactor._native", frozen, subclass, sequence)]
#[derive(Clone)]
pub(crate) struct ValueArray {
    /// Name of the type in documents.
    pub name: &'static str,
    pub values: Arc<[Arc<dyn Variable>]>,
}

impl ValueArray {
    /// Creates an array of values of a registered type.
    pub(crate) fn of(name: &str, values: Vec<Arc<dyn Variable>>) -> PyResult<Self> {
        known("variable", name)?;
        let name = find("variable", name).ok_or_else(|| errors::internal(name))?.name;
        Ok(Self { name, values: values.into() })
    }

    /// Converts it to an object of the Python class.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let class = py.import("manifactor.algebra")?.getattr("ValueArray")?;
        class.call1((Bound::new(py, self)?,))
    }

    fn serialized(&self) -> PyResult<Vec<serde_json::Value>> {
        self.values.iter().map(|x| serde_json::to_value(&**x).map_err(errors::internal)).collect()
    }
}

#[pymethods]
impl ValueArray {
    /// Creates an array from values of one type. Without values, `type` is the type.
    #[new]
    #[pyo3(signature = (values, r#type = None))]
    fn new(values: &Bound<'_, PyAny>, r#type: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        if let Ok(other) = values.cast::<Self>() {
            return Ok(other.get().clone());
        }
        let mut name = r#type.map(type_name).transpose()?;
        let mut made = vec![];
        let items = values.try_iter().map_err(|_| {
            errors::argument("ValueArray", "values", "expected values of one type, such as [Se3(…), Se3(…)]")
        })?;
        for (row, item) in items.enumerate() {
            let value = crate::chosen::variable(&format!("values[{row}]"), &item?)?;
            let found = value.typetag_name();
            if *name.get_or_insert_with(|| found.to_owned()) != found {
                let expected = name.unwrap_or_default();
                let message = format!("expected values of one type, got `{expected}` and `{found}`");
                return Err(errors::argument("ValueArray", &format!("values[{row}]"), message));
            }
            made.push(value);
        }
        let Some(name) = name else {
            let message = "expected a type of values without which an empty array has none: type=mf.Se3";
            return Err(errors::argument("ValueArray", "type", message));
        };
        Self::of(&name, made)
    }

    /// Name of the type in documents.
    #[getter]
    fn r#type(&self) -> &'static str {
        self.name
    }

    fn __setattr__(&self, name: &str, _value: &Bound<'_, PyAny>) -> PyResult<()> {
        let of = self.name;
        Err(PyAttributeError::new_err(format!(
            "an array of `{of}` does not change: create a new one with another `{name}`"
        )))
    }

    /// Returns the fields, each as an array with one row per value.
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields(py, self.values.iter().map(|x| &**x))
    }

    /// Returns the numbers of the values, as a function under `@mf.batch` gets them, shape (n, size).
    fn numbers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let quantity = find("variable", self.name).and_then(|entry| variable_quantity((entry.type_id)()));
        let Some(quantity) = quantity else {
            let message = format!("a `{}` has fields only, see `fields()`", self.name);
            return Err(errors::argument("numbers", "type", message));
        };
        let size = quantity.shape.size;
        let mut flat = vec![0.0; size * self.values.len()];
        for (x, to) in self.values.iter().zip(flat.chunks_exact_mut(size.max(1))) {
            (quantity.values)(x.erased().as_any(), to);
        }
        to_array(py, &[self.values.len(), size], flat)
    }

    fn __len__(&self) -> usize {
        self.values.len()
    }

    fn __getitem__<'py>(&self, index: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (py, count) = (index.py(), self.values.len());
        if index.is_instance_of::<PyInt>() {
            let at: isize = index.extract()?;
            let place = if at < 0 { at.checked_add_unsigned(count) } else { Some(at) };
            let found = place.and_then(|place| self.values.get(usize::try_from(place).ok()?));
            let message = || format!("there is no value {at}: the array has {count}, from 0");
            let value = found.ok_or_else(|| PyIndexError::new_err(message()))?;
            return What::Variable(value.clone()).into_python(py);
        }
        // slices, masks and arrays of indices, as in NumPy
        let chosen = py.import("numpy")?.call_method1("arange", (count,))?.get_item(index)?;
        let shape = chosen.cast::<PyUntypedArray>().map(|array| array.shape().len()).unwrap_or_default();
        if shape == 0 {
            return self.__getitem__(&chosen.call_method0("__index__")?);
        }
        if shape > 1 {
            let message = format!("expected an index of one axis, got {shape}");
            return Err(errors::argument("ValueArray", "index", message));
        }
        let places: Vec<usize> = chosen.call_method0("tolist")?.extract()?;
        let values = places.iter().filter_map(|place| self.values.get(*place)).cloned().collect();
        Self { name: self.name, values }.into_python(py)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = other.get();
        Ok(self.name == other.name
            && self.values.len() == other.values.len()
            && self.serialized()? == other.serialized()?)
    }

    fn __repr__(&self) -> String {
        format!("ValueArray({} {})", self.values.len(), self.name)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }

    /// For `pickle`: the type and the values, without rounding.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (&'static str, String))> {
        let read = py.import("manifactor._native")?.getattr("unpickle_array")?;
        let text = serde_json::to_string(&self.serialized()?).map_err(errors::internal)?;
        Ok((read, (self.name, text)))
    }
}

/// Returns the name of a type, from a text or a class.
fn type_name(of: &Bound<'_, PyAny>) -> PyResult<String> {
    of.extract().or_else(|_| of.getattr("TYPE")?.extract())
}

/// Restores an array from the output of [`ValueArray::__reduce__`].
#[pyfunction]
fn unpickle_array<'py>(py: Python<'py>, name: &str, text: &str) -> PyResult<Bound<'py, PyAny>> {
    let read = serde_json::from_str::<Vec<Box<dyn Variable>>>(text);
    let values = read.map_err(|error| errors::argument("pickle", "array", error))?;
    ValueArray::of(name, values.into_iter().map(Arc::from).collect())?.into_python(py)
}

/// Creates an array from fields, each an array with one row per value.
#[pyfunction]
fn array_from_fields<'py>(name: &str, fields: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    let mut rows = None;
    for (field, value) in fields {
        let array = array_like(name, &field.str()?.to_cow()?, &value)?;
        rows = rows.or(array.and_then(|array| array.shape().first().copied()));
    }
    let Some(rows) = rows else {
        let message = "expected at least one array with one row per value";
        return Err(errors::argument("from_fields", "fields", message));
    };
    known("variable", name)?;
    let entry = find("variable", name).ok_or_else(|| errors::internal(name))?;
    let mut columns = Columns::new(name, rows, &untagged_fields(name, fields)?)?;
    let read = |row| {
        let read = entry.read::<dyn Variable>(columns.row(row));
        read.map(Arc::from).map_err(|error| errors::row(name, row, &error, "fields"))
    };
    let values = (0..rows).map(read).collect::<PyResult<_>>()?;
    ValueArray::of(name, values)?.into_python(fields.py())
}

/// One value, or an array of values of one type.
pub(super) struct Points {
    pub array: ValueArray,
    /// False for a single value, which applies to all rows.
    pub is_array: bool,
}

impl Points {
    /// Reads an argument; `None` if it is something else.
    pub(super) fn of(value: &Bound<'_, PyAny>) -> Option<Self> {
        if let Ok(array) = value.cast::<ValueArray>() {
            return Some(Self { array: array.get().clone(), is_array: true });
        }
        match value.cast::<Chosen>().map(|chosen| &chosen.get().0) {
            Ok(What::Variable(x)) => {
                let array = ValueArray { name: x.typetag_name(), values: [x.clone()].into() };
                Some(Self { array, is_array: false })
            }
            _ => None,
        }
    }

    /// Reads an argument.
    ///
    /// # Errors
    /// If it is neither a value nor an array of values.
    pub(super) fn read(what: &str, name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::of(value).map_or_else(
            || {
                let found = value.get_type().name()?;
                let message = format!("expected a value such as Se3(…), or an array of them, got {found}");
                Err(errors::argument(what, name, message))
            },
            Ok,
        )
    }

    /// The number of rows; `None` for a single value.
    pub(super) fn rows(&self) -> Option<usize> {
        self.is_array.then_some(self.array.values.len())
    }

    /// The value of a row.
    pub(super) fn row(&self, row: usize) -> Option<&Arc<dyn Variable>> {
        self.array.values.get(if self.is_array { row } else { 0 })
    }
}

/// Converts the values of an operation to one value, or to an array if an argument was one.
pub(super) fn into_python<'py>(
    py: Python<'py>,
    name: &str,
    values: Vec<Arc<dyn Variable>>,
    is_array: bool,
) -> PyResult<Bound<'py, PyAny>> {
    if is_array {
        return ValueArray::of(name, values)?.into_python(py);
    }
    let value = values.into_iter().next().ok_or_else(|| errors::internal("no value"))?;
    What::Variable(value).into_python(py)
}

/// Returns the number of rows of arguments, of which `None` applies to all rows.
pub(super) fn common_rows(what: &str, rows: &[Option<usize>]) -> PyResult<Option<usize>> {
    let mut given = rows.iter().flatten();
    let Some(first) = given.next() else { return Ok(None) };
    match given.find(|n| *n != first) {
        Some(other) => {
            let message = format!("expected equal numbers of rows, got {first} and {other}");
            Err(errors::argument(what, "", message))
        }
        None => Ok(Some(*first)),
    }
}

pub(super) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(unpickle_array, module)?)?;
    module.add_function(wrap_pyfunction!(array_from_fields, module)?)
}
