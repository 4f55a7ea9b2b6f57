//! Batch solution of the whole graph.
mod prior;

use super::Smoother;
use super::changes::Touched;
use super::undetermined::Moves;
use crate::factor_id::FactorId;
use crate::model::Overflow;
use crate::report::UpdateReport;
use manifactor_graph::{FactorEntry, Fixed, Graph, Key, Noise, Values};
use manifactor_solve::{CompileError, Observer, Optimizer, Outcome, Problem};

/// The result of a batch solve.
#[derive(Debug, Clone)]
pub struct Finished {
    /// The estimate of each variable. Undetermined variables are unchanged.
    pub values: Values,
    /// Outcome of the solver. Its factors count from 0 in the order of `factors`, followed by the rows of the
    /// linear priors.
    pub outcome: Outcome,
    /// The factors that took part: all except for factors of undetermined variables.
    pub factors: Vec<FactorId>,
}

impl Smoother {
    /// Returns the factors that count, as a graph with its held variables, and their ids. Linear priors of
    /// marginalized variables are not included.
    pub fn graph(&self) -> (Graph, Vec<FactorId>) {
        let (mut graph, mut ids) = (Graph::new(), vec![]);
        for f in self.counted() {
            let Some(entry) = self.model.factor(f).and_then(|factor| factor.entry.clone()) else { continue };
            graph.push(entry);
            ids.push(FactorId(f));
        }
        for v in self.model.by_age() {
            let place = self.model.record(v);
            let key = &place.key;
            let names = place.tangent.iter().enumerate().filter(|(d, _)| place.held >> d & 1 == 1);
            match place.is_held() {
                true => graph.fix(key),
                false if place.held != 0 && !self.model.is_undetermined(v) => {
                    let names = names.map(|(_, name)| (*name).to_owned()).collect();
                    graph.set_fixed(key, Fixed::Directions(names));
                }
                false => {}
            }
        }
        (graph, ids)
    }

    /// Solves the whole graph as one batch, starting at the estimate. The smoother does not change.
    ///
    /// # Errors
    /// If there is nothing to solve for, or not enough memory.
    pub fn finish(
        &self,
        optimizer: &dyn Optimizer,
        observer: &mut dyn Observer,
    ) -> Result<Finished, CompileError> {
        let (mut graph, factors) = self.graph();
        self.add_priors(&mut graph);
        let mut values = self.estimates();
        let is_in = |key: &str| self.model.variable(key).is_some_and(|v| !self.model.is_undetermined(v));
        let mut solved_for = Values::new();
        for (key, value) in values.iter().filter(|(key, _)| is_in(key.as_str())) {
            solved_for.insert_boxed(key.clone(), value.erased().clone_box());
        }
        let mut problem = Problem::compile_for(&graph, &solved_for, &optimizer.linear())?;
        let weights =
            factors.iter().map(|f| self.model.factor(f.0).map_or(1.0, |factor| factor.weight * factor.share));
        let of_priors = std::iter::repeat_n(1.0, graph.factors().len() - factors.len());
        let weights: Vec<f64> = weights.chain(of_priors).collect();
        if weights.iter().any(|weight| *weight != 1.0) {
            // the weights were checked when they were set
            let _ = problem.set_weights(&weights);
        }
        let outcome = optimizer.descend(&mut problem, observer);
        for (key, value) in problem.values().iter() {
            values.insert_boxed(key.clone(), value.erased().clone_box());
        }
        Ok(Finished { values, outcome, factors })
    }

    /// Adds the linear priors of marginalized variables.
    fn add_priors(&self, graph: &mut Graph) {
        for prior in self.model.priors().filter_map(|f| self.model.prior(f)) {
            let points = prior.variables.iter().filter_map(|v| self.model.point(*v)).collect();
            let keys: Vec<Key> = prior.variables.iter().map(|v| self.key(*v)).collect();
            for factor in prior::factors(&prior, points) {
                graph.push(FactorEntry {
                    keys: keys.clone(),
                    name: None,
                    factor,
                    noise: Noise::unit(),
                    loss: None,
                });
            }
        }
    }

    /// Continues from other values, such as the result of [`finish`](Self::finish), and relinearizes all
    /// factors there. Unknown keys are ignored.
    pub(super) fn adopt(&mut self, values: &Values, report: &mut UpdateReport) -> Result<(), Overflow> {
        let mut points = vec![];
        for v in self.model.by_age() {
            let (key, point) = (&self.model.record(v).key, self.model.point(v));
            let step = point.zip(values.variable(key.as_str())).and_then(|(p, x)| p.erased().local(x));
            points.extend(step.map(|step| (v, step)));
        }
        let (before, mut held) = (self.steps.all().to_vec(), vec![]);
        for (v, step) in points
            .into_iter()
            .filter(|(v, _)| self.factorization.contains(*v) && self.model.record(*v).prior_count == 0)
        {
            self.steps.set(&self.model, v, &step);
            held.push(v);
        }
        let all = Touched { variables: held.clone(), held, ..Touched::default() };
        let passed = self.run_pass(&all, &Moves::default(), false, report);
        if passed.is_err() {
            self.steps.restore(before);
        }
        passed
    }
}
