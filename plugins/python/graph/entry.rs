//! Factors with their keys, noise and loss, and functions for the most common ones.
use super::{Noise, check, noise};
use crate::chosen::{What, factor, factor_of_value, loss, same_factor, variable};
use crate::errors;
use crate::input::{json_to_python, key_of, keys};
use manifactor::geometry::{Between, Point2, Point3, Prior, Se2, Se3, Sim3, So2, So3};
use manifactor::graph::{Factor, FactorEntry as Inner, Key};
use pyo3::prelude::*;
use std::any::Any;
use std::sync::Arc;

/// A factor of a graph: a residual between variables, with its noise and loss.
#[pyclass(module = "manifactor", frozen)]
pub(crate) struct FactorEntry(pub Inner);

/// The noise, loss and name of a factor.
pub(super) struct Options<'a, 'py> {
    pub noise: Option<&'a Bound<'py, PyAny>>,
    pub sigma: Option<&'a Bound<'py, PyAny>>,
    pub sigmas: Option<&'a Bound<'py, PyAny>>,
    pub loss: Option<&'a Bound<'py, PyAny>>,
    pub name: Option<&'a str>,
}

impl Options<'_, '_> {
    pub(super) fn is_empty(&self) -> bool {
        let Self { noise, sigma, sigmas, loss, name } = self;
        [noise, sigma, sigmas, loss].iter().all(|given| given.is_none()) && name.is_none()
    }

    /// Makes the factor with the index `at` of a graph. Everything that needs no values is checked.
    pub(super) fn entry(
        self,
        what: &str,
        at: usize,
        keys: Vec<Key>,
        factor: Arc<dyn Factor>,
    ) -> PyResult<Inner> {
        let Self { noise, sigma, sigmas, loss, name } = self;
        let noise = noise::of_arguments(what, noise, sigma, sigmas)?;
        let loss = loss.map(|loss| self::loss("loss", loss)).transpose()?;
        let entry = Inner { keys, name: name.map(Into::into), factor, noise, loss };
        check(&entry, at)?;
        Ok(entry)
    }
}

#[pymethods]
impl FactorEntry {
    #[new]
    #[pyo3(signature = (keys, factor, *, noise = None, sigma = None, sigmas = None, loss = None, name = None))]
    fn new(
        keys: &Bound<'_, PyAny>,
        factor: &Bound<'_, PyAny>,
        noise: Option<&Bound<'_, PyAny>>,
        sigma: Option<&Bound<'_, PyAny>>,
        sigmas: Option<&Bound<'_, PyAny>>,
        loss: Option<&Bound<'_, PyAny>>,
        name: Option<&str>,
    ) -> PyResult<Self> {
        let keys = self::keys("FactorEntry", keys)?;
        let factor = self::factor("factor", factor)?;
        Options { noise, sigma, sigmas, loss, name }.entry("FactorEntry", 0, keys, factor).map(Self)
    }

    /// The names of its variables, in the order of the residual's arguments.
    #[getter]
    fn keys(&self) -> Vec<&str> {
        self.0.keys.iter().map(Key::as_str).collect()
    }

    /// The residual and its parameters.
    #[getter]
    fn factor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        What::Factor(self.0.factor.clone()).into_python(py)
    }

    /// The noise of the residual.
    #[getter]
    fn noise(&self) -> Noise {
        Noise(self.0.noise.clone())
    }

    /// The robust loss, or `None`.
    #[getter]
    fn loss<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.0.loss.clone().map(|loss| What::Loss(loss).into_python(py)).transpose()
    }

    /// The label in reports.
    #[getter]
    fn name(&self) -> String {
        self.0.label().into_owned()
    }

    /// Returns the factor as in a document: `keys`, `factor`, `noise`, `loss`, `name`.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json_to_python(py, &self.json()?)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        match other.cast::<Self>() {
            Ok(other) => self.equals(other.get()),
            Err(_) => Ok(false),
        }
    }

    fn __hash__(&self) -> isize {
        self.0.keys.len() as isize
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }

    /// For `pickle`: the content, without rounding.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.get_type().getattr("_unpickle")?, (slf.get().json()?.to_string(),)))
    }

    #[staticmethod]
    #[pyo3(name = "_unpickle")]
    fn unpickle(text: &str) -> PyResult<Self> {
        serde_json::from_str(text).map(Self).map_err(|error| errors::argument("pickle", "factor", error))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let (py, this) = (slf.py(), slf.get());
        let mut text = format!("FactorEntry({:?}, {}", this.keys(), this.factor(py)?.repr()?);
        if this.0.noise != manifactor::graph::Noise::unit() {
            text += &format!(", noise={}", this.noise().__repr__()?);
        }
        if let Some(loss) = this.loss(py)? {
            text += &format!(", loss={}", loss.repr()?);
        }
        if let Some(name) = &this.0.name {
            text += &format!(", name={name:?}");
        }
        Ok(text + ")")
    }
}

impl FactorEntry {
    fn equals(&self, other: &Self) -> PyResult<bool> {
        let loss = |entry: &Self| entry.0.loss.as_ref().map(|loss| serde_json::to_value(&**loss)).transpose();
        let (entry, other_entry) = (&self.0, &other.0);
        Ok(entry.keys == other_entry.keys
            && entry.name == other_entry.name
            && entry.noise == other_entry.noise
            && loss(self).map_err(errors::internal)? == loss(other).map_err(errors::internal)?
            && same_factor(&*entry.factor, &*other_entry.factor))
    }

    fn json(&self) -> PyResult<serde_json::Value> {
        serde_json::to_value(&self.0).map_err(|error| errors::argument("FactorEntry", "", error))
    }
}

/// Makes a factor of the type `<family>_<type of the value>`, whose field is the value. Types of the geometry are made
/// directly; `typed` makes them, and is `None` for all others, which are read like a document.
fn of_value(
    family: &str,
    field: &str,
    value: &Bound<'_, PyAny>,
    typed: fn(&dyn Any) -> Option<Arc<dyn Factor>>,
) -> PyResult<Arc<dyn Factor>> {
    let value = variable(field, value)?;
    if let Some(factor) = typed(value.erased().as_any()).filter(|_| value.erased().is_finite()) {
        return Ok(factor);
    }
    factor_of_value(&format!("{family}_{}", value.typetag_name()), field, &value)
}

/// Makes the factor of a value, if its type is one of these.
macro_rules! typed {
    ($factor:ident, $field:ident: $($type:ty),+) => {
        |value| {
            $(if let Some(value) = value.downcast_ref::<$type>() {
                return Some(Arc::new($factor { $field: value.clone() }));
            })+
            None
        }
    };
}

/// The second variable is at `relative`, seen from the first.
#[pyfunction]
#[pyo3(signature = (first, second, relative, *, noise = None, sigma = None, sigmas = None, loss = None, name = None))]
#[expect(clippy::too_many_arguments, reason = "the keyword arguments of Python")]
fn between(
    first: &Bound<'_, PyAny>,
    second: &Bound<'_, PyAny>,
    relative: &Bound<'_, PyAny>,
    noise: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
    sigmas: Option<&Bound<'_, PyAny>>,
    loss: Option<&Bound<'_, PyAny>>,
    name: Option<&str>,
) -> PyResult<FactorEntry> {
    let keys = vec![key_of("between", first)?, key_of("between", second)?];
    let factor = of_value(
        "between",
        "relative",
        relative,
        typed!(Between, relative: Se2, Se3, Point2, Point3, So2, So3, Sim3),
    )?;
    Options { noise, sigma, sigmas, loss, name }.entry("between", 0, keys, factor).map(FactorEntry)
}

/// The variable is at `value`.
#[pyfunction]
#[pyo3(signature = (key, value, *, noise = None, sigma = None, sigmas = None, loss = None, name = None))]
fn prior(
    key: &Bound<'_, PyAny>,
    value: &Bound<'_, PyAny>,
    noise: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
    sigmas: Option<&Bound<'_, PyAny>>,
    loss: Option<&Bound<'_, PyAny>>,
    name: Option<&str>,
) -> PyResult<FactorEntry> {
    let factor =
        of_value("prior", "value", value, typed!(Prior, value: Se2, Se3, Point2, Point3, So2, So3, Sim3))?;
    let keys = vec![key_of("prior", key)?];
    Options { noise, sigma, sigmas, loss, name }.entry("prior", 0, keys, factor).map(FactorEntry)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<FactorEntry>()?;
    module.add_function(wrap_pyfunction!(between, module)?)?;
    module.add_function(wrap_pyfunction!(prior, module)?)
}
