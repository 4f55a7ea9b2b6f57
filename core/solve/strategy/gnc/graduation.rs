//! The outer loop: weights from costs, an estimate from weights.
use super::Gnc;
use crate::observer::{Observer, Quiet};
use crate::outcome::Termination;
use crate::outcome::{Outcome, Rejected};
use crate::problem::Problem;
use crate::strategy::auto::starts;
use crate::strategy::levenberg_marquardt::LevenbergMarquardt;
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::Graph;
use manifactor_graph::checked::{NotNegative, Positive};
use std::ops::ControlFlow;
use std::time::Instant;

/// Most rounds until the weights stay; two or three are the rule.
const ROUNDS: usize = 10;
/// Thresholds for keeping a factor in the search for other minima, as multiples of the inlier bound.
const SHARES: [f64; 5] = [1.0, 0.1, 0.03, 10.0, 100.0];
/// Share of a cost by which another has to be lower to be so by more than what solves leave open.
const LESS: f64 = 1e-5;
/// A weight below this is as good as none, where another start is looked for.
const NEGLIGIBLE: f64 = 1e-4;

/// A graduated solve under way.
pub(super) struct Graduation<'a> {
    gnc: &'a Gnc,
    problem: &'a mut Problem,
    /// For other starts than the estimate; without it there are none.
    graph: Option<&'a Graph>,
    observer: &'a mut dyn Observer,
    /// By factor: what an inlier may cost; `None` for those that are trusted.
    bounds: Vec<Option<f64>>,
    /// By factor: what it costs at the estimate.
    costs: Vec<f64>,
    weights: Vec<f64>,
    /// For weights that change again: no more exact than they are.
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
        let stop =
            Stopping { relative_cost: NotNegative::literal(1e-3), max_iterations: 10, ..Stopping::default() };
        let inner =
            LevenbergMarquardt { initial_lambda: Positive::literal(1e-10), stop, ..Default::default() };
        let (bounds, weights) = (gnc.bounds(problem), vec![1.0; problem.factors()]);
        Self { gnc, problem, graph, observer, bounds, costs: vec![], weights, inner, outcome: None }
    }

    pub(super) fn run(mut self) -> Outcome {
        let (clock, compile) = (Instant::now(), self.problem.times.compile);
        self.problem.model.weigh(&self.weights);
        let mut outcome = match self.graduate() {
            ControlFlow::Continue(()) => {
                self.weigh(self.gnc.cost.last());
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

    /// From the cost in which all factors count to the robust one; breaks where there is no going on.
    fn graduate(&mut self) -> ControlFlow<Box<Outcome>> {
        self.step()?;
        let excess = (0..self.costs.len()).filter_map(|i| self.excess(i));
        let mut control = self.gnc.cost.first(excess.fold(0.0, f64::max));
        while let Some(mu) = control {
            self.weigh(mu);
            self.step()?;
            let open = self.weights.iter().any(|w| *w > 0.0 && *w < 1.0);
            control = if open { self.gnc.cost.next(mu, self.gnc.step.get()) } else { None };
        }
        self.settle()?;
        // what fits has other minima near by, where an outlier was made to fit or an inlier was not
        let mut shares = SHARES.iter();
        let mut share = shares.next();
        while let Some(now) = share {
            let improved = self.settle_from(*now)?;
            share = if improved { share } else { shares.next() };
        }
        ControlFlow::Continue(())
    }

    /// Another estimate, from the factors that cost less than this share of the inlier bound; whether it has a lower robust
    /// cost, else the estimate stays.
    fn settle_from(&mut self, share: f64) -> ControlFlow<Box<Outcome>, bool> {
        let within =
            |me: &Self, share: f64| (0..me.costs.len()).filter(|i| me.excess(*i) <= Some(share)).count();
        if share != 1.0 && within(self, share) == within(self, 1.0) {
            return ControlFlow::Continue(false);
        }
        let (before, values) = (self.robust_cost(), self.problem.values());
        for i in 0..self.weights.len() {
            self.weights[i] = if self.excess(i) <= Some(share) { 1.0 } else { 0.0 };
        }
        self.problem.model.weigh(&self.weights);
        if !self.begin_elsewhere(f64::INFINITY) {
            self.solve()?;
        }
        self.settle()?;
        let improved = self.robust_cost() < before * (1.0 - LESS);
        if !improved {
            self.problem.model.put(&values);
            self.problem.factor_costs(&mut self.costs);
        }
        ControlFlow::Continue(improved)
    }

    /// An estimate for the weights: the better one of those that the last estimate and a start lead to.
    fn step(&mut self) -> ControlFlow<Box<Outcome>> {
        let cost = self.solve()?;
        self.begin_elsewhere(cost);
        self.problem.factor_costs(&mut self.costs);
        ControlFlow::Continue(())
    }

    /// Weights of the robust cost itself and their estimate, in turn, until the same factors are kept.
    fn settle(&mut self) -> ControlFlow<Box<Outcome>> {
        let kept = |me: &Self| (0..me.costs.len()).map(|i| me.excess(i) <= Some(1.0)).collect::<Vec<_>>();
        self.problem.factor_costs(&mut self.costs);
        for _ in 0..ROUNDS {
            let before = kept(self);
            self.weigh(self.gnc.cost.last());
            self.solve()?;
            self.problem.factor_costs(&mut self.costs);
            if kept(self) == before {
                break;
            }
        }
        ControlFlow::Continue(())
    }

    /// Solves with the weights as they are; the cost that is reached.
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

    /// The account of the solve so far and of the next part of it.
    fn account(&mut self, next: Outcome) -> Outcome {
        match self.outcome.take() {
            Some(outcome) => outcome.then(next, true),
            None => next,
        }
    }

    /// Solves with the weights as they are from the best of the registered starts; whether that leads to less than
    /// `cost`, else the estimate stays. Here a start sees what outliers there are by their small weights.
    fn begin_elsewhere(&mut self, cost: f64) -> bool {
        let Some(graph) = self.graph else { return false };
        let mut weighed = graph.clone();
        let mut weights = self.weights.iter();
        weighed.factors_mut().retain_mut(|entry| {
            let weight = weights.next().copied().unwrap_or(1.0);
            if weight < 1.0 && weight > NEGLIGIBLE {
                // noise at the limits of f64 stays as it is
                entry.noise = entry.noise.weighted(weight).unwrap_or_else(|_| entry.noise.clone());
            }
            weight > NEGLIGIBLE
        });
        let here = self.problem.values();
        let points = starts(&weighed, &here, self.problem);
        let best = points.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        if let Some(point) = &best {
            self.problem.model.put(&point.values);
            let there = self.inner.descend(self.problem, &mut Quiet(self.observer));
            if there.final_cost < cost && !matches!(there.termination, Termination::NonFinite { .. }) {
                return true;
            }
        }
        self.problem.model.put(&here);
        false
    }

    /// What a factor costs by what an inlier may; `None` for one that is trusted.
    fn excess(&self, factor: usize) -> Option<f64> {
        self.bounds[factor].map(|bound| self.costs[factor] / bound)
    }

    fn weigh(&mut self, mu: f64) {
        for i in 0..self.weights.len() {
            self.weights[i] = self.excess(i).map_or(1.0, |u| self.gnc.cost.weight(mu, u));
        }
        self.problem.model.weigh(&self.weights);
    }

    fn robust_cost(&self) -> f64 {
        let one = |i: usize| match (self.excess(i), self.bounds[i]) {
            (Some(u), Some(bound)) => bound * self.gnc.cost.rho(u),
            _ => self.costs[i],
        };
        (0..self.costs.len()).map(one).sum()
    }

    /// The factors that cost more than an inlier may.
    fn rejected(&self) -> Vec<Rejected> {
        let beyond = |i: &usize| self.excess(*i).is_some_and(|u| u > 1.0);
        let one = |factor: usize| Rejected {
            factor,
            name: self.problem.model.factors[factor].label(),
            keys: self.problem.model.keys(factor),
            weight: self.weights[factor],
            cost: self.costs[factor],
        };
        (0..self.costs.len()).filter(beyond).map(one).collect()
    }
}
