//! The default: what needs no tuning.
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
use crate::strategy::gauss_newton::GaussNewton;
use crate::strategy::levenberg_marquardt::LevenbergMarquardt;
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::checked::Positive;
use manifactor_graph::{Graph, Values, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use watch::{Pause, Watch};

pub(crate) use search::starts;

/// Gauss-Newton steps that are damped once one fails, and another start where the first leads nowhere.
///
/// Begins at the given values. Where a full step raises the cost and the next is not much shorter, where the cost has not
/// settled after ten steps, or where a registered start doubts the minimum, every registered start that applies to the
/// graph is tried, those of the lowest cost first, until one leads to a minimum. The best minimum found is the estimate.
/// If no start leads to a minimum, a dogleg from the given values is the last attempt.
/// None of this depends on the unit of the noise: covariances that are too small by a factor change nothing. Where no
/// start applies, it is Levenberg-Marquardt with next to no damping. Starts need the graph, and those of a plugin are there
/// once it is linked: so a compiled problem alone (`descend`) is moved by damped steps from where it is.
///
/// ```toml
/// solver = { type = "auto", stop = { relative_cost = 1e-6 } }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Auto {
    /// When to stop, from each start.
    pub stop: Stopping,
    /// How the linear system of each step is solved.
    pub linear: LinearSolver,
}

/// Damping of the first step, as a share of the diagonal: none to speak of.
const DAMPING: Positive = Positive::literal(1e-10);
/// All directions are damped alike, but those that the factors leave a standard deviation of more than this, in metres or
/// radians, the noise scaled to fit the residuals. By the diagonal of H itself, steps run off along what little constrains,
/// as the size of an object that is seen from one side, and out of factors' domains.
const WEAK: f64 = 0.1;
/// No direction is damped by less than this share of the others.
const LEAST: f64 = 1e-6;
/// Nor by less than this share of the largest entry of H's diagonal, however well the estimate fits.
const FLOOR: f64 = 1e-12;

#[typetag::serialize(name = "auto")]
impl Optimizer for Auto {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        self.damped(DAMPING, problem, observer)
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
            outcome = self.go_on(step, &mut problem, &mut watch, outcome);
        }
        let is_over = match outcome.termination {
            _ if watch.stopped => true,
            Termination::Converged { .. } | Termination::Indeterminate(_) => {
                !search::is_doubted(graph, &problem)
            }
            // not where the solve began, but where its steps led
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
    /// Damped steps, the first by so much. The damping follows the noise: (H + λ D) δ = -g is the same for any unit of it.
    fn damped(
        &self,
        initial_lambda: Positive,
        problem: &mut Problem,
        observer: &mut dyn Observer,
    ) -> Outcome {
        let rows: u32 = problem.model.factors.iter().map(|factor| factor.rows).sum();
        let bounds = |descent: &Descent<'_>| {
            let variance = 2.0 * descent.at.cost / f64::from(rows.max(1));
            let most = (variance / WEAK.powi(2)).max(FLOOR * descent.problem.system.largest());
            [LEAST * most, most]
        };
        let damped =
            LevenbergMarquardt { initial_lambda, stop: self.stop.clone(), ..LevenbergMarquardt::default() };
        damped.solve_within(&bounds, problem, observer)
    }

    fn full_steps(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        GaussNewton { stop: self.stop.clone(), linear: self.linear.clone() }.descend(problem, observer)
    }

    /// Takes a step of this length that has raised the cost, and goes on by full ones, if the next is much shorter: weights
    /// that span many digits make the cost of a good step rise. Back to before it, where that leads to no minimum.
    fn go_on(&self, step: f64, problem: &mut Problem, watch: &mut Watch<'_>, outcome: Outcome) -> Outcome {
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
