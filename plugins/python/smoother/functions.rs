//! Tests of Python functions before an update.
//!
//! The core undoes an update if a new factor fails, but not if the function of an old factor does.
use crate::batch::function_address;
use manifactor::graph::{FactorEntry, Graph, Variable};
use manifactor::smoother::{FactorId, Smoother};

/// The Python functions of a smoother, each with one of its factors.
#[derive(Default)]
pub(super) struct Functions(Vec<(usize, FactorId)>);

impl Functions {
    /// Adds the functions of factors that were pushed.
    pub(super) fn add(&mut self, graph: &Graph, ids: &[FactorId]) {
        for (entry, id) in graph.factors().iter().zip(ids) {
            if let Some(function) = function_address(&*entry.factor)
                && self.0.iter().all(|(known, _)| *known != function)
            {
                self.0.push((function, *id));
            }
        }
    }

    /// Evaluates a factor of each function at the estimate. Functions without factors are removed.
    pub(super) fn test(&mut self, smoother: &Smoother) {
        self.0.retain_mut(|(function, id)| {
            if smoother.entry(*id).is_none() {
                let (graph, ids) = smoother.graph();
                let other = |(entry, _): &(&FactorEntry, &FactorId)| {
                    function_address(&*entry.factor) == Some(*function)
                };
                match graph.factors().iter().zip(&ids).rev().find(other) {
                    Some((_, other)) => *id = *other,
                    None => return false,
                }
            }
            if let Some(entry) = smoother.entry(*id) {
                evaluate(entry, smoother);
            }
            true
        });
    }
}

/// Evaluates a factor at the estimate; a factor of new variables has none.
fn evaluate(entry: &FactorEntry, smoother: &Smoother) {
    let estimates = entry.keys.iter().map(|key| smoother.estimate(key.as_str()));
    if let Some(estimates) = estimates.collect::<Option<Vec<_>>>() {
        let estimates: Vec<&dyn Variable> = estimates.iter().map(|x| &**x).collect();
        entry.factor.erased().residual(&estimates);
    }
}
