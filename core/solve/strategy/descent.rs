//! A solve in progress: the common part of all solvers.
mod account;
mod best;
mod minimum;
mod undamped;

use crate::linear::system::{dot, norm};
use crate::observer::Observer;
use crate::outcome::{IterationRecord, Outcome, Stall, Termination, Times, Tolerance};
use crate::problem::Problem;
use crate::strategy::optimizer::Stopping;
use manifactor_graph::batch::Evaluation;
use std::time::Instant;

pub(crate) use best::Best;

/// Initial capacity of the history, in records.
const HISTORY: usize = 1000;

/// A trial step with its prediction.
#[derive(Debug, Clone, Default)]
pub struct TrialStep {
    /// δ, in the order of the linear system.
    pub delta: Vec<f64>,
    /// Decrease of ½ρ predicted by the quadratic model.
    pub predicted: f64,
    /// ‖δ‖.
    pub norm: f64,
    /// The control parameter of the solver, for the record: its damping or the radius of its trust region,
    /// for example.
    pub control: f64,
    /// Share of the slope along the step due to damping, from 0 to 1: δᵀDδ / δᵀ(H + D)δ. Zero without
    /// damping.
    pub damped: f64,
    /// Whether it was shortened at a bound, so that its length shows no convergence.
    pub is_clipped: bool,
}

impl TrialStep {
    /// Halves the step. The prediction stays.
    pub(crate) fn halve(&mut self) {
        self.delta.iter_mut().for_each(|d| *d *= 0.5);
        self.norm *= 0.5;
        self.control *= 0.5;
    }
}

/// Returns whether the last accepted steps become shorter at a constant rate or faster: the longest one of their second
/// half is at most half as long as the longest one of their first half. In a valley, steps that hardly lower the cost
/// stay long.
fn steps_become_shorter(history: &[IterationRecord]) -> bool {
    const LAST_STEPS: usize = 16;
    const MAX_SHARE: f64 = 0.5;
    let accepted = history.iter().rev().filter(|record| record.accepted);
    let steps: Vec<f64> = accepted.take(LAST_STEPS).map(|record| record.step).collect();
    let (last, before) = steps.split_at(steps.len() / 2);
    let longest = |steps: &[f64]| steps.iter().copied().fold(0.0, f64::max);
    longest(last) <= MAX_SHARE * longest(before)
}

/// Result of a trial step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum TrialResult {
    /// It lowered the cost.
    Lower {
        /// Decrease of the cost, as a share of the prediction: 1 if the cost is quadratic.
        gain: f64,
    },
    /// It raised the cost, or left it unchanged.
    Higher,
    /// It left the domain of a factor, or its cost is not finite.
    Undefined,
}

/// A solve in progress: the problem, its costs and its records. Custom solvers build on it: compute a step,
/// try it, then accept it or compute a different one.
///
/// ```
/// use manifactor_solve::{Descent, Observer, Outcome, Problem, TrialStep, Stopping, TrialResult};
///
/// /// Gauss-Newton, as long as the cost falls.
/// fn descend(problem: &mut Problem, stop: &Stopping, observer: &mut dyn Observer) -> Outcome {
///     let mut descent = match Descent::begin(problem, stop, observer) {
///         Ok(descent) => descent,
///         Err(outcome) => return *outcome,
///     };
///     let mut step = TrialStep::default();
///     loop {
///         if let Some(termination) = descent.next() {
///             return descent.end(termination);
///         }
///         let lower = descent.undamped(&mut step) && matches!(descent.attempt(&step), TrialResult::Lower { .. });
///         descent.record(&step, lower);
///         let ended = if lower { descent.accept(&step) } else { Some(descent.stalled()) };
///         if let Some(termination) = ended {
///             return descent.end(termination);
///         }
///     }
/// }
/// ```
pub struct Descent<'a> {
    pub(crate) problem: &'a mut Problem,
    pub(crate) stop: &'a Stopping,
    /// Evaluation at the last linearization.
    pub(crate) at: Evaluation,
    /// Evaluation of the last trial step.
    pub(crate) trial: Evaluation,
    pub(crate) iterations: usize,
    /// Change of the cost by the last accepted step.
    change: f64,
    /// The minimum from which steps continue to rounding error.
    settled: Option<Termination>,
    /// Diagonal of H at the initial estimate.
    initial_diagonal: Vec<f64>,
    observer: &'a mut dyn Observer,
    initial_cost: f64,
    /// Cost of the factors between fixed variables, which no step changes.
    constant_cost: f64,
    clock: Instant,
    compile: f64,
    history: Vec<IterationRecord>,
    interrupted: bool,
    /// A direction is undetermined, so that undamped steps do not exist.
    is_open: bool,
    /// Number of stationary points that were left because they are not minima.
    escapes: usize,
    /// The last factorization does not belong to a step.
    pub(crate) is_refactorized: bool,
}

impl<'a> Descent<'a> {
    /// Linearizes at the initial estimate.
    ///
    /// # Errors
    /// The outcome of the solve, if a residual or a derivative is not finite there.
    pub fn begin(
        problem: &'a mut Problem,
        stop: &'a Stopping,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, Box<Outcome>> {
        let clock = Instant::now();
        let compile = problem.times.compile;
        problem.times = Times { compile, ..Times::default() };
        let at = problem.linearize();
        let mut descent = Self {
            change: f64::INFINITY,
            settled: None,
            initial_diagonal: problem.system.diagonal().copied().collect(),
            problem,
            stop,
            at,
            trial: at,
            iterations: 0,
            observer,
            initial_cost: at.cost,
            constant_cost: 0.0,
            clock,
            compile,
            history: Vec::with_capacity(stop.max_iterations.min(HISTORY)),
            interrupted: false,
            is_open: false,
            escapes: 0,
            is_refactorized: false,
        };
        descent.constant_cost = descent.problem.constant_cost();
        match descent.not_finite() {
            None => Ok(descent),
            Some(termination) => Err(Box::new(descent.account(termination, None))),
        }
    }

    /// Returns the termination for a linearization that is not finite, with the factor that causes it.
    fn not_finite(&self) -> Option<Termination> {
        self.at.not_finite.map(|factor| self.name_not_finite(factor))
    }

    fn name_not_finite(&self, factor: usize) -> Termination {
        Termination::NonFinite { factor, keys: self.problem.model.keys(factor) }
    }

    /// Returns ½ Σ ρ at the estimate.
    pub fn cost(&self) -> f64 {
        self.at.cost
    }

    /// Returns the cost at the estimate that steps can change. Relative changes are shares of it.
    pub(crate) fn changing_cost(&self) -> f64 {
        // no less than the rounding of the sum
        (self.at.cost - self.constant_cost).max(f64::EPSILON * self.at.cost.abs())
    }

    /// Returns the gradient g = Jᵀr at the estimate.
    pub fn gradient(&self) -> &[f64] {
        &self.problem.system.g
    }

    /// Returns the diagonal of H = JᵀJ at the estimate.
    pub fn diagonal(&self) -> Vec<f64> {
        self.problem.system.diagonal().copied().collect()
    }

    /// Returns a reason to stop before the next step. If there is none, the next iteration begins.
    #[allow(clippy::should_implement_trait, reason = "the next iteration; an end has a reason")]
    pub fn next(&mut self) -> Option<Termination> {
        let finished = self.finished();
        self.iterations += usize::from(finished.is_none());
        finished
    }

    /// Computes the step (H + diag(damping)) δ = -g. Returns `false` if the matrix is not positive
    /// definite, δ is not finite, or an observer has interrupted the solve.
    pub fn damped(&mut self, damping: &[f64], step: &mut TrialStep) -> bool {
        if !self.step_within_bounds(&mut step.delta, |descent| descent.factorize(Some(damping))) {
            return false;
        }
        let damped = step.delta.iter().zip(damping).map(|(d, a)| a * d * d).sum::<f64>();
        let slope = -dot(&step.delta, &self.problem.system.g);
        step.damped = if slope > 0.0 { damped / slope } else { 0.0 };
        self.clip(step, 0.5 * (damped + slope));
        true
    }

    /// Computes the step H δ = -g; see [`damped`](Self::damped). The step does not move along undetermined
    /// directions.
    pub fn undamped(&mut self, step: &mut TrialStep) -> bool {
        if !self.step_within_bounds(&mut step.delta, Self::factorize_undamped) {
            return false;
        }
        step.damped = 0.0;
        let predicted = -0.5 * dot(&step.delta, &self.problem.system.g);
        self.clip(step, predicted);
        true
    }

    /// Factorizes, and computes a step. Unknowns at a bound that the step would cross are held, and the step is
    /// computed again. Returns whether it succeeded.
    fn step_within_bounds(&mut self, delta: &mut Vec<f64>, factorize: impl Fn(&mut Self) -> bool) -> bool {
        loop {
            if !factorize(self) || !self.newton_step(delta) {
                return false;
            }
            // each round holds at least one more unknown
            if !self.problem.hold_crossing(delta) {
                return true;
            }
        }
    }

    /// Shortens a step at the bounds. `predicted` is its predicted decrease if it needs none.
    fn clip(&self, step: &mut TrialStep, predicted: f64) {
        step.is_clipped = self.problem.clip(&mut step.delta);
        step.predicted =
            if step.is_clipped { self.problem.system.predicted_decrease(&step.delta) } else { predicted };
        step.norm = norm(&step.delta);
    }

    /// Factorizes H + diag(damping), and computes the first half of the step from -g. Returns whether it
    /// succeeded.
    fn factorize(&mut self, damping: Option<&[f64]>) -> bool {
        self.is_refactorized = false;
        let Self { problem, observer, interrupted, .. } = self;
        problem.factorize(damping, &mut || poll_observer(*observer, interrupted)).is_ok()
    }

    /// Computes the step of the last factorization. Returns whether it is finite and was not interrupted.
    fn newton_step(&mut self, delta: &mut Vec<f64>) -> bool {
        let Self { problem, observer, interrupted, .. } = self;
        problem.newton_step(delta, &mut || poll_observer(*observer, interrupted));
        let finite = delta.iter().all(|x| x.is_finite());
        if !finite {
            self.trial = Evaluation { cost: f64::NAN, ..Evaluation::default() };
        }
        finite && !self.interrupted
    }

    fn finished(&self) -> Option<Termination> {
        let gradient = self.largest_gradient();
        if let Some(termination) = self.not_finite() {
            Some(termination)
        } else if self.interrupted {
            Some(Termination::Interrupted)
        } else if self.is_negligible(self.at.cost) {
            Some(Termination::Converged { reason: Tolerance::AbsoluteCost })
        } else if gradient <= *self.stop.gradient * self.unit() && !self.is_steep() {
            Some(Termination::Converged { reason: Tolerance::Gradient })
        } else if self.iterations >= self.stop.max_iterations {
            let settled = self.settled.clone().filter(|_| steps_become_shorter(&self.history));
            Some(settled.unwrap_or(Termination::MaxIterations))
        } else {
            None
        }
    }

    /// Returns whether an observer has requested the end.
    pub fn interrupted(&self) -> bool {
        self.interrupted
    }

    /// Returns the scale of absolute tolerances. They are meant for information of one or more, in tangent
    /// units. If all information is smaller, they shrink with it, so that initial values do not look like a
    /// minimum because of the noise's unit.
    pub(crate) fn unit(&self) -> f64 {
        match self.problem.system.largest() {
            largest if largest > 0.0 => largest.min(1.0),
            _ => 1.0,
        }
    }

    /// Returns whether a cost is zero up to rounding: within the absolute tolerance, also if values that are far below
    /// one, such as currents in amperes, are counted in units of their own size.
    fn is_negligible(&self, cost: f64) -> bool {
        let limit = *self.stop.absolute_cost;
        if cost > limit * self.unit() {
            return false;
        }
        let coordinates = self.problem.coordinates();
        let sizes = coordinates.iter().map(|x| x.map_or(1.0, |x| x.abs().min(1.0)));
        let mut information: Vec<f64> =
            self.problem.system.diagonal().zip(sizes).map(|(d, size)| d * size * size).collect();
        // the diagonal of held unknowns is set to one
        self.problem.system.held.iter().for_each(|i| information[*i] = 0.0);
        cost <= limit * information.into_iter().fold(0.0, f64::max).min(1.0)
    }

    /// Returns whether a step is within the tolerance, and changes no coordinate by more than a millionth of its value.
    /// Coordinates that are zero up to rounding of the others do not count.
    pub(crate) fn is_short(&self, step: &TrialStep) -> bool {
        const SHARE: f64 = 1e-6;
        const ROUNDING: f64 = 1e-15;
        if step.norm > *self.stop.step {
            return false;
        }
        let coordinates = self.problem.coordinates();
        let largest = coordinates.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let changes = |(x, d): (&Option<f64>, &f64)| {
            x.is_some_and(|x| x.abs() > ROUNDING * largest && d.abs() > SHARE * x.abs())
        };
        !coordinates.iter().zip(&step.delta).any(changes)
    }

    /// Returns the largest cosine between the residual vector and a column of the Jacobian. It is zero if
    /// the gradient is, and independent of units: the test `gtol` of MINPACK.
    fn largest_cosine(&self) -> f64 {
        let length = (2.0 * self.changing_cost()).sqrt();
        let cosine = |(g, d): (&f64, &f64)| if *d > 0.0 { g.abs() / (d.sqrt() * length) } else { 0.0 };
        self.problem.system.g.iter().zip(self.problem.system.diagonal()).map(cosine).fold(0.0, f64::max)
    }

    /// Returns whether a single unknown could lower the cost by more than a thousandth: by g²/2H = cos² ·
    /// cost, in the quadratic model. In that case, a short step with a small decrease indicates damping or
    /// a plateau, such as with a very distant landmark.
    pub(crate) fn is_steep(&self) -> bool {
        const SHARE: f64 = 1e-3;
        self.largest_cosine().powi(2) > SHARE
    }

    /// Returns whether the slope of the cost along all unknowns of a variable has vanished on the way, although
    /// its factors still have a cost. An example is the rate of an exponential function that has become so large
    /// that its values are zero. The gradient is zero there, but it is no minimum. A single unknown may vanish
    /// at a minimum, such as the rotation of an ellipsoid that has become round.
    pub(crate) fn has_run_off(&self) -> bool {
        /// Remaining share of the diagonal entry of H below which a residual does not depend on the unknown.
        const MIN_SHARE: f64 = 1e-20;
        let model = &self.problem.model;
        let entries = self.problem.system.diagonal().zip(&self.initial_diagonal);
        let has_vanished: Vec<bool> = entries.map(|(now, initial)| *now < MIN_SHARE * initial).collect();
        if !has_vanished.contains(&true) {
            return false;
        }
        let mut costs = vec![];
        model.factor_costs(&mut costs);
        let is_lost = |variable: &u32| {
            let mut unknowns = model.variables[*variable as usize].unknowns().flatten().peekable();
            unknowns.peek().is_some() && unknowns.all(|unknown| has_vanished[unknown])
        };
        let costly = model.factors.iter().zip(costs).filter(|(_, cost)| *cost > 0.0);
        costly.flat_map(|(factor, _)| factor.variables.iter()).any(is_lost)
    }

    fn largest_gradient(&self) -> f64 {
        // not `f64::max`, which would drop NaN
        self.problem.system.g.iter().fold(0.0, |m, g| if m.is_nan() || g.abs() <= m { m } else { g.abs() })
    }

    /// Evaluates the cost after a step. The estimate stays unchanged.
    pub fn attempt(&mut self, step: &TrialStep) -> TrialResult {
        self.trial = self.problem.try_step(&step.delta);
        let trial = &self.trial;
        if trial.became_undefined > 0 || trial.not_finite.is_some() || !trial.cost.is_finite() {
            return TrialResult::Undefined;
        }
        let gain = (self.at.cost - trial.cost) / step.predicted;
        if trial.cost < self.at.cost && gain > 0.0 {
            TrialResult::Lower { gain }
        } else {
            TrialResult::Higher
        }
    }

    /// Returns whether both the last trial and its model show no further decrease.
    pub(crate) fn shows_no_decrease(&self, step: &TrialStep) -> bool {
        self.is_small(self.at.cost - self.trial.cost) && self.is_small(step.predicted) && !self.is_steep()
    }

    /// Returns whether a change of the cost is within the relative tolerance.
    pub(crate) fn is_small(&self, change: f64) -> bool {
        change.abs() <= self.stop.relative_cost() * self.changing_cost()
    }

    /// Returns the reason for the lack of an acceptable step, from the last trial step, which is almost
    /// zero.
    pub fn stalled(&self) -> Termination {
        self.stalled_by(Stall::Damping)
    }

    /// Returns the reason for the lack of an acceptable step; `other`, if the last step does not show it.
    pub(crate) fn stalled_by(&self, other: Stall) -> Termination {
        const ROUNDING: f64 = 1e-10;
        /// At a minimum, the estimate has half as many correct digits as the cost: a cosine below this is
        /// rounding.
        const ORTHOGONAL: f64 = 1e-6;
        let Evaluation { cost, became_undefined, not_finite, .. } = self.trial;
        let reason = if self.interrupted {
            return Termination::Interrupted;
        } else if let Some(settled) = &self.settled {
            return settled.clone();
        } else if became_undefined > 0 {
            Stall::Domain
        } else if !cost.is_finite() {
            return self
                .name_not_finite(not_finite.unwrap_or_else(|| self.problem.model.not_finite_factor()));
        } else if cost - self.at.cost > ROUNDING * self.at.cost.abs() {
            Stall::Jump
        } else if self.largest_cosine() <= ORTHOGONAL {
            return Termination::Converged { reason: Tolerance::Gradient };
        } else {
            other
        };
        Termination::Stalled { reason }
    }

    /// Returns whether a solve that has reached a minimum ends. `change` is the change of the cost that shows it.
    /// A small solve continues to rounding error; if its iterations run out, it has converged.
    pub(crate) fn ends(&mut self, termination: &Termination, change: f64) -> bool {
        let continues = *termination == Termination::Converged { reason: Tolerance::RelativeCost }
            && change.abs() > self.stop.exact_cost(self.problem.dim()) * self.changing_cost();
        if continues && self.settled.is_none() {
            self.settled = Some(termination.clone());
        }
        !continues
    }

    /// Returns the change of the cost by the last accepted step.
    pub(crate) fn change(&self) -> f64 {
        self.change
    }

    /// Accepts the last trial step, and linearizes there. Returns a reason to stop, if there is one.
    pub fn accept(&mut self, step: &TrialStep) -> Option<Termination> {
        self.problem.model.accept();
        let (before, after) = (self.at.cost, self.trial.cost);
        let share = self.stop.relative_cost() * self.changing_cost();
        let inactive = self.at.inactive;
        self.at = self.problem.linearize();
        self.trial = self.at;
        self.change = (before - after).abs();
        let is_small = self.change <= share;
        if !is_small {
            self.settled = None;
        }
        if let Some(termination) = self.not_finite() {
            return Some(termination);
        }
        // continue, since factors that become defined again change the cost, and a step that ends at a bound may be
        // short
        if self.at.inactive != inactive || step.is_clipped {
            return None;
        }
        let reason = if is_small {
            Tolerance::RelativeCost
        } else if self.is_short(step) {
            Tolerance::Step
        } else {
            return None;
        };
        (!self.is_steep()).then_some(Termination::Converged { reason })
    }
}

/// Polls the observer. Returns whether the step may continue.
fn poll_observer(observer: &mut dyn Observer, interrupted: &mut bool) -> bool {
    *interrupted |= observer.poll().is_break();
    !*interrupted
}
