//! What solvers have in common: the trait, when to stop, and the account of a solve.
mod setting;
mod undamped;

use crate::Solution;
use crate::linear::NotPositiveDefinite;
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::{IterationRecord, Outcome};
use crate::outcome::{Stall, Termination, Tolerance, Undetermined};
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::batch::Evaluation;
use manifactor_graph::checked::not_negative;
use manifactor_graph::column::Columns;
use manifactor_graph::{Graph, Values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::time::Instant;

pub use setting::SettingError;
pub(crate) use setting::{check, positive};

/// A strategy that lowers the cost of a problem. Chosen by name.
#[typetag::serialize(tag = "type")]
pub trait Optimizer: Debug + Send + Sync {
    /// Moves the problem's estimate to a minimum of its cost, or as far as it gets. The estimate is
    /// the best found, however the solve ends.
    fn solve(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome;

    /// How the linear system of each step is solved.
    fn linear(&self) -> LinearSolver {
        LinearSolver::default()
    }

    /// Whether each setting is within its domain. [`solve`](crate::solve()) asks before it begins; a config is checked
    /// when it is read.
    ///
    /// # Errors
    /// Names the setting that is not.
    fn check(&self) -> Result<(), SettingError> {
        Ok(())
    }

    /// Compiles a graph and solves it. Override to begin somewhere else than at `values`.
    ///
    /// # Errors
    /// Where graph and values do not fit each other.
    fn solve_graph(
        &self,
        graph: &Graph,
        values: &Values,
        observer: &mut dyn Observer,
    ) -> Result<Solution, CompileError> {
        let mut problem = Problem::compile_for(graph, values, &self.linear())?;
        let outcome = self.solve(&mut problem, observer);
        Ok(Solution::of(problem, outcome))
    }
}

manifactor_graph::kind!(dyn Optimizer, "solver");

/// When to stop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stopping {
    /// Most linearizations.
    pub max_iterations: usize,
    /// Stop once a step changes the cost by less than this share of it.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub relative_cost: f64,
    /// Stop once the cost is below this.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub absolute_cost: f64,
    /// Stop once no entry of the gradient is larger than this.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub gradient: f64,
    /// Stop once the Euclidean norm of a step is below this.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub step: f64,
}

impl Default for Stopping {
    fn default() -> Self {
        Self { max_iterations: 100, relative_cost: 1e-8, absolute_cost: 1e-20, gradient: 1e-12, step: 1e-12 }
    }
}

/// Records that there is room for from the beginning.
const HISTORY: usize = 1000;

/// A step to be tried, and what is expected of it.
pub(crate) struct Step {
    /// ½ρ less by the quadratic model.
    pub predicted: f64,
    pub norm: f64,
    pub control: f64,
}

/// What became of a step.
pub(crate) enum Tried {
    /// It lowered the cost by this share of what the model predicts; not yet taken.
    Lower { gain: f64 },
    /// It raised the cost, or lowered it by nothing.
    Higher,
    /// It left the domain of a factor, or its cost is not finite.
    Undefined,
}

/// A solve under way: the problem, its costs and its records.
pub(crate) struct Session<'a> {
    pub problem: &'a mut Problem,
    pub stop: &'a Stopping,
    /// At the last linearization.
    pub at: Evaluation,
    /// Of the last step tried.
    pub trial: Evaluation,
    pub iterations: usize,
    observer: &'a mut dyn Observer,
    initial_cost: f64,
    clock: Instant,
    compile: f64,
    history: Vec<IterationRecord>,
    interrupted: bool,
    /// Something is open: steps that are not damped cannot be had.
    is_open: bool,
}

impl<'a> Session<'a> {
    /// Linearizes at the initial estimate.
    pub(crate) fn begin(
        problem: &'a mut Problem,
        stop: &'a Stopping,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, Box<Outcome>> {
        let clock = Instant::now();
        let compile = problem.times.compile;
        problem.times = crate::outcome::Times { compile, ..Default::default() };
        let at = problem.linearize();
        let mut session = Self {
            problem,
            stop,
            at,
            trial: at,
            iterations: 0,
            observer,
            initial_cost: at.cost,
            clock,
            compile,
            history: Vec::with_capacity(stop.max_iterations.min(HISTORY)),
            interrupted: false,
            is_open: false,
        };
        match session.not_finite() {
            None => Ok(session),
            Some(termination) => Err(Box::new(session.end(termination, None))),
        }
    }

    /// The factor that makes the linearization not finite, if one does.
    fn not_finite(&self) -> Option<Termination> {
        self.at.not_finite.map(|factor| self.blame(factor))
    }

    fn blame(&self, factor: usize) -> Termination {
        Termination::NonFinite { factor, keys: self.problem.factor_keys(factor) }
    }

    /// Factorizes H + diag(added), and takes -g half the way to the step.
    pub(crate) fn factorize(&mut self, added: Option<&[f64]>) -> Result<(), NotPositiveDefinite> {
        let Self { problem, observer, interrupted, .. } = self;
        problem.factorize_while(added, &mut || go_on(*observer, interrupted))
    }

    /// The step of the last factorization; whether it is finite, and no interrupt has cut it short.
    pub(crate) fn newton_step(&mut self, step: &mut Vec<f64>) -> bool {
        let Self { problem, observer, interrupted, .. } = self;
        problem.newton_step(step, &mut || go_on(*observer, interrupted));
        let finite = step.iter().all(|x| x.is_finite());
        if !finite {
            self.trial = Evaluation { cost: f64::NAN, ..Evaluation::default() };
        }
        finite && !self.interrupted
    }

    /// A reason to stop before another step, if there is one.
    pub(crate) fn finished(&self) -> Option<Termination> {
        let gradient = self.gradient();
        if let Some(termination) = self.not_finite() {
            Some(termination)
        } else if self.interrupted {
            Some(Termination::Interrupted)
        } else if self.at.cost <= self.stop.absolute_cost {
            Some(Termination::Converged { reason: Tolerance::AbsoluteCost })
        } else if gradient <= self.stop.gradient {
            Some(Termination::Converged { reason: Tolerance::Gradient })
        } else if self.iterations >= self.stop.max_iterations {
            Some(Termination::MaxIterations)
        } else {
            None
        }
    }

    pub(crate) fn interrupted(&self) -> bool {
        self.interrupted
    }

    fn gradient(&self) -> f64 {
        // `f64::max` would drop what is not a number
        self.problem.g.iter().fold(0.0, |m, g| if m.is_nan() || g.abs() <= m { m } else { g.abs() })
    }

    /// Evaluates a step.
    pub(crate) fn attempt(&mut self, delta: &[f64], step: &Step) -> Tried {
        self.trial = self.problem.try_step(delta);
        let trial = &self.trial;
        if trial.left > 0 || trial.not_finite.is_some() || !trial.cost.is_finite() {
            return Tried::Undefined;
        }
        let gain = (self.at.cost - trial.cost) / step.predicted;
        if trial.cost < self.at.cost && gain > 0.0 { Tried::Lower { gain } } else { Tried::Higher }
    }

    /// Whether the last trial and its model both say that there is nothing left to gain.
    pub(crate) fn settled(&self, step: &Step) -> bool {
        self.is_small(self.at.cost - self.trial.cost) && self.is_small(step.predicted)
    }

    /// Whether a change of the cost is within the tolerance.
    pub(crate) fn is_small(&self, change: f64) -> bool {
        change.abs() <= self.stop.relative_cost * self.at.cost.abs()
    }

    /// Why no step is good enough, as the last one shows, which is next to nothing; else `other`.
    pub(crate) fn stalled(&self, other: Stall) -> Termination {
        const ROUNDING: f64 = 1e-10;
        let Evaluation { cost, left, not_finite, .. } = self.trial;
        let reason = if self.interrupted {
            return Termination::Interrupted;
        } else if left > 0 {
            Stall::Domain
        } else if !cost.is_finite() {
            return self.blame(not_finite.unwrap_or_else(|| self.problem.not_finite_factor()));
        } else if cost - self.at.cost > ROUNDING * self.at.cost.abs() {
            Stall::Jump
        } else {
            other
        };
        Termination::Stalled { reason }
    }

    /// Takes the trial as the estimate and linearizes there; a reason to stop, if it brings one.
    pub(crate) fn take(&mut self, step: &Step) -> Option<Termination> {
        self.problem.accept();
        let (before, after) = (self.at.cost, self.trial.cost);
        let inactive = self.at.inactive;
        self.at = self.problem.linearize();
        self.trial = self.at;
        if let Some(termination) = self.not_finite() {
            return Some(termination);
        }
        // factors that come back into their domain change the cost: go on with them
        if self.at.inactive != inactive {
            return None;
        }
        if (before - after).abs() <= self.stop.relative_cost * before.abs() {
            Some(Termination::Converged { reason: Tolerance::RelativeCost })
        } else if step.norm <= self.stop.step {
            Some(Termination::Converged { reason: Tolerance::Step })
        } else {
            None
        }
    }

    /// Keeps a record of the last trial, and shows it to the observer.
    pub(crate) fn record(&mut self, step: &Step, accepted: bool) {
        let defined = self.trial.left == 0 && self.trial.cost.is_finite();
        let record = IterationRecord {
            iteration: self.iterations,
            cost: self.at.cost,
            trial_cost: defined.then_some(self.trial.cost),
            gradient: self.gradient(),
            step: step.norm,
            control: step.control,
            accepted,
            inactive: self.at.inactive,
            seconds: self.clock.elapsed().as_secs_f64(),
        };
        let IterationRecord { iteration, cost, trial_cost, gradient, step, control, .. } = record;
        tracing::debug!(iteration, cost, trial_cost, gradient, step, control, accepted, "step");
        self.interrupted |= self.observer.iteration(&record).is_break();
        self.history.push(record);
    }

    /// The account of the solve.
    pub(crate) fn end(&mut self, termination: Termination, undetermined: Option<Undetermined>) -> Outcome {
        let mut times = self.problem.times;
        let solve = self.clock.elapsed().as_secs_f64();
        times.total = solve + self.compile;
        times.other = (solve - times.stages()).max(0.0);
        let untouched = self.problem.untouched();
        let moving = match termination {
            Termination::MaxIterations if self.iterations > 0 => self.problem.moving(),
            _ => None,
        };
        let termination = match (&untouched, termination) {
            // a minimum, but not of what these variables are
            (
                Some(untouched),
                Termination::Converged { .. } | Termination::Stalled { reason: Stall::Jump },
            ) => Termination::Indeterminate(untouched.clone()),
            (_, termination) => termination,
        };
        Outcome {
            initial_cost: self.initial_cost,
            final_cost: self.at.cost,
            iterations: self.iterations,
            termination,
            undetermined,
            moving,
            untouched,
            factors: self.problem.factors(),
            inactive: self.at.inactive,
            inactive_factors: self.problem.inactive_factors(),
            rejected: vec![],
            times,
            history: std::mem::take(&mut self.history),
        }
    }
}

/// Whether an observer lets a step go on.
fn go_on(observer: &mut dyn Observer, interrupted: &mut bool) -> bool {
    *interrupted |= observer.poll().is_break();
    !*interrupted
}

/// The best estimate so far, for solvers whose steps may raise the cost.
pub(crate) struct Best {
    cost: f64,
    columns: Columns,
}

impl Best {
    pub(crate) fn new(session: &Session<'_>) -> Self {
        Self { cost: session.at.cost, columns: session.problem.columns.clone() }
    }
    pub(crate) fn update(&mut self, session: &Session<'_>) {
        if session.at.cost < self.cost {
            self.cost = session.at.cost;
            self.columns.clone_from(&session.problem.columns);
        }
    }
    /// Goes back to the best estimate, where that is not the last.
    pub(crate) fn restore(self, session: &mut Session<'_>) {
        if self.cost < session.at.cost || !session.at.cost.is_finite() {
            session.problem.columns = self.columns;
            session.at = session.problem.linearize();
        }
    }
}
