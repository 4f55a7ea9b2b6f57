//! Records of the steps of a solve, and its outcome.
use super::{Descent, TrialStep};
use crate::outcome::{IterationRecord, Outcome, Stall, Termination, Undetermined};
use crate::problem::CONSTRAINT_TOLERANCE;

impl Descent<'_> {
    /// Records the last trial step, and passes it to the observer.
    pub fn record(&mut self, step: &TrialStep, accepted: bool) {
        let defined = self.trial.became_undefined == 0 && self.trial.cost.is_finite();
        let record = IterationRecord {
            iteration: self.iterations,
            cost: self.at.cost,
            trial_cost: defined.then_some(self.trial.cost),
            gradient: self.largest_gradient(),
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

    /// Returns the outcome of the solve, including the undetermined direction at the estimate, which takes
    /// a factorization.
    pub fn end(mut self, termination: Termination) -> Outcome {
        let looks = self.iterations > 0 && !self.interrupted && self.at.not_finite.is_none();
        let open = looks.then(|| self.problem.undetermined()).flatten();
        self.account(termination, open)
    }

    /// Returns whether the estimate violates constraints. A descent without the method of multipliers takes them as
    /// ordinary factors.
    fn violates_constraints(&self) -> bool {
        let constraints = &self.problem.constraints;
        !constraints.is_empty()
            && !constraints.have_penalty()
            && self.problem.violation() > CONSTRAINT_TOLERANCE
    }

    /// Returns the outcome of the solve, with the given undetermined direction.
    pub(crate) fn account(
        &mut self,
        termination: Termination,
        undetermined: Option<Undetermined>,
    ) -> Outcome {
        let mut times = self.problem.times;
        let solve = self.clock.elapsed().as_secs_f64();
        times.total = solve + self.compile;
        times.other = (solve - times.stages()).max(0.0);
        let unconstrained = self.problem.unconstrained();
        let moving = match termination {
            Termination::MaxIterations if self.iterations > 0 => self.problem.moving(),
            _ => None,
        };
        let termination = match (&unconstrained, termination) {
            // a minimum, but these variables are undetermined
            (
                Some(unconstrained),
                Termination::Converged { .. } | Termination::Stalled { reason: Stall::Jump },
            ) => Termination::Indeterminate(unconstrained.clone()),
            (
                None,
                Termination::Converged { .. }
                | Termination::Stalled { reason: Stall::Damping | Stall::TrustRegion },
            ) if self.has_run_off() => Termination::Stalled { reason: Stall::RunOff },
            (None, Termination::Converged { .. }) if self.violates_constraints() => {
                Termination::Stalled { reason: Stall::Violation }
            }
            (_, termination) => termination,
        };
        Outcome {
            initial_cost: self.initial_cost,
            final_cost: self.at.cost,
            iterations: self.iterations,
            termination,
            undetermined,
            moving,
            active_bounds: self.problem.active_bounds(),
            constraints: vec![],
            unconstrained,
            factors: self.problem.factors(),
            inactive: self.at.inactive,
            inactive_factors: self.problem.inactive_factors(),
            rejected: vec![],
            times,
            history: std::mem::take(&mut self.history),
        }
    }
}
