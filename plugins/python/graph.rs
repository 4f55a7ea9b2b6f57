//! Graphs, values and noise.
mod entry;
mod files;
mod noise;
mod shared;
mod values;

use crate::chosen::{factor, known, loss, untagged_fields};
use crate::errors;
use crate::input::{Columns, dict_of, key_of, key_rows, keys};
use crate::threads::detach;
use entry::Options;
use manifactor::graph::catalogue::find;
use manifactor::graph::{
    Bounds, Factor, FactorEntry as Entry, Fixed, Graph as Inner, GraphError, Interval, Key,
};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyMappingProxy};
use std::collections::BTreeMap;
use std::sync::Arc;

pub(crate) use entry::FactorEntry;
pub(crate) use files::document;
pub(crate) use noise::Noise;
pub(crate) use shared::Shared;
pub(crate) use values::Values;

/// Factors between named variables, and the variables that are fixed.
#[pyclass(module = "manifactor")]
#[derive(Default)]
pub(crate) struct Graph(pub Shared<Inner>);

#[pymethods]
impl Graph {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Adds a factor, and returns its index in the graph, from 0: a `FactorEntry` alone, or the keys of its
    /// variables with a residual.
    ///
    /// `keys` are in the order of the residual's arguments. The noise is one of `noise`, `sigma` and
    /// `sigmas`, and defaults to a standard deviation of 1 in every row. `loss` defaults to none, and
    /// `name`, which reports use, to the name of the factor's type.
    #[pyo3(signature = (keys, factor = None, *, noise = None, sigma = None, sigmas = None, loss = None, name = None))]
    #[expect(clippy::too_many_arguments, reason = "the keyword arguments of Python")]
    fn add(
        slf: &Bound<'_, Self>,
        keys: &Bound<'_, PyAny>,
        factor: Option<&Bound<'_, PyAny>>,
        noise: Option<&Bound<'_, PyAny>>,
        sigma: Option<&Bound<'_, PyAny>>,
        sigmas: Option<&Bound<'_, PyAny>>,
        loss: Option<&Bound<'_, PyAny>>,
        name: Option<&str>,
    ) -> PyResult<usize> {
        let options = Options { noise, sigma, sigmas, loss, name };
        let at = snapshot(slf)?.factors().len();
        let entry = match (keys.cast::<FactorEntry>(), factor) {
            (Ok(entry), None) if options.is_empty() => entry.get().0.clone(),
            (Ok(_), _) => {
                let message = "a FactorEntry has its keys, noise and loss: pass it alone";
                return Err(errors::argument("add", "factor", message));
            }
            (Err(_), None) => {
                let found = keys.get_type().name()?;
                let message = format!(
                    "expected a FactorEntry such as between(\"x0\", \"x1\", pose), or keys with a factor; got {found} alone"
                );
                return Err(errors::argument("add", "factor", message));
            }
            (Err(_), Some(factor)) => {
                let keys = self::keys("add", keys)?;
                let factor = self::factor("factor", factor)?;
                options.entry("add", at, keys, factor)?
            }
        };
        // reading the arguments may run Python, and so other threads, which add factors too
        let mut this = slf.try_borrow_mut()?;
        let at = this.0.factors().len();
        this.0.change("graph")?.push(entry);
        Ok(at)
    }

    /// Adds many factors of one type, and returns the range of their indices.
    #[pyo3(signature = (factor, keys, fields = None, *, prefix = None, noise = None, loss = None))]
    fn add_many(
        slf: &Bound<'_, Self>,
        factor: &Bound<'_, PyAny>,
        keys: &Bound<'_, PyAny>,
        fields: Option<&Bound<'_, PyAny>>,
        prefix: Option<&Bound<'_, PyAny>>,
        noise: Option<&Bound<'_, PyAny>>,
        loss: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(usize, usize)> {
        let (keys, width) = key_rows("add_many", keys, prefix)?;
        let rows = keys.len() / width.max(1);
        let loss = loss.map(|loss| self::loss("loss", loss)).transpose()?;
        let mut noises = noise::Rows::new("add_many", rows, noise)?;
        let fields = fields.map(dict_of).transpose()?;
        let mut factors = Factors::new(factor, rows, fields.as_ref())?;
        let first = snapshot(slf)?.factors().len();
        // all factors are added or none
        let mut entries = Vec::with_capacity(rows);
        for (row, keys) in keys.chunks_exact(width.max(1)).enumerate() {
            let (keys, factor, noise) = (keys.to_vec(), factors.row(row)?, noises.row(row)?);
            let entry = Entry { keys, name: None, factor, noise, loss: loss.clone() };
            // all rows have equal numbers of keys and noise of equal size
            if row == 0 {
                check(&entry, first)?;
            } else {
                distinct(&entry, first + row)?;
            }
            entries.push(entry);
        }
        let mut this = slf.try_borrow_mut()?;
        let first = this.0.factors().len();
        this.0.change("graph")?.factors_mut().append(&mut entries);
        Ok((first, first + rows))
    }

    /// Fixes a variable at its initial value. With `directions`, no step goes along these directions of its tangent space,
    /// in addition to those that are fixed; those of a pose are the axes of its current frame.
    #[pyo3(signature = (key, directions = None))]
    fn fix(&mut self, key: &Bound<'_, PyAny>, directions: Option<Vec<String>>) -> PyResult<()> {
        let key = key_of("fix", key)?;
        let graph = self.0.change("graph")?;
        match directions {
            Some(names) => {
                graph.fix_directions(key, &names.iter().map(String::as_str).collect::<Vec<_>>());
            }
            None => graph.fix(key),
        }
        Ok(())
    }

    /// Removes the constraint of `fix` from a variable.
    fn free(&mut self, key: &Bound<'_, PyAny>) -> PyResult<()> {
        let key = key_of("free", key)?;
        self.0.change("graph")?.set_fixed(key, Fixed::Whole(false));
        Ok(())
    }

    /// The fixed variables by key: `True`, or the names of the fixed directions.
    #[getter]
    fn fixed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        let dict = PyDict::new(py);
        for (key, fixed) in self.0.fixed() {
            match fixed {
                Fixed::Whole(whole) => dict.set_item(key.as_str(), PyBool::new(py, *whole))?,
                Fixed::Directions(names) => dict.set_item(key.as_str(), names)?,
            }
        }
        // a change of the copy would be lost; `fix` and `free` make changes
        Ok(PyMappingProxy::new(py, dict.as_mapping()))
    }

    /// Bounds a coordinate of a variable, which steps do not cross: `graph.bound("scale", "x", min=0.5)`.
    /// Coordinates are those to which steps add, such as those of a point or the focal length of a camera. A limit that
    /// is not given stays as it is.
    #[pyo3(signature = (key, direction, *, min = None, max = None))]
    fn bound(
        &mut self,
        key: &Bound<'_, PyAny>,
        direction: String,
        min: Option<f64>,
        max: Option<f64>,
    ) -> PyResult<()> {
        let key = key_of("bound", key)?;
        let range = min.unwrap_or(f64::NEG_INFINITY)..=max.unwrap_or(f64::INFINITY);
        let interval = Interval::new(range).map_err(|error| errors::argument("bound", "", error))?;
        self.0.change("graph")?.bound(key, direction, interval);
        Ok(())
    }

    /// Removes the bounds of a variable.
    fn unbound(&mut self, key: &Bound<'_, PyAny>) -> PyResult<()> {
        let key = key_of("unbound", key)?;
        self.0.change("graph")?.set_bounds(key, Bounds::default());
        Ok(())
    }

    /// The bounds by key: for each bounded direction `(min, max)`, infinite on a side without a limit.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        let dict = PyDict::new(py);
        for (key, bounds) in self.0.bounds() {
            let of_key = PyDict::new(py);
            for (direction, interval) in bounds.iter() {
                of_key.set_item(direction, (interval.min(), interval.max()))?;
            }
            dict.set_item(key.as_str(), of_key)?;
        }
        Ok(PyMappingProxy::new(py, dict.as_mapping()))
    }

    /// Returns all errors of the graph with these values; empty if it can be solved.
    fn check(slf: &Bound<'_, Self>, values: &Bound<'_, Values>) -> PyResult<Vec<String>> {
        let (graph, values) = (snapshot(slf)?, values.try_borrow()?.0.snapshot());
        detach(slf.py(), || graph.check(&values).iter().map(ToString::to_string).collect())
    }

    /// Returns the cost ½ Σ ρ(‖r‖²) at these values. Factors that are undefined there do not count.
    fn cost(slf: &Bound<'_, Self>, values: &Bound<'_, Values>) -> PyResult<f64> {
        let (graph, values) = (snapshot(slf)?, values.try_borrow()?.0.snapshot());
        let cost = detach(slf.py(), || graph.cost(&values))?;
        cost.map_err(|found| files::misfit(&found))
    }

    /// The factor at an index, from 0. Negative indices count from the end.
    fn __getitem__(&self, at: isize) -> PyResult<FactorEntry> {
        let count = self.0.factors().len();
        let place = if at < 0 { at.checked_add_unsigned(count) } else { Some(at) };
        match place.and_then(|place| self.0.factors().get(usize::try_from(place).ok()?)) {
            Some(entry) => Ok(FactorEntry(entry.clone())),
            None => {
                let message = format!("there is no factor {at}: the graph has {count}, from 0");
                Err(pyo3::exceptions::PyIndexError::new_err(message))
            }
        }
    }

    /// Returns the graph and its values as a document in `toml`, `json` or `yaml`, which `manifactor solve`
    /// reads.
    #[pyo3(signature = (values, format = "toml"))]
    fn to_document(slf: &Bound<'_, Self>, values: &Bound<'_, Values>, format: &str) -> PyResult<String> {
        let values = values.try_borrow()?.0.snapshot();
        document(slf.py(), &*snapshot(slf)?, &values, format)
    }

    fn __len__(&self) -> usize {
        self.0.factors().len()
    }

    /// Returns a graph with the factors, fixed variables and bounds of both.
    fn __add__(&self, other: PyRef<'_, Self>) -> Self {
        let mut sum = self.0.copy();
        // a copy can be changed
        if let Ok(graph) = sum.change("graph") {
            graph.extend(&other.0);
        }
        Self(sum)
    }

    fn __iadd__(slf: &Bound<'_, Self>, other: &Bound<'_, Self>) -> PyResult<()> {
        // both may be one object
        let other = other.borrow().0.snapshot();
        slf.borrow_mut().0.change("graph")?.extend(&other);
        Ok(())
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
        self.0 = unpickled("Graph", state)?;
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        Ok((slf.get_type().into_any(), (), slf.borrow().__getstate__(slf.py())?))
    }

    fn __repr__(&self) -> String {
        let types: Vec<_> = self.types().into_iter().map(|(name, n)| format!("{n} {name}")).collect();
        format!("Graph({} factors: {})", self.0.factors().len(), types.join(", "))
    }

    fn _repr_html_(&self) -> String {
        html(
            &["factor", "number"],
            self.types().into_iter().map(|(name, n)| [name.to_owned(), n.to_string()]),
        )
    }

    /// Returns the number of factors of each type.
    fn types(&self) -> BTreeMap<&'static str, usize> {
        let mut types = BTreeMap::new();
        for entry in self.0.factors() {
            *types.entry(entry.factor.typetag_name()).or_default() += 1;
        }
        types
    }
}

/// Returns the current content of a graph. The borrow ends, so that other threads may change the graph while
/// the core reads it.
fn snapshot(graph: &Bound<'_, Graph>) -> PyResult<Arc<Inner>> {
    Ok(graph.try_borrow()?.0.snapshot())
}

/// A class, its arguments, and a state, from which `pickle` creates an object.
pub(crate) type Reduced<'py> = (Bound<'py, PyAny>, (), Bound<'py, PyBytes>);

/// Returns the content of an object as bytes, without rounding.
pub(crate) fn pickled<'py>(
    py: Python<'py>,
    content: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyBytes>> {
    let bytes = serde_json::to_vec(content).map_err(|error| errors::argument("pickle", "", error))?;
    Ok(PyBytes::new(py, &bytes))
}

pub(crate) fn unpickled<T: serde::de::DeserializeOwned>(what: &str, state: &[u8]) -> PyResult<Shared<T>> {
    let read = serde_json::from_slice::<T>(state);
    read.map(Shared::from).map_err(|error| errors::argument(what, "state", error))
}

/// Checks everything about a factor that needs no values: the number of its keys, and the size of its
/// noise.
fn check(entry: &Entry, at: usize) -> PyResult<()> {
    let mut found = vec![];
    entry.resolve(at, |_| None, &mut found);
    match found.iter().find(|error| !matches!(error, GraphError::MissingVariable { .. })) {
        Some(error) => Err(errors::graph(error)),
        None => distinct(entry, at),
    }
}

/// Checks that a factor names no variable twice.
fn distinct(entry: &Entry, factor: usize) -> PyResult<()> {
    let is_repeated = |(position, key): &(usize, &Key)| entry.keys.iter().take(*position).any(|k| k == *key);
    match entry.keys.iter().enumerate().find(is_repeated) {
        None => Ok(()),
        Some((position, key)) => {
            let (name, key) = (entry.factor.typetag_name(), key.clone());
            Err(errors::graph(GraphError::RepeatedVariable { factor, name, position, key }))
        }
    }
}

/// Returns a table for notebooks.
pub(crate) fn html(header: &[&str], rows: impl IntoIterator<Item = [String; 2]>) -> String {
    let escape = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
    let header: String = header.iter().map(|cell| format!("<th>{}</th>", escape(cell))).collect();
    let row = |cells: [String; 2]| {
        let cells: String = cells.iter().map(|cell| format!("<td>{}</td>", escape(cell))).collect();
        format!("<tr>{cells}</tr>")
    };
    format!("<table><tr>{header}</tr>{}</table>", rows.into_iter().map(row).collect::<String>())
}

/// Factors by row.
enum Factors {
    /// One factor for all rows.
    Same(Arc<dyn Factor>),
    Read {
        name: String,
        columns: Columns,
    },
    /// Factors of a Python function.
    Python(crate::batch::Rows),
}

impl Factors {
    /// Creates the rows from a factor, which is used for all rows, or from the name of a type and fields
    /// whose arrays are columns.
    fn new(factor: &Bound<'_, PyAny>, rows: usize, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let py = factor.py();
        let name = match factor.extract::<String>() {
            Ok(name) => name,
            Err(_) if factor.hasattr("__manifactor_fields__")? => {
                // a factor written in Python computes its fields from its constants
                let given = fields.cloned().unwrap_or_else(|| PyDict::new(py));
                let fields = factor.call_method1("__manifactor_fields__", (given,))?;
                return Self::read("expression".to_owned(), rows, fields.cast()?);
            }
            Err(_) if factor.hasattr("__manifactor_rows__")? => {
                let given = fields.cloned().unwrap_or_else(|| PyDict::new(py));
                let made = factor.call_method1("__manifactor_rows__", (rows, given))?;
                return crate::batch::Rows::new(rows, &made).map(Self::Python);
            }
            Err(_) if factor.is_callable() => factor.getattr("__name__")?.extract()?,
            Err(_) if fields.is_none() => return Ok(Self::Same(self::factor("factor", factor)?)),
            Err(_) => {
                let message =
                    "expected the name of a factor, or the function that makes it, where `fields` are given";
                return Err(errors::argument("add_many", "factor", message));
            }
        };
        match fields {
            Some(fields) => Self::read(name, rows, fields),
            None => Self::read(name, rows, &PyDict::new(py)),
        }
    }

    fn read(name: String, rows: usize, fields: &Bound<'_, PyDict>) -> PyResult<Self> {
        known("factor", &name)?;
        let mut columns = Columns::new(&name, rows, &untagged_fields(&name, fields)?)?;
        if columns.is_constant() && rows > 0 {
            return Ok(Self::Same(read(&name, &mut columns, 0)?));
        }
        Ok(Self::Read { name, columns })
    }

    fn row(&mut self, row: usize) -> PyResult<Arc<dyn Factor>> {
        match self {
            Self::Same(factor) => Ok(factor.clone()),
            Self::Read { name, columns } => read(name, columns, row),
            Self::Python(rows) => Ok(rows.row(row)),
        }
    }
}

fn read(name: &str, columns: &mut Columns, row: usize) -> PyResult<Arc<dyn Factor>> {
    let entry = find("factor", name).ok_or_else(|| errors::internal(name))?;
    let read = entry.read::<dyn Factor>(columns.row(row));
    read.map(Arc::from).map_err(|error| errors::row(name, row, &error, "fields"))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    entry::register(module)?;
    files::register(module)
}
