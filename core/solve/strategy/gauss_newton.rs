//! Gauss-Newton: full steps.
use crate::linear::settings::LinearSolver;
use crate::linear::system::{dot, norm};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::outcome::{Stall, Termination};
use crate::problem::Problem;
use crate::strategy::optimizer::{Best, Optimizer, Session, SettingError, Step, Stopping, Tried};
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Full steps to the minimum of the linearized cost: H δ = -g.
///
/// The fastest where the start is good. A step may raise the cost; one that leaves the domain of a
/// factor is halved until it does not. Five rises in a row end the solve, with the best estimate so
/// far. A direction that nothing constrains is left alone, and named by the outcome.
///
/// ```toml
/// solver = { type = "gauss_newton", stop = { max_iterations = 50 } }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GaussNewton {
    /// When to stop.
    pub stop: Stopping,
    /// How the linear system of each step is solved.
    pub linear: LinearSolver,
}

/// Rises of the cost in a row that end a solve.
const RISES: usize = 5;
/// Halvings of one step.
const HALVINGS: usize = 30;

#[typetag::serialize(name = "gauss_newton")]
impl Optimizer for GaussNewton {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn check(&self) -> Result<(), SettingError> {
        self.stop.check()?;
        self.linear.check()
    }

    fn solve(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let mut session = match Session::begin(problem, &self.stop, observer) {
            Ok(session) => session,
            Err(outcome) => return *outcome,
        };
        let mut best = Best::new(&session);
        let termination = iterate(&mut session, &mut best);
        best.restore(&mut session);
        let open = session.open_direction();
        session.end(termination, open)
    }
}
register!(dyn Optimizer, "gauss_newton", GaussNewton);

fn iterate(session: &mut Session<'_>, best: &mut Best) -> Termination {
    let mut delta = vec![];
    let mut rises = 0;
    loop {
        if let Some(termination) = session.finished() {
            return termination;
        }
        session.iterations += 1;
        if !session.factorize_undamped() || !session.newton_step(&mut delta) {
            return session.stalled(Stall::Damping);
        }
        let mut step =
            Step { predicted: -0.5 * dot(&delta, &session.problem.g), norm: norm(&delta), control: 1.0 };
        let mut halvings = 0;
        while let Tried::Undefined = session.attempt(&delta, &step) {
            session.record(&step, false);
            halvings += 1;
            if session.interrupted() {
                return Termination::Interrupted;
            }
            if halvings > HALVINGS {
                return session.stalled(Stall::Domain);
            }
            delta.iter_mut().for_each(|d| *d *= 0.5);
            step = Step { norm: 0.5 * step.norm, control: 0.5 * step.control, ..step };
        }
        rises = if session.trial.cost > session.at.cost && !session.settled(&step) { rises + 1 } else { 0 };
        session.record(&step, true);
        // a step that was halved is small for another reason
        let is_cut = halvings > 0 && !session.is_small(step.predicted);
        match session.take(&step) {
            Some(termination) if !is_cut => return termination,
            _ => {}
        }
        best.update(session);
        if rises >= RISES {
            return Termination::Stalled { reason: Stall::Diverging };
        }
    }
}
