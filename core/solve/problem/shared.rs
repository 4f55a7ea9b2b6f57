//! The solved problem, for queries about its estimate without a second compilation.
use crate::Solution;
use crate::linear::Method;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::Graph;
use std::sync::{Arc, Mutex};

/// A compiled problem that handles one query at a time.
#[derive(Debug, Clone)]
pub(crate) struct SharedProblem(Arc<Mutex<Problem>>);

impl SharedProblem {
    pub(crate) fn new(problem: Problem) -> Self {
        Self(Arc::new(Mutex::new(problem)))
    }
}

impl Solution {
    /// Runs a query on the solved problem, at the estimate and with the final weights of the solver.
    /// Compiles a new problem if the solved one has no factorization (conjugate gradients), is busy, or
    /// `graph` has changed since.
    ///
    /// # Errors
    /// If `graph` is not the solved graph.
    pub(crate) fn query<R>(
        &self,
        graph: &Graph,
        question: impl FnOnce(&mut Problem) -> R,
    ) -> Result<R, CompileError> {
        if let Ok(mut problem) = self.problem.0.try_lock()
            && !matches!(problem.system.method, Method::ConjugateGradients(_))
            && problem.version == graph.version()
        {
            // only if necessary, because the factorization of an earlier query would be lost
            if !problem.model.is_at(&self.values) {
                problem.model.set_values(&self.values);
            }
            return Ok(question(&mut problem));
        }
        Ok(question(&mut self.problem(graph)?))
    }

    /// Compiles the problem again, at the estimate and with the final weights of the solver.
    ///
    /// # Errors
    /// If `graph` is not the solved graph.
    pub fn problem(&self, graph: &Graph) -> Result<Problem, CompileError> {
        let mut problem = Problem::compile(graph, &self.values)?;
        problem.set_constraints(&self.constraints);
        if !self.weights.is_empty() {
            problem.model.set_weights(&self.weights);
        }
        Ok(problem)
    }
}
