//! The problem that was solved, kept for questions about its estimate: they need no second compilation.
use crate::Solution;
use crate::linear::Method;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::Graph;
use std::sync::{Arc, Mutex};

/// A compiled problem that is asked by one at a time.
#[derive(Debug, Clone)]
pub(crate) struct Kept(Arc<Mutex<Problem>>);

impl Kept {
    pub(crate) fn new(problem: Problem) -> Self {
        Self(Arc::new(Mutex::new(problem)))
    }
}

impl Solution {
    /// Asks the problem that was solved, at the estimate and with the weights that the solver has left; a new one where
    /// that has no factorization of its own, is busy, or `graph` has been changed since.
    ///
    /// # Errors
    /// If `graph` is not the one that was solved.
    pub(crate) fn ask<R>(
        &self,
        graph: &Graph,
        question: impl FnOnce(&mut Problem) -> R,
    ) -> Result<R, CompileError> {
        if let Ok(mut problem) = self.problem.0.try_lock()
            && !matches!(problem.system.method, Method::ConjugateGradients(_))
            && problem.version == graph.version()
        {
            // not at once: what an earlier question has factorized would be lost
            if !problem.model.is_at(&self.values) {
                problem.model.put(&self.values);
            }
            return Ok(question(&mut problem));
        }
        Ok(question(&mut self.problem(graph)?))
    }

    /// The problem at the estimate, compiled anew, with the weights that the solver has left.
    ///
    /// # Errors
    /// If `graph` is not the one that was solved.
    pub fn problem(&self, graph: &Graph) -> Result<Problem, CompileError> {
        let mut problem = Problem::compile(graph, &self.values)?;
        if !self.weights.is_empty() {
            problem.model.weigh(&self.weights);
        }
        Ok(problem)
    }
}
