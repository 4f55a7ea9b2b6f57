//! Solving a graph, and what a solution can be asked.
use crate::chosen::{solver, start};
use crate::errors;
use crate::graph::{Graph, Values, html, optional_keys};
use crate::input::{json_to_python, to_array, to_python};
use manifactor::graph::Key;
use manifactor::solve::{
    Auto, Given, IterationRecord, Observer, Optimizer, Solution as Inner, Start, solve as solve_inner,
};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Looks for Ctrl-C, and shows steps to a function of Python, which may end the solve.
pub(crate) struct Watch {
    observer: Option<Py<PyAny>>,
    /// What a signal's handler or the function has raised.
    raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(observer: Option<&Bound<'_, PyAny>>) -> Self {
        Self { observer: observer.map(|observer| observer.clone().unbind()), raised: None }
    }

    /// Raises what ended the solve, if something of Python's did.
    pub(crate) fn finish(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)?;
        crate::raised::raise()
    }

    fn flow(&mut self, looked: PyResult<bool>) -> ControlFlow<()> {
        match looked {
            Ok(true) if !crate::raised::has_raised() => ControlFlow::Continue(()),
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
        let looked = Python::attach(|py| {
            py.check_signals()?;
            let Some(observer) = &self.observer else { return Ok(true) };
            let goes_on = observer.bind(py).call1((to_python(py, record)?,))?;
            // a function that returns nothing has nothing against it
            Ok(goes_on.is_none() || goes_on.is_truthy()?)
        });
        self.flow(looked)
    }

    fn poll(&mut self) -> ControlFlow<()> {
        let looked = Python::attach(|py| py.check_signals().map(|()| true));
        self.flow(looked)
    }
}

/// An estimate, and how it came about.
#[pyclass(module = "manifactor", frozen)]
pub(crate) struct Solution {
    inner: Inner,
    graph: Py<Graph>,
    values: Py<Values>,
}

/// Solves a graph from these values. Returns a solution however the solve ends: `solution.converged` tells.
///
/// `solver` defaults to `auto`, `start` to the values as they are. `observer` is called with a dict after each step that was
/// tried, and ends the solve where it returns `False`. Other threads of Python run meanwhile, and Ctrl-C interrupts.
#[pyfunction]
#[pyo3(signature = (graph, values, solver = None, *, start = None, observer = None))]
fn solve(
    py: Python<'_>,
    graph: Py<Graph>,
    values: Py<Values>,
    solver: Option<&Bound<'_, PyAny>>,
    start: Option<&Bound<'_, PyAny>>,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Solution> {
    let solver: Arc<dyn Optimizer> =
        solver.map_or_else(|| Ok(Arc::new(Auto::default()) as _), |s| self::solver("solver", s))?;
    let start: Arc<dyn Start> =
        start.map_or_else(|| Ok(Arc::new(Given::default()) as _), |s| self::start("start", s))?;
    let mut watch = Watch::new(observer);
    let solved = {
        let (graph, values) = (graph.borrow(py), values.borrow(py));
        let (graph, values) = (&graph.0, &values.0);
        py.detach(|| {
            let values = start.start(graph, values).map_err(|error| error.to_string())?;
            solve_inner(graph, &values, &*solver, &mut watch).map_err(|error| error.to_string())
        })
    };
    watch.finish()?;
    let inner = solved.map_err(errors::graph)?;
    let values = Py::new(py, Values(inner.values.clone()))?;
    Ok(Solution { inner, graph, values })
}

#[pymethods]
impl Solution {
    /// The estimate: the best values found, however the solve ended.
    #[getter]
    fn values(&self, py: Python<'_>) -> Py<Values> {
        self.values.clone_ref(py)
    }

    /// The graph that was solved.
    #[getter]
    fn graph(&self, py: Python<'_>) -> Py<Graph> {
        self.graph.clone_ref(py)
    }

    /// Whether the values are a minimum, to a tolerance.
    #[getter]
    fn converged(&self) -> bool {
        self.inner.outcome.termination.is_converged()
    }

    /// How the solve ended, in words.
    #[getter]
    fn termination(&self) -> String {
        self.inner.outcome.termination.to_string()
    }

    /// ½ Σ ρ(‖r‖²) at the estimate.
    #[getter]
    fn cost(&self) -> f64 {
        self.inner.outcome.final_cost
    }

    /// The same at the values that the solve began with.
    #[getter]
    fn initial_cost(&self) -> f64 {
        self.inner.outcome.initial_cost
    }

    /// Linearizations that were followed by a step.
    #[getter]
    fn iterations(&self) -> usize {
        self.inner.outcome.iterations
    }

    /// Seconds by stage.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner.outcome.times)
    }

    /// All that the solver has to tell, as a dict: `termination`, `undetermined`, `rejected`, `history` and so on.
    #[getter]
    fn outcome<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.inner.outcome)
    }

    /// What each factor costs at the estimate, in the order of the graph, shape (factors,).
    #[getter]
    fn costs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        to_array(py, &[self.inner.factors.len()], self.inner.factors.iter().map(|f| f.cost).collect())
    }

    /// How much each factor counts, by its loss, shape (factors,); 1 without a loss.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        to_array(py, &[self.inner.factors.len()], self.inner.factors.iter().map(|f| f.weight).collect())
    }

    /// The residual of a factor at the estimate, not whitened, shape (rows,).
    fn residual<'py>(&self, py: Python<'py>, factor: usize) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        match self.inner.factors.get(factor) {
            Some(state) => to_array(py, &[state.residual.len()], state.residual.clone()),
            None => Err(pyo3::exceptions::PyIndexError::new_err(format!("there is no factor {factor}"))),
        }
    }

    /// Marginal covariances at the estimate, by key: of the variables that are named, or of all. Rows and columns are the
    /// tangent directions of the variable, in their order and units.
    #[pyo3(signature = (keys = None))]
    fn covariances<'py>(
        &self,
        py: Python<'py>,
        keys: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let keys = optional_keys("covariances", keys)?;
        let marginals = {
            let graph = self.graph.borrow(py);
            let (graph, names): (_, Vec<&str>) = (&graph.0, keys.iter().map(Key::as_str).collect());
            py.detach(|| self.inner.marginals(graph, &names).map_err(|error| error.to_string()))
        };
        let dict = PyDict::new(py);
        for marginal in marginals.map_err(errors::solve)? {
            let n = marginal.covariance.nrows();
            dict.set_item(
                marginal.key.as_str(),
                to_array(py, &[n, n], marginal.covariance.as_slice().to_vec())?,
            )?;
        }
        Ok(dict)
    }

    /// The joint covariance of a few variables at the estimate, in the order of `keys` and of their tangent directions.
    fn joint_covariance<'py>(
        &self,
        py: Python<'py>,
        keys: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let keys = crate::input::keys("joint_covariance", keys)?;
        let joint = {
            let graph = self.graph.borrow(py);
            let (graph, names): (_, Vec<&str>) = (&graph.0, keys.iter().map(Key::as_str).collect());
            py.detach(|| {
                let mut problem = self.inner.problem(graph).map_err(|error| error.to_string())?;
                problem.joint_covariance(&names).map_err(|error| error.to_string())
            })
        };
        let joint = joint.map_err(errors::solve)?;
        to_array(py, &[joint.nrows(), joint.ncols()], joint.as_slice().to_vec())
    }

    /// What is worth a look: the factors that cost the most, the condition of the linear system, what nothing constrains.
    fn diagnosis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let diagnosis = {
            let graph = self.graph.borrow(py);
            let graph = &graph.0;
            py.detach(|| self.inner.diagnose(graph).map_err(|error| error.to_string()))
        };
        let json = serde_json::to_value(diagnosis.map_err(errors::solve)?).map_err(errors::internal)?;
        json_to_python(py, &json)
    }

    fn _repr_html_(&self) -> String {
        let outcome = &self.inner.outcome;
        let rows = [
            ["ended".to_owned(), outcome.termination.to_string()],
            ["cost".to_owned(), format!("{:.6e} to {:.6e}", outcome.initial_cost, outcome.final_cost)],
            ["iterations".to_owned(), outcome.iterations.to_string()],
            ["factors".to_owned(), outcome.factors.to_string()],
            ["seconds".to_owned(), format!("{:.3}", outcome.times.total)],
        ];
        html(&["solve", ""], rows)
    }

    fn __repr__(&self) -> String {
        let outcome = &self.inner.outcome;
        let (first, last, steps) = (outcome.initial_cost, outcome.final_cost, outcome.iterations);
        format!("Solution({}; cost {first:.6e} to {last:.6e} in {steps} iterations)", outcome.termination)
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(solve, module)?)
}
