//! The outer loop, which alternates between weights and estimates.
use super::Gnc;
use crate::observer::{Observer, Quiet};
use crate::outcome::Termination;
use crate::outcome::{Outcome, RejectedFactor};
use crate::problem::Problem;
use crate::strategy::auto::starts;
use crate::strategy::levenberg_marquardt::LevenbergMarquardt;
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::Graph;
use manifactor_graph::checked::{NotNegative, Positive};
use std::ops::ControlFlow;
use std::time::Instant;

/// Maximum number of rounds until the weights converge; usually two or three.
const MAX_ROUNDS: usize = 10;
/// Thresholds for keeping a factor in the search for further minima, as multiples of the inlier bound.
const THRESHOLD_SHARES: [f64; 5] = [1.0, 0.1, 0.03, 10.0, 100.0];
/// Relative decrease above which a cost counts as lower, beyond the tolerance of the solves.
const MIN_DECREASE: f64 = 1e-5;
/// Weight below which a factor is omitted in the search for starts.
const NEGLIGIBLE_WEIGHT: f64 = 1e-4;

/// A graduated solve in progress.
pub(super) struct Graduation<'a> {
    gnc: &'a Gnc,
    problem: &'a mut Problem,
    /// The graph, for further starts; without it, only the estimate is used.
    graph: Option<&'a Graph>,
    observer: &'a mut dyn Observer,
    /// Inlier bound of each factor; `None` for trusted factors.
    bounds: Vec<Option<f64>>,
    /// Cost of each factor at the estimate.
    costs: Vec<f64>,
    weights: Vec<f64>,
    /// Solver for intermediate weights, which need no exact solution.
    inner: LevenbergMarquardt,
    outcome: Option<Outcome>,
}

impl<'a> Graduation<'a> {
    pub(super) fn new(
        gnc: &'a Gnc,
        problem: &'a mut Problem,
        graph: Option<&'a Graph>,
        observer: &'a mut dyn Observer,
    ) -> Self {
        let stop = Stopping {
            relative_cost: Some(NotNegative::literal(1e-3)),
            max_iterations: 10,
            ..Stopping::default()
        };
        let inner =
            LevenbergMarquardt { initial_lambda: Positive::literal(1e-10), stop, ..Default::default() };
        let (bounds, weights) = (gnc.bounds(problem), vec![1.0; problem.factors()]);
        Self { gnc, problem, graph, observer, bounds, costs: vec![], weights, inner, outcome: None }
    }

    pub(super) fn run(mut self) -> Outcome {
        let (clock, compile) = (Instant::now(), self.problem.times.compile);
        self.problem.model.set_weights(&self.weights);
        let mut outcome = match self.graduate() {
            ControlFlow::Continue(()) => {
                self.update_weights(self.gnc.cost.last());
                let last = self.gnc.solver.descend(self.problem, self.observer);
                self.account(last)
            }
            ControlFlow::Break(outcome) => *outcome,
        };
        self.problem.factor_costs(&mut self.costs);
        outcome.rejected = self.rejected();
        let times = &mut outcome.times;
        (times.compile, times.total) = (compile, compile + clock.elapsed().as_secs_f64());
        times.other = (times.total - compile - times.stages()).max(0.0);
        outcome
    }

    /// Graduates from the cost with all factors to the robust one. Breaks if a solve fails or is
    /// interrupted.
    fn graduate(&mut self) -> ControlFlow<Box<Outcome>> {
        self.step()?;
        let excess = (0..self.costs.len()).filter_map(|i| self.excess(i));
        let mut control = self.gnc.cost.first(excess.fold(0.0, f64::max));
        while let Some(mu) = control {
            self.update_weights(mu);
            self.step()?;
            let open = self.weights.iter().any(|w| *w > 0.0 && *w < 1.0);
            control = if open { self.gnc.cost.next(mu, self.gnc.step.get()) } else { None };
        }
        self.alternate()?;
        // look for better minima nearby, in case an outlier was kept or an inlier rejected
        let mut shares = THRESHOLD_SHARES.iter();
        let mut share = shares.next();
        while let Some(now) = share {
            let improved = self.alternate_from(*now)?;
            share = if improved { share } else { shares.next() };
        }
        ControlFlow::Continue(())
    }

    /// Computes an estimate from the factors with a cost below this share of the inlier bound. Keeps it and
    /// returns `true` if it has a lower robust cost.
    fn alternate_from(&mut self, share: f64) -> ControlFlow<Box<Outcome>, bool> {
        let within =
            |me: &Self, share: f64| (0..me.costs.len()).filter(|i| me.excess(*i) <= Some(share)).count();
        if share != 1.0 && within(self, share) == within(self, 1.0) {
            return ControlFlow::Continue(false);
        }
        let (before, values) = (self.robust_cost(), self.problem.values());
        for i in 0..self.weights.len() {
            self.weights[i] = if self.excess(i) <= Some(share) { 1.0 } else { 0.0 };
        }
        self.problem.model.set_weights(&self.weights);
        if !self.solve_from_best_start(f64::INFINITY) {
            self.solve()?;
        }
        self.alternate()?;
        let improved = self.robust_cost() < before * (1.0 - MIN_DECREASE);
        if !improved {
            self.problem.model.set_values(&values);
            self.problem.factor_costs(&mut self.costs);
        }
        ControlFlow::Continue(improved)
    }

    /// Computes an estimate for the current weights: the better result of the last estimate and a start.
    fn step(&mut self) -> ControlFlow<Box<Outcome>> {
        let cost = self.solve()?;
        self.solve_from_best_start(cost);
        self.problem.factor_costs(&mut self.costs);
        ControlFlow::Continue(())
    }

    /// Alternates between the weights of the robust cost and an estimate for them, until the inliers stay
    /// the same.
    fn alternate(&mut self) -> ControlFlow<Box<Outcome>> {
        let kept = |me: &Self| (0..me.costs.len()).map(|i| me.excess(i) <= Some(1.0)).collect::<Vec<_>>();
        self.problem.factor_costs(&mut self.costs);
        for _ in 0..MAX_ROUNDS {
            let before = kept(self);
            self.update_weights(self.gnc.cost.last());
            self.solve()?;
            self.problem.factor_costs(&mut self.costs);
            if kept(self) == before {
                break;
            }
        }
        ControlFlow::Continue(())
    }

    /// Solves with the current weights. Returns the final cost.
    fn solve(&mut self) -> ControlFlow<Box<Outcome>, f64> {
        let next = self.inner.descend(self.problem, self.observer);
        let outcome = self.account(next);
        if matches!(outcome.termination, Termination::NonFinite { .. } | Termination::Interrupted) {
            return ControlFlow::Break(Box::new(outcome));
        }
        let cost = outcome.final_cost;
        self.outcome = Some(outcome);
        ControlFlow::Continue(cost)
    }

    /// Adds the next part of the solve to the outcome so far.
    fn account(&mut self, next: Outcome) -> Outcome {
        match self.outcome.take() {
            Some(outcome) => outcome.then(next, true),
            None => next,
        }
    }

    /// Solves with the current weights from the best registered start. Keeps the result and returns `true`
    /// if its cost is below `cost`. The starts get the weights, and so the outliers, by way of the noise.
    fn solve_from_best_start(&mut self, cost: f64) -> bool {
        let Some(graph) = self.graph else { return false };
        let mut weighed = graph.clone();
        let mut weights = self.weights.iter();
        weighed.factors_mut().retain_mut(|entry| {
            let weight = weights.next().copied().unwrap_or(1.0);
            if weight < 1.0 && weight > NEGLIGIBLE_WEIGHT {
                // noise at the limits of f64 stays unchanged
                entry.noise = entry.noise.weighted(weight).unwrap_or_else(|_| entry.noise.clone());
            }
            weight > NEGLIGIBLE_WEIGHT
        });
        let here = self.problem.values();
        let points = starts(&weighed, &here, self.problem);
        let best = points.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        if let Some(point) = &best {
            self.problem.model.set_values(&point.values);
            let there = self.inner.descend(self.problem, &mut Quiet(self.observer));
            if there.final_cost < cost && !matches!(there.termination, Termination::NonFinite { .. }) {
                return true;
            }
        }
        self.problem.model.set_values(&here);
        false
    }

    /// Returns the cost of a factor, as a multiple of its inlier bound; `None` for a trusted factor.
    fn excess(&self, factor: usize) -> Option<f64> {
        self.bounds[factor].map(|bound| self.costs[factor] / bound)
    }

    fn update_weights(&mut self, mu: f64) {
        for i in 0..self.weights.len() {
            self.weights[i] = self.excess(i).map_or(1.0, |u| self.gnc.cost.weight(mu, u));
        }
        self.problem.model.set_weights(&self.weights);
    }

    fn robust_cost(&self) -> f64 {
        let one = |i: usize| match (self.excess(i), self.bounds[i]) {
            (Some(u), Some(bound)) => bound * self.gnc.cost.rho(u),
            _ => self.costs[i],
        };
        (0..self.costs.len()).map(one).sum()
    }

    /// Returns the factors with a cost above their inlier bound.
    fn rejected(&self) -> Vec<RejectedFactor> {
        let beyond = |i: &usize| self.excess(*i).is_some_and(|u| u > 1.0);
        let one = |factor: usize| RejectedFactor {
            factor,
            name: self.problem.model.factors[factor].label(),
            keys: self.problem.model.keys(factor),
            weight: self.weights[factor],
            cost: self.costs[factor],
        };
        (0..self.costs.len()).filter(beyond).map(one).collect()
    }
}
