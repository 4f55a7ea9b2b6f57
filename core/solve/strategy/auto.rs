//! The default solver, which needs no tuning.
mod search;
mod watch;

use crate::Solution;
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::outcome::Termination;
use crate::problem::CompileError;
use crate::problem::Problem;
use crate::strategy::descent::Descent;
use crate::strategy::dogleg::Dogleg;
use crate::strategy::gauss_newton::GaussNewton;
use crate::strategy::levenberg_marquardt::LevenbergMarquardt;
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::checked::Positive;
use manifactor_graph::{Graph, Values, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use watch::{Pause, Watch};

pub(crate) use search::starts;

/// Gauss-Newton steps, with damping once a step fails, and further starts if the given values lead to no
/// minimum.
///
/// Begins at the given values. Further starts are tried if a full step raises the cost and the next one is
/// not much shorter. They are also tried if the cost has not converged after ten steps, or if a registered
/// start doubts the minimum. Every registered start that applies to the graph is then tried, in ascending
/// order of cost, until one leads to a minimum. The best minimum found is the estimate. If no start leads
/// to a minimum, a dogleg from the given values is the last attempt.
///
/// None of this depends on the unit of the noise: covariances that are too small by a factor have no
/// effect. If no start applies, the solver is Levenberg-Marquardt with almost no damping. Starts need the
/// graph, and the starts of a plugin are available once it is linked. A graph with constraints is solved by `dogleg`. A compiled problem alone (`descend`)
/// is therefore solved by damped steps from its current estimate.
///
/// ```toml
/// solver = { type = "auto", stop = { relative_cost = 1e-6 } }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Auto {
    /// Stopping criteria, for each start.
    pub stop: Stopping,
    /// Solver of the linear system of each step.
    pub linear: LinearSolver,
}

/// Damping of the first step, as a share of the diagonal: negligible.
const INITIAL_DAMPING: Positive = Positive::literal(1e-10);
/// Standard deviation in metres or radians, with the noise scaled to fit the residuals. All directions with
/// a smaller one are damped equally; the remaining ones are damped by the diagonal of H. With pure diagonal
/// damping, steps would run off along weakly constrained directions and leave the domains of factors. An
/// example is the size of an object seen from one side.
const WEAK_SIGMA: f64 = 0.1;
/// Lower bound of the damping of a direction, as a share of the common damping.
const MIN_DAMPING_SHARE: f64 = 1e-6;
/// Lower bound of the common damping, as a share of the largest diagonal entry of H, however well the
/// estimate fits.
const COMMON_DAMPING_FLOOR: f64 = 1e-12;

#[typetag::serialize(name = "auto")]
impl Optimizer for Auto {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        // JᵀJ lacks the curvature of constraints, so that full steps overshoot; a radius adapts to it
        if !problem.constraints.is_empty() {
            let dogleg = Dogleg { stop: self.stop.clone(), linear: self.linear.clone(), ..Dogleg::default() };
            return dogleg.descend(problem, observer);
        }
        self.damped(INITIAL_DAMPING, problem, observer)
    }

    fn solve(
        &self,
        graph: &Graph,
        values: &Values,
        observer: &mut dyn Observer,
    ) -> Result<Solution, CompileError> {
        let mut problem = Problem::compile_for(graph, values, &self.linear)?;
        let mut watch = Watch::new(observer);
        let mut outcome = self.descend(&mut problem, &mut watch);
        if let (Some(Pause::Rise { step }), Termination::Interrupted) = (watch.pause, &outcome.termination)
            && !watch.stopped
        {
            outcome = self.continue_full_steps(step, &mut problem, &mut watch, outcome);
        }
        let is_over = match outcome.termination {
            _ if watch.stopped => true,
            Termination::Converged { .. } | Termination::Indeterminate(_) => {
                !search::is_doubted(graph, &problem)
            }
            // over if the initial values are not finite; after a non-finite step the search goes on
            Termination::NonFinite { .. } => !outcome.final_cost.is_finite(),
            Termination::Interrupted | Termination::MaxIterations | Termination::Stalled { .. } => false,
        };
        if !is_over {
            outcome = self.search((graph, values), &mut problem, &mut watch, outcome);
        }
        Ok(Solution::of(problem, outcome))
    }
}
register!(dyn Optimizer, "auto", Auto);

impl Auto {
    /// Solves by damped steps, beginning with `initial_lambda`. The damping scales with the noise, so (H +
    /// λ D) δ = -g is independent of the noise's unit.
    fn damped(
        &self,
        initial_lambda: Positive,
        problem: &mut Problem,
        observer: &mut dyn Observer,
    ) -> Outcome {
        let rows: u32 = problem.model.factors.iter().map(|factor| factor.rows).sum();
        let bounds = |descent: &Descent<'_>| {
            let variance = 2.0 * descent.at.cost / f64::from(rows.max(1));
            let most =
                (variance / WEAK_SIGMA.powi(2)).max(COMMON_DAMPING_FLOOR * descent.problem.system.largest());
            [MIN_DAMPING_SHARE * most, most]
        };
        let damped =
            LevenbergMarquardt { initial_lambda, stop: self.stop.clone(), ..LevenbergMarquardt::default() };
        damped.solve_within(&bounds, problem, observer)
    }

    fn full_steps(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        GaussNewton { stop: self.stop.clone(), linear: self.linear.clone() }.descend(problem, observer)
    }

    /// Accepts a step of length `step` that raised the cost, and continues with full steps if the next one
    /// is much shorter. If weights span many orders of magnitude, even a good step may raise the cost.
    /// Restores the estimate if this leads to no minimum.
    fn continue_full_steps(
        &self,
        step: f64,
        problem: &mut Problem,
        watch: &mut Watch<'_>,
        outcome: Outcome,
    ) -> Outcome {
        let (before, pause) = (problem.model.columns().clone(), watch.pause);
        problem.model.accept();
        watch.expect_shorter_than(step);
        let next = self.full_steps(problem, watch);
        let better = search::is_minimum(&next.termination);
        if !better {
            watch.pause = pause;
            problem.model.restore(before);
            problem.linearize();
        }
        outcome.then(next, better)
    }
}
