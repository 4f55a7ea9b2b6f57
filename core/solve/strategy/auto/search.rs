//! Search from further starts, if the given values lead to no minimum.
use super::watch::{InDomain, Pause, Watch};
use super::{Auto, INITIAL_DAMPING};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::outcome::Termination;
use crate::problem::Problem;
use crate::strategy::dogleg::Dogleg;
use crate::strategy::optimizer::Optimizer;
use crate::strategy::start::{GivenStart, Start};
use manifactor_document::Node;
use manifactor_graph::catalogue::{self, Kind};
use manifactor_graph::checked::Positive;
use manifactor_graph::{Graph, Values};
use std::cmp::Ordering;
use std::sync::OnceLock;
use std::time::Instant;

/// Damping of the first step after negligible damping has failed.
const RETRY_DAMPING: Positive = Positive::literal(1e-5);

/// Initial values of a solve.
pub(crate) struct Point {
    pub inactive: usize,
    pub cost: f64,
    pub values: Values,
    /// Damping of the first step, if full steps have failed from these values.
    pub damping: Option<Positive>,
}

/// Returns the registered starts with their defaults, except `given`. Created once, because solving a small
/// graph takes less time than creating them.
fn registered() -> &'static [Box<dyn Start>] {
    static REGISTERED: OnceLock<Vec<Box<dyn Start>>> = OnceLock::new();
    REGISTERED.get_or_init(|| {
        let others = catalogue::entries(<dyn Start>::NAME).into_iter().filter(|e| e.name != GivenStart::NAME);
        others.filter_map(|entry| entry.read::<dyn Start>(&Node::empty_table()).ok()).collect()
    })
}

/// Returns the initial values of all registered starts that apply.
pub(crate) fn starts(graph: &Graph, values: &Values, problem: &mut Problem) -> Vec<Point> {
    let mut point = |start: &dyn Start| {
        // a start that does not apply is skipped
        let values = start.initial_values(graph, values).ok()?;
        problem.set_values(&values).ok()?;
        let at = problem.linearize();
        let point = Point { inactive: at.inactive, cost: at.cost, values, damping: None };
        at.not_finite.is_none().then_some(point)
    };
    registered().iter().filter_map(|start| point(&**start)).collect()
}

/// Returns whether a registered start doubts the current minimum.
pub(super) fn is_doubted(graph: &Graph, problem: &Problem) -> bool {
    if registered().is_empty() {
        return false;
    }
    let minimum = problem.values();
    registered().iter().any(|start| start.doubts(graph, &minimum))
}

impl Auto {
    /// Solves from further starts, and continues a paused solve, in ascending order of their costs, until
    /// one leads to a minimum.
    pub(super) fn search(
        &self,
        (graph, values): (&Graph, &Values),
        problem: &mut Problem,
        watch: &mut Watch<'_>,
        mut outcome: Outcome,
    ) -> Outcome {
        let clock = Instant::now();
        let mut best = problem.values();
        // the paused solve comes first, so that it wins a tie
        let mut points = Vec::from_iter(here(watch, &outcome, &best));
        points.extend(starts(graph, values, problem));
        points.sort_by(|a, b| {
            (a.inactive, a.cost).partial_cmp(&(b.inactive, b.cost)).unwrap_or(Ordering::Equal)
        });
        let looking = clock.elapsed().as_secs_f64();
        outcome.times.other += looking;
        outcome.times.total += looking;
        watch.disable_pausing();
        // a start that competes with a known minimum gets at most the iterations that the minimum took
        let is_rival = is_minimum(&outcome.termination);
        let bounded = self.at_most(if is_rival { outcome.iterations } else { usize::MAX });
        for point in points {
            tracing::debug!(cost = point.cost, inactive = point.inactive, "another start");
            problem.model.set_values(&point.values);
            let next = bounded.solve_from(&point, problem, watch);
            let better = (next.inactive, next.final_cost) <= (outcome.inactive, outcome.final_cost);
            let is_settled = is_minimum(&next.termination) && (better || is_rival);
            if better {
                best = problem.values();
            }
            outcome = outcome.then(next, better);
            if watch.stopped || is_settled {
                break;
            }
        }
        if !watch.stopped && !is_minimum(&outcome.termination) {
            // last attempt: a trust region does not damp all directions equally
            problem.model.set_values(values);
            let dogleg = Dogleg { stop: self.stop.clone(), linear: self.linear.clone(), ..Dogleg::default() };
            let next = dogleg.descend(problem, watch);
            let better = is_minimum(&next.termination)
                && (next.inactive, next.final_cost) <= (outcome.inactive, outcome.final_cost);
            if better {
                best = problem.values();
            }
            outcome = outcome.then(next, better);
        }
        problem.model.set_values(&best);
        problem.linearize();
        outcome
    }

    /// Returns a copy of the solver with a bound on its iterations.
    fn at_most(&self, iterations: usize) -> Self {
        let mut bounded = self.clone();
        bounded.stop.max_iterations = iterations.min(self.stop.max_iterations);
        bounded
    }

    /// Solves from a start, with full steps first: from a good start a few suffice, while damped steps
    /// creep along narrow valleys.
    fn solve_from(&self, point: &Point, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        if let Some(damping) = point.damping {
            return self.damped(damping, problem, observer);
        }
        let mut watch = InDomain { observer, has_left: false };
        let outcome = self.full_steps(problem, &mut watch);
        let InDomain { observer, has_left } = watch;
        match outcome.termination {
            Termination::Stalled { .. } => {
                outcome.then(self.damped(INITIAL_DAMPING, problem, observer), true)
            }
            Termination::Interrupted if has_left => {
                outcome.then(self.damped(RETRY_DAMPING, problem, observer), true)
            }
            _ => outcome,
        }
    }
}

/// Returns whether a solve ended at a minimum, of all variables or of those with an active factor.
pub(super) fn is_minimum(termination: &Termination) -> bool {
    matches!(termination, Termination::Converged { .. } | Termination::Indeterminate(_))
}

/// Returns the point at which a solve was paused.
fn here(watch: &Watch<'_>, outcome: &Outcome, values: &Values) -> Option<Point> {
    let damping = match watch.pause? {
        _ if outcome.termination != Termination::Interrupted => return None,
        Pause::Rise { .. } | Pause::Undefined => Some(RETRY_DAMPING),
        Pause::Long { damping } => Positive::new(damping.max(*INITIAL_DAMPING)).ok(),
    };
    let (inactive, cost) = (outcome.inactive, outcome.final_cost);
    Some(Point { inactive, cost, values: values.clone(), damping })
}
