//! Gauss-Newton: full steps.
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::outcome::{Stall, Termination};
use crate::problem::Problem;
use crate::strategy::descent::{Best, Descent, TrialResult, TrialStep};
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Full steps to the minimum of the linearized cost: H δ = -g.
///
/// The fastest solver from a good initial guess. A step may raise the cost. A step that leaves the domain
/// of a factor is halved until it does not. Five rises in a row end the solve, with the best estimate so
/// far. The solver does not move along an undetermined direction; the outcome reports it.
///
/// ```toml
/// solver = { type = "gauss_newton", stop = { max_iterations = 50 } }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GaussNewton {
    /// Stopping criteria.
    pub stop: Stopping,
    /// Solver of the linear system of each step.
    pub linear: LinearSolver,
}

/// Consecutive rises of the cost that end a solve.
const MAX_RISES: usize = 5;
/// Maximum number of halvings of one step.
const MAX_HALVINGS: usize = 30;

#[typetag::serialize(name = "gauss_newton")]
impl Optimizer for GaussNewton {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let mut descent = match Descent::begin(problem, &self.stop, observer) {
            Ok(descent) => descent,
            Err(outcome) => return *outcome,
        };
        let mut best = Best::new(&descent);
        let termination = loop {
            let mut termination = iterate(&mut descent, &mut best);
            if best.restore(&mut descent) && termination.is_converged() {
                // the minimum that was reached is higher than an estimate before it
                termination = Termination::Stalled { reason: Stall::Diverging };
            }
            if !descent.leave_stationary_point(&termination) {
                break termination;
            }
            best = Best::new(&descent);
        };
        let open = descent.undetermined_direction();
        descent.account(termination, open)
    }
}
register!(dyn Optimizer, "gauss_newton", GaussNewton);

fn iterate(descent: &mut Descent<'_>, best: &mut Best) -> Termination {
    let mut step = TrialStep::default();
    let mut rises = 0;
    loop {
        if let Some(termination) = descent.next() {
            return termination;
        }
        if !descent.undamped(&mut step) {
            return descent.stalled();
        }
        step.control = 1.0;
        let mut halvings = 0;
        while let TrialResult::Undefined = descent.attempt(&step) {
            descent.record(&step, false);
            halvings += 1;
            if descent.interrupted() {
                return Termination::Interrupted;
            }
            if halvings > MAX_HALVINGS {
                return descent.stalled_by(Stall::Domain);
            }
            step.halve();
        }
        rises = if descent.trial.cost > descent.at.cost && !descent.shows_no_decrease(&step) {
            rises + 1
        } else {
            0
        };
        descent.record(&step, true);
        // a step that is small because of halvings does not show convergence
        let is_cut = halvings > 0 && !descent.is_small(step.predicted);
        match descent.accept(&step) {
            Some(termination) if !is_cut && descent.ends(&termination, descent.change()) => {
                return termination;
            }
            _ => {}
        }
        best.update(descent);
        if rises >= MAX_RISES {
            return Termination::Stalled { reason: Stall::Diverging };
        }
    }
}
