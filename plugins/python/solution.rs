//! Solving a graph, and the queries of a solution.
mod account;

use crate::chosen::{solver, start};
use crate::errors;
use crate::graph::{Graph, Shared, Values, html};
use crate::input::{frozen, json_to_python, to_array, to_python};
use crate::threads::detach;
use account::{Account, State, parsed, restored};
use manifactor::graph::{Graph as InnerGraph, Key, Values as InnerValues};
use manifactor::solve::{
    Auto, GivenStart, IterationRecord, Observer, Optimizer, Solution as Inner, Start, solve as solve_inner,
};
use manifactor::viz::graph_page;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use serde::Serialize;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Polls Ctrl-C, and reports steps to a Python function, which may end the solve.
pub(crate) struct Watch {
    observer: Option<Py<PyAny>>,
    /// Exception of a signal handler or of the function.
    raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(observer: Option<&Bound<'_, PyAny>>) -> Self {
        Self { observer: observer.map(|observer| observer.clone().unbind()), raised: None }
    }

    /// Raises the exception that ended the solve, if there is one.
    pub(crate) fn finish(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)
    }

    /// Calls the function with a value as Python objects. It ends the work by returning `False`.
    pub(crate) fn call(&mut self, value: &impl Serialize) -> ControlFlow<()> {
        let looked = Python::attach(|py| {
            py.check_signals()?;
            let Some(observer) = &self.observer else { return Ok(true) };
            let goes_on = observer.bind(py).call1((to_python(py, value)?,))?;
            // a function that returns None does not end the work
            Ok(goes_on.is_none() || goes_on.is_truthy()?)
        });
        self.flow(looked)
    }

    fn flow(&mut self, looked: PyResult<bool>) -> ControlFlow<()> {
        match looked {
            Ok(true) if self.raised.is_none() && !crate::raised::has_raised() => ControlFlow::Continue(()),
            Ok(_) => ControlFlow::Break(()),
            Err(error) => {
                self.raised = Some(error);
                ControlFlow::Break(())
            }
        }
    }
}

impl Observer for Watch {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self.call(record)
    }

    fn poll(&mut self) -> ControlFlow<()> {
        let looked = Python::attach(|py| py.check_signals().map(|()| true));
        self.flow(looked)
    }
}

/// An estimate and the report of its solve.
#[pyclass(module = "manifactor", frozen)]
pub(crate) struct Solution {
    inner: Inner,
    /// The graph as it was solved; later changes of the program's graph do not affect it.
    graph: Arc<InnerGraph>,
    values: Arc<InnerValues>,
    /// The values from which the solver started.
    start: Arc<InnerValues>,
    /// Report of the solver. In an unpickled solution, the report in `inner` is different.
    account: Account,
}

/// Solves a graph from these values. Always returns a solution; `solution.converged` is true if the solve
/// reached a minimum.
///
/// `solver` defaults to `auto`, and `start` to the given values. `observer` is called with a dict after
/// each attempted step, and ends the solve by returning `False`. Other Python threads run meanwhile, and
/// Ctrl-C interrupts the solve.
#[pyfunction]
#[pyo3(signature = (graph, values, solver = None, *, start = None, observer = None))]
fn solve(
    py: Python<'_>,
    graph: &Bound<'_, Graph>,
    values: &Bound<'_, Values>,
    solver: Option<&Bound<'_, PyAny>>,
    start: Option<&Bound<'_, PyAny>>,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Solution> {
    let solver: Arc<dyn Optimizer> =
        solver.map_or_else(|| Ok(Arc::new(Auto::default()) as _), |s| self::solver("solver", s))?;
    let start: Arc<dyn Start> =
        start.map_or_else(|| Ok(Arc::new(GivenStart::default()) as _), |s| self::start("start", s))?;
    let mut watch = Watch::new(observer);
    // other threads and the observer may change both meanwhile
    let (graph, values) = (graph.try_borrow()?.0.snapshot(), values.try_borrow()?.0.snapshot());
    let solved = detach(py, || {
        let values = start.initial_values(&graph, &values).map_err(|error| error.to_string())?;
        let inner = solve_inner(&graph, &values, &*solver, &mut watch).map_err(|error| error.to_string())?;
        Ok::<_, String>((values, inner))
    })?;
    watch.finish()?;
    let (start, inner) = solved.map_err(errors::graph)?;
    let (start, values) = (Arc::new(start), Arc::new(inner.values.clone()));
    let account = Account::new(&inner.outcome)?;
    Ok(Solution { inner, graph, values, start, account })
}

#[pymethods]
impl Solution {
    /// The best values found, independent of the termination.
    #[getter]
    fn values(&self) -> Values {
        Values(Shared::of("solution", self.values.clone()))
    }

    /// The graph that was solved, without later changes.
    #[getter]
    fn graph(&self) -> Graph {
        Graph(Shared::of("solution", self.graph.clone()))
    }

    /// The values from which the solver started.
    #[getter]
    fn initial_values(&self) -> Values {
        Values(Shared::of("solution", self.start.clone()))
    }

    /// Returns a page with the graph in 3D, before and after the solve, its costs by type of factor, and the factors with
    /// the largest costs. A notebook shows it; `save_html` of the page writes it to a file.
    #[pyo3(signature = (title = "graph"))]
    fn plot<'py>(&self, py: Python<'py>, title: &str) -> PyResult<Bound<'py, PyAny>> {
        let summary = self.account.summary();
        let html = detach(py, || graph_page(title, &self.graph, &self.start, &self.inner, &summary))?;
        py.import("manifactor.report")?.getattr("Page")?.call1((html,))
    }

    /// True if the values are a minimum within the tolerances.
    #[getter]
    fn converged(&self) -> bool {
        self.account.converged
    }

    /// The termination in words.
    #[getter]
    fn termination(&self) -> String {
        self.account.termination.clone()
    }

    /// ½ Σ ρ(‖r‖²) at the estimate.
    #[getter]
    fn cost(&self) -> f64 {
        self.account.final_cost
    }

    /// ½ Σ ρ(‖r‖²) at the initial values.
    #[getter]
    fn initial_cost(&self) -> f64 {
        self.account.initial_cost
    }

    /// Number of linearizations that were followed by a step.
    #[getter]
    fn iterations(&self) -> usize {
        self.account.iterations
    }

    /// Seconds by stage.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json_to_python(py, &parsed(&self.account.times)?)
    }

    /// The full report of the solver as a dict: `termination`, `undetermined`, `rejected`, `history` and so
    /// on.
    #[getter]
    fn outcome<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json_to_python(py, &parsed(&self.account.outcome)?)
    }

    /// Cost of each factor at the estimate, in the order of the graph, shape (factors,).
    #[getter]
    fn costs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let costs = self.inner.factors.iter().map(|f| f.cost).collect();
        frozen(to_array(py, &[self.inner.factors.len()], costs)?)
    }

    /// Weight of each factor from its loss, shape (factors,); 1 without a loss.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let weights = self.inner.factors.iter().map(|f| f.weight).collect();
        frozen(to_array(py, &[self.inner.factors.len()], weights)?)
    }

    /// Returns the residual of a factor at the estimate, not whitened, shape (rows,).
    fn residual<'py>(&self, py: Python<'py>, factor: usize) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        match self.inner.factors.get(factor) {
            Some(state) => to_array(py, &[state.residual.len()], state.residual.clone()),
            None => Err(pyo3::exceptions::PyIndexError::new_err(format!("there is no factor {factor}"))),
        }
    }

    /// Returns marginal covariances at the estimate by key, of the given variables or of all. Rows and
    /// columns are the tangent directions of the variable, in their order and units.
    #[pyo3(signature = (keys = None))]
    fn covariances<'py>(
        &self,
        py: Python<'py>,
        keys: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let keys = keys.map(|keys| crate::input::unordered_keys("covariances", keys)).transpose()?;
        if keys.as_ref().is_some_and(Vec::is_empty) {
            return Ok(dict);
        }
        // the core returns all marginals if there are no names
        let names: Vec<&str> = keys.iter().flatten().map(Key::as_str).collect();
        let marginals =
            detach(py, || self.inner.marginals(&self.graph, &names).map_err(|error| error.to_string()))?;
        for marginal in marginals.map_err(errors::solve)? {
            let n = marginal.covariance.nrows();
            dict.set_item(
                marginal.key.as_str(),
                to_array(py, &[n, n], marginal.covariance.as_slice().to_vec())?,
            )?;
        }
        Ok(dict)
    }

    /// Returns the joint covariance of a few variables at the estimate, in the order of `keys` and of their
    /// tangent directions.
    fn joint_covariance<'py>(
        &self,
        py: Python<'py>,
        keys: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let keys = crate::input::keys("joint_covariance", keys)?;
        let names: Vec<&str> = keys.iter().map(Key::as_str).collect();
        let joint = detach(py, || {
            let mut problem = self.inner.problem(&self.graph).map_err(|error| error.to_string())?;
            problem.joint_covariance(&names).map_err(|error| error.to_string())
        })?;
        let joint = joint.map_err(errors::solve)?;
        to_array(py, &[joint.nrows(), joint.ncols()], joint.as_slice().to_vec())
    }

    /// Returns the factors with the largest cost, the condition of the linear system, and the unconstrained
    /// directions.
    fn diagnosis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let diagnosis = detach(py, || self.inner.diagnose(&self.graph).map_err(|error| error.to_string()))?;
        let json = serde_json::to_value(diagnosis.map_err(errors::solve)?).map_err(errors::internal)?;
        json_to_python(py, &json)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }

    /// For `pickle`: the graph, the values, the report, and the states and weights of the factors.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (own, py) = (slf.get(), slf.py());
        let states: Vec<State> = own.inner.factors.iter().cloned().map(Into::into).collect();
        let account = own.account.clone();
        let values = (own.values(), own.initial_values());
        let content = (own.graph(), values, account, states, own.inner.weights.clone());
        Ok((slf.get_type().getattr("_unpickle")?, content.into_pyobject(py)?))
    }

    #[staticmethod]
    #[pyo3(name = "_unpickle")]
    fn unpickle(
        py: Python<'_>,
        graph: PyRef<'_, Graph>,
        values: (PyRef<'_, Values>, PyRef<'_, Values>),
        account: Account,
        states: Vec<State>,
        weights: Vec<f64>,
    ) -> PyResult<Self> {
        let (values, start) = values;
        let (mut graph, values, start) = (graph.0.snapshot(), values.0.snapshot(), start.0.snapshot());
        let inner = detach(py, || restored(&graph, &values, states, weights))?.map_err(errors::graph)?;
        if !inner.weights.is_empty() {
            // the problem of `inner` lacks the weights; a graph of another version makes it compile again
            // with them
            Arc::make_mut(&mut graph).factors_mut();
        }
        Ok(Self { inner, graph, values, start, account })
    }

    fn _repr_html_(&self) -> String {
        let account = &self.account;
        let seconds = parsed(&account.times).ok().and_then(|times| times.get("total")?.as_f64());
        let rows = [
            ["ended".to_owned(), account.termination.clone()],
            ["cost".to_owned(), format!("{:.6e} to {:.6e}", account.initial_cost, account.final_cost)],
            ["iterations".to_owned(), account.iterations.to_string()],
            ["factors".to_owned(), self.inner.factors.len().to_string()],
            ["seconds".to_owned(), format!("{:.3}", seconds.unwrap_or(f64::NAN))],
        ];
        html(&["solve", ""], rows)
    }

    fn __repr__(&self) -> String {
        let Account { termination, initial_cost, final_cost, iterations, .. } = &self.account;
        format!(
            "Solution({termination}; cost {initial_cost:.6e} to {final_cost:.6e} in {iterations} iterations)"
        )
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(solve, module)?)
}
