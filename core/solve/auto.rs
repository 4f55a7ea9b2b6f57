//! The default: what needs no tuning.
use crate::compile::CompileError;
use crate::gauss_newton::GaussNewton;
use crate::levenberg_marquardt::LevenbergMarquardt;
use crate::linear_solver::LinearSolver;
use crate::observer::Observer;
use crate::optimizer::{Optimizer, SettingError, Stopping};
use crate::outcome::{IterationRecord, Outcome};
use crate::problem::Problem;
use crate::start::{Given, Start};
use crate::{Solution, Termination};
use manifactor_graph::catalogue::{self, Kind};
use manifactor_graph::{Graph, Values, register};
use manifactor_tree::Node;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::ops::ControlFlow;
use std::time::Instant;

/// Gauss-Newton steps that are damped once one fails, and another start where the first leads nowhere.
///
/// Begins at the given values. Where one of the first steps has to be refused, or the minimum does not fit
/// the stated noise (2F is more than 1.5 times the residual's degrees of freedom), every registered start that
/// applies to the graph is tried, those of the lowest cost first, until one leads to a minimum that fits. The
/// best minimum found is the estimate. Where no start applies, it is Levenberg-Marquardt with next to no damping.
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
const DAMPING: f64 = 1e-10;
/// The same where next to none has been tried.
const REFUSED: f64 = 1e-5;
/// Bounds of the diagonal that is damped by: the same for all directions but weak ones. By the diagonal itself, steps run
/// off along what little constrains, as the size of an object that is seen from one side, and out of factors' domains.
const DIAGONAL: [f64; 2] = [1e-6, 1.0];
/// A step that is refused by this iteration is a sign of a bad start.
const EARLY: usize = 3;
/// 2F by degrees of freedom: about 1 where the noise is as stated, and the minimum the right one.
const MISFIT: f64 = 1.5;

#[typetag::serialize(name = "auto")]
impl Optimizer for Auto {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn check(&self) -> Result<(), SettingError> {
        self.stop.check()?;
        self.linear.check()
    }

    fn solve(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        self.damped(DAMPING).solve(problem, observer)
    }

    fn solve_graph(
        &self,
        graph: &Graph,
        values: &Values,
        observer: &mut dyn Observer,
    ) -> Result<Solution, CompileError> {
        let mut problem = Problem::compile_for(graph, values, &self.linear)?;
        let mut watch = Watch { observer, until: EARLY, refused: false, stopped: false };
        let mut outcome = self.solve(&mut problem, &mut watch);
        let unfinished = watch.refused && !watch.stopped;
        if !unfinished && !leads_nowhere(graph, &problem, &outcome) {
            return Ok(Solution::of(&problem, outcome));
        }
        let clock = Instant::now();
        let mut best = problem.values();
        let (inactive, cost) = (outcome.inactive, outcome.final_cost);
        let here = Point { inactive, cost, values: best.clone(), refused: true };
        // of two alike, where it is already
        let mut points = Vec::from_iter(unfinished.then_some(here));
        points.extend(starts(graph, values, &mut problem));
        points.sort_by(|a, b| {
            (a.inactive, a.cost).partial_cmp(&(b.inactive, b.cost)).unwrap_or(Ordering::Equal)
        });
        let looking = clock.elapsed().as_secs_f64();
        (watch.until, outcome.times.other) = (0, outcome.times.other + looking);
        outcome.times.total += looking;
        for point in points {
            tracing::debug!(cost = point.cost, inactive = point.inactive, "another start");
            problem.put(&point.values);
            let next = match point.refused {
                true => self.damped(REFUSED).solve(&mut problem, &mut watch),
                false => self.full_steps_first(&mut problem, &mut watch),
            };
            let better = (next.inactive, next.final_cost) <= (outcome.inactive, outcome.final_cost);
            if better {
                best = problem.values();
            }
            outcome = outcome.then(next, better);
            if watch.stopped || !leads_nowhere(graph, &problem, &outcome) {
                break;
            }
        }
        problem.put(&best);
        problem.linearize();
        Ok(Solution::of(&problem, outcome))
    }
}
register!(dyn Optimizer, "auto", Auto);

impl Auto {
    /// Damped steps, the first by so much.
    fn damped(&self, initial_lambda: f64) -> LevenbergMarquardt {
        let stop = self.stop.clone();
        LevenbergMarquardt { initial_lambda, diagonal: DIAGONAL, stop, ..Default::default() }
    }

    /// From a good start full steps are there in a few, where damping creeps along narrow valleys.
    fn full_steps_first(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let outcome =
            GaussNewton { stop: self.stop.clone(), linear: self.linear.clone() }.solve(problem, observer);
        match outcome.termination {
            Termination::Stalled { .. } => outcome.then(self.solve(problem, observer), true),
            _ => outcome,
        }
    }
}

/// Values to begin with.
pub(crate) struct Point {
    pub inactive: usize,
    pub cost: f64,
    pub values: Values,
    /// A step from here has been refused.
    pub refused: bool,
}

/// What the registered starts have to offer.
pub(crate) fn starts(graph: &Graph, values: &Values, problem: &mut Problem) -> Vec<Point> {
    let others = catalogue::entries(<dyn Start>::NAME).into_iter().filter(|e| e.name != Given::NAME);
    others
        .filter_map(|entry| {
            let start = entry.read::<dyn Start>(&Node::empty_table()).ok()?;
            // one that does not apply has nothing to offer
            let values = start.start(graph, values).ok()?;
            problem.set_values(&values).ok()?;
            let at = problem.linearize();
            at.not_finite.is_none().then_some(Point {
                inactive: at.inactive,
                cost: at.cost,
                values,
                refused: false,
            })
        })
        .collect()
}

/// Whether another start may do better: no minimum, or one that does not fit the stated noise.
fn leads_nowhere(graph: &Graph, problem: &Problem, outcome: &Outcome) -> bool {
    match outcome.termination {
        Termination::Converged { .. } | Termination::Indeterminate(_) => {
            let rows = graph.factors().iter().map(|f| f.factor.erased().signature().rows.unwrap_or(0));
            let freedom = rows.sum::<usize>().saturating_sub(problem.dim());
            2.0 * outcome.final_cost > MISFIT * freedom as f64
        }
        Termination::MaxIterations | Termination::Stalled { .. } => true,
        // not where the solve began, but where its steps led
        Termination::NonFinite { .. } => outcome.final_cost.is_finite(),
        _ => false,
    }
}

/// Ends a solve where a step is refused early on, or where who watches asks for it.
struct Watch<'a> {
    observer: &'a mut dyn Observer,
    /// Iterations that count as early.
    until: usize,
    refused: bool,
    stopped: bool,
}

impl Observer for Watch<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self.stopped |= self.observer.iteration(record).is_break();
        let refused = !record.accepted && record.iteration <= self.until;
        self.refused |= refused;
        if refused || self.stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
    fn poll(&mut self) -> ControlFlow<()> {
        self.stopped |= self.observer.poll().is_break();
        if self.stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
