//! A graph that grows while it is solved.
mod functions;

use crate::chosen::{What, solver};
use crate::errors;
use crate::graph::{Graph, Shared, Values};
use crate::input::{key_of, keys, node, to_array, to_python, unordered_keys};
use crate::solution::Watch;
use crate::threads::detach;
use functions::Functions;
use manifactor::config::Errors;
use manifactor::graph::Key;
use manifactor::smoother::{FactorId as InnerId, Smoother as Inner, SmootherSettings};
use manifactor::solve::{Auto, Optimizer};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// The id of a factor in a smoother.
#[pyclass(module = "manifactor", frozen, eq, hash)]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct FactorId(InnerId);

#[pymethods]
impl FactorId {
    fn __copy__(&self) -> Self {
        *self
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        *self
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (u32,))> {
        Ok((slf.get_type().getattr("_unpickle")?, (slf.get().0.number(),)))
    }

    #[staticmethod]
    #[pyo3(name = "_unpickle")]
    fn unpickle(number: u32) -> Self {
        Self(InnerId::of_number(number))
    }

    fn __repr__(&self) -> String {
        format!("FactorId({})", self.0)
    }
}

/// An incremental smoother: variables and factors are added and removed, and `update` recomputes the
/// estimate.
#[pyclass(module = "manifactor")]
pub(crate) struct Smoother {
    inner: Inner,
    functions: Functions,
}

#[pymethods]
impl Smoother {
    /// Creates an empty smoother. `settings` are the fields of the table `online` of a document:
    /// `relinearize_every`, `relinearization_threshold`, `window`, …
    #[new]
    #[pyo3(signature = (**settings))]
    fn new(settings: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let settings = match settings {
            Some(settings) => {
                let (node, errors) = (node("Smoother", "", settings.as_any())?, Errors::new());
                let read = node.read::<SmootherSettings>(&errors);
                errors.finish(read).map_err(|diagnostics| errors::read("Smoother", &diagnostics))?
            }
            None => SmootherSettings::default(),
        };
        Ok(Self { inner: Inner::new(settings), functions: Functions::default() })
    }

    /// Adds variables with their initial values, and factors between new or existing variables; variables
    /// that the graph fixes are fixed. Takes effect at the next update. Returns the ids of the factors, in
    /// order. After an error, nothing is added.
    fn push(
        &mut self,
        py: Python<'_>,
        graph: &Bound<'_, Graph>,
        values: &Bound<'_, Values>,
    ) -> PyResult<Vec<FactorId>> {
        let Self { inner, functions } = self;
        let (graph, values) = (graph.try_borrow()?.0.snapshot(), values.try_borrow()?.0.snapshot());
        let ids = detach(py, || {
            let ids = inner.push(&graph, &values).map_err(|error| error.to_string())?;
            functions.add(&graph, &ids);
            Ok(ids)
        })?;
        Ok(ids.map_err(|error: String| errors::graph(error))?.into_iter().map(FactorId).collect())
    }

    /// Removes factors at the next update.
    fn remove(&mut self, factors: Vec<Py<FactorId>>) -> PyResult<()> {
        let ids: Vec<InnerId> = factors.iter().map(|id| id.get().0).collect();
        self.inner.remove(&ids).map_err(errors::graph)
    }

    /// Marginalizes variables at the next update: their information stays as a linear prior.
    fn marginalize(&mut self, keys: &Bound<'_, PyAny>) -> PyResult<()> {
        let keys = unordered_keys("marginalize", keys)?;
        self.inner.marginalize(&keys).map_err(errors::graph)
    }

    /// Sets the time of the next factors and variables, for a window by time. Unit: seconds.
    fn set_time(&mut self, seconds: f64) -> PyResult<()> {
        self.inner.set_time(seconds).map_err(errors::graph)
    }

    /// Applies the changes, and updates the estimate. Returns a report: `redone`, `relinearized`, `parked`,
    /// `undetermined` and so on. After an error, the smoother is unchanged. If a Python function raises an
    /// exception only at a new point of an old factor, the factor keeps its last linearization, and the
    /// changes are applied.
    fn update<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Self { inner, functions } = self;
        // the exceptions of the test are raised before anything changes
        detach(py, || functions.test(inner))?;
        let report = detach(py, || inner.update().map_err(|error| error.to_string()))?;
        to_python(py, &report.map_err(errors::solve)?)
    }

    /// The estimate of a variable after the last update.
    fn __getitem__<'py>(&self, py: Python<'py>, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let key = key_of("Smoother", key)?;
        match self.inner.estimate(key.as_str()) {
            Some(value) => What::Variable(value.into()).into_python(py),
            None => Err(pyo3::exceptions::PyKeyError::new_err(format!("there is no variable `{key}`"))),
        }
    }

    fn __contains__(&self, key: &Bound<'_, PyAny>) -> bool {
        key_of("Smoother", key).is_ok_and(|key| self.inner.estimate(key.as_str()).is_some())
    }

    fn __len__(&self) -> usize {
        self.inner.variables()
    }

    /// All estimates, in the order of insertion.
    #[getter]
    fn values(&self, py: Python<'_>) -> PyResult<Values> {
        Ok(Values(Shared::of("smoother", detach(py, || self.inner.estimates())?)))
    }

    /// Returns ½ Σ ρ at the estimate. The time is linear in the number of factors.
    fn cost(&mut self, py: Python<'_>) -> PyResult<f64> {
        let inner = &mut self.inner;
        detach(py, || inner.cost())
    }

    /// Returns the joint covariance of a few variables, in the order of `keys` and of their tangent
    /// directions.
    fn covariance<'py>(
        &self,
        py: Python<'py>,
        keys: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let keys = self::keys("covariance", keys)?;
        let names: Vec<&str> = keys.iter().map(Key::as_str).collect();
        let joint = detach(py, || self.inner.covariance(&names).map_err(|error| error.to_string()))?;
        let joint = joint.map_err(errors::solve)?;
        to_array(py, &[joint.nrows(), joint.ncols()], joint.as_slice().to_vec())
    }

    /// Returns the factors rejected as outliers, each with its cost and the update that rejected it.
    fn rejections<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = &mut self.inner;
        to_python(py, &detach(py, || inner.rejections())?)
    }

    /// Returns the active factors as a graph, with its fixed variables. The linear priors that marginalized variables leave
    /// are not in it, so a solve of it can differ from the estimate; `finish` includes them.
    fn graph(&self) -> Graph {
        Graph(self.inner.graph().0.into())
    }

    /// Solves the whole graph as one batch from the estimate, and returns the values and the report of the
    /// solver. The smoother does not change.
    #[pyo3(signature = (solver = None))]
    fn finish<'py>(
        &self,
        py: Python<'py>,
        solver: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Values, Bound<'py, PyAny>)> {
        let solver: Arc<dyn Optimizer> =
            solver.map_or_else(|| Ok(Arc::new(Auto::default()) as _), |s| self::solver("solver", s))?;
        let mut watch = Watch::new(None);
        let finished =
            detach(py, || self.inner.finish(&*solver, &mut watch).map_err(|error| error.to_string()))?;
        watch.finish()?;
        let finished = finished.map_err(errors::graph)?;
        Ok((Values(finished.values.into()), to_python(py, &finished.outcome)?))
    }

    /// Returns the smoother as a text. `Smoother.load` restores it bit for bit.
    fn save(&self, py: Python<'_>) -> PyResult<String> {
        detach(py, || self.inner.save().map_err(|error| error.to_string()))?.map_err(errors::solve)
    }

    /// Restores a saved smoother.
    #[staticmethod]
    fn load(py: Python<'_>, text: &str) -> PyResult<Self> {
        let loaded = detach(py, || Inner::load(text).map_err(|error| error.to_string()))?;
        let inner = loaded.map_err(|error| errors::argument("Smoother.load", "text", error))?;
        // a saved smoother has no factors of Python functions
        Ok(Self { inner, functions: Functions::default() })
    }

    /// Logs the smoother in the rerun viewer, or to a `.rrd` file, update by update. Call `push` and
    /// `update` of the returned object instead of the smoother's.
    #[pyo3(signature = (path = None, *, name = "session", every = 1))]
    fn to_rerun<'py>(
        slf: &Bound<'py, Self>,
        path: Option<&Bound<'py, PyAny>>,
        name: &str,
        every: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("manifactor.rerun")?.call_method1("Live", (slf, path, name, every))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.get_type().getattr("load")?, (slf.borrow().save(slf.py())?,)))
    }

    fn __repr__(&self) -> String {
        format!("{:?}", self.inner)
    }
}
