//! Powell's dogleg: a trust region between the gradient and the Gauss-Newton step.
use crate::linear::settings::LinearSolver;
use crate::linear::system::{dot, norm};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::outcome::{Stall, Termination, Tolerance};
use crate::problem::Problem;
use crate::strategy::descent::{Descent, TrialResult, TrialStep};
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::checked::Positive;
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Steps within a trust region, each of which lowers the cost.
///
/// Within the radius, the step is the Gauss-Newton step. Otherwise it is the point at the radius on the
/// path to that step by way of the minimum along the gradient. Lengths are scaled by √diag H, which makes
/// radians and metres comparable. A rejected step costs neither a linearization nor a factorization. The
/// solver does not move along an undetermined direction; the outcome reports it.
///
/// ```toml
/// solver = { type = "dogleg", stop = { max_iterations = 50 } }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Dogleg {
    /// Radius of the first step, in standard deviations. Default: the length of the first Gauss-Newton
    /// step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial_radius: Option<Positive>,
    /// Stopping criteria.
    pub stop: Stopping,
    /// Solver of the linear system of each step.
    pub linear: LinearSolver,
}

/// A step is accepted if it reaches this share of the predicted decrease.
const MIN_GAIN: f64 = 1e-4;

#[typetag::serialize(name = "dogleg")]
impl Optimizer for Dogleg {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let mut descent = match Descent::begin(problem, &self.stop, observer) {
            Ok(descent) => descent,
            Err(outcome) => return *outcome,
        };
        let termination = loop {
            let termination = self.iterate(&mut descent);
            if !descent.leave_stationary_point(&termination) {
                break termination;
            }
        };
        let open = descent.undetermined_direction();
        descent.account(termination, open)
    }
}
register!(dyn Optimizer, "dogleg", Dogleg);

/// The dogleg path: its two corners, and the metric for lengths.
#[derive(Default)]
struct Path {
    scale: Vec<f64>,
    newton: Vec<f64>,
    cauchy: Vec<f64>,
}

impl Path {
    fn new(problem: &Problem, newton: &[f64]) -> Self {
        let mut path = Self { newton: newton.to_vec(), ..Self::default() };
        path.scale.extend(problem.system.diagonal());
        let least = match problem.system.largest() {
            largest if largest > 0.0 => 1e-12 * largest.min(1.0),
            _ => 1e-12,
        };
        path.scale.iter_mut().for_each(|d| *d = d.max(least));
        // steepest descent in the metric of the diagonal: -D⁻¹g
        path.cauchy = problem.system.g.iter().zip(&path.scale).map(|(g, d)| -g / d).collect();
        let curvature = dot(&path.cauchy, &problem.system.multiply(&path.cauchy));
        let length = -dot(&path.cauchy, &problem.system.g) / curvature.max(f64::MIN_POSITIVE);
        path.cauchy.iter_mut().for_each(|x| *x *= length);
        path
    }
    fn inner(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.scale).map(|((a, b), d)| a * b * d).sum()
    }
    fn length(&self, a: &[f64]) -> f64 {
        self.inner(a, a).sqrt()
    }
    /// Returns the point of the path at this distance, or its end.
    fn point(&self, radius: f64) -> Vec<f64> {
        if self.length(&self.newton) <= radius {
            return self.newton.clone();
        }
        let cauchy = self.length(&self.cauchy);
        if cauchy >= radius {
            return self.cauchy.iter().map(|x| x * radius / cauchy).collect();
        }
        // ‖c + t (n - c)‖ = radius
        let leg: Vec<f64> = self.newton.iter().zip(&self.cauchy).map(|(n, c)| n - c).collect();
        let (a, b) = (self.inner(&leg, &leg), self.inner(&self.cauchy, &leg));
        let c = cauchy * cauchy - radius * radius;
        let t = (-c) / (b + (b * b - a * c).max(0.0).sqrt());
        self.cauchy.iter().zip(&leg).map(|(c, l)| c + t * l).collect()
    }
}

impl Dogleg {
    fn iterate(&self, descent: &mut Descent<'_>) -> Termination {
        let mut radius = self.initial_radius.map(Positive::get);
        let mut newton = TrialStep::default();
        'linearized: loop {
            if let Some(termination) = descent.next() {
                return termination;
            }
            if !descent.undamped(&mut newton) {
                return descent.stalled();
            }
            let path = Path::new(descent.problem, &newton.delta);
            let whole = path.length(&path.newton);
            // predicted decrease of the whole step; if it is negligible, so is that of a shorter one
            let promises = !descent.is_small(newton.predicted);
            let mut within = radius.unwrap_or(whole);
            loop {
                // a step that is small because of the radius does not show convergence
                let is_cut = promises && within < whole;
                let mut delta = path.point(within);
                let is_clipped = descent.problem.clip(&mut delta) || newton.is_clipped;
                let length = path.length(&delta);
                let step = TrialStep {
                    predicted: descent.problem.system.predicted_decrease(&delta),
                    is_clipped,
                    norm: norm(&delta),
                    control: within,
                    delta,
                    ..TrialStep::default()
                };
                let tried = descent.attempt(&step);
                let accepted = matches!(tried, TrialResult::Lower { gain } if gain > MIN_GAIN);
                descent.record(&step, accepted);
                if let (true, TrialResult::Lower { gain }) = (accepted, &tried) {
                    radius = Some(match *gain {
                        gain if gain > 0.75 => within.max(3.0 * length),
                        gain if gain < 0.25 => 0.5 * within,
                        _ => within,
                    });
                    match descent.accept(&step) {
                        Some(termination) if !is_cut && descent.ends(&termination, descent.change()) => {
                            return termination;
                        }
                        _ => continue 'linearized,
                    }
                }
                let may_settle = !is_cut && !step.is_clipped;
                if may_settle && !matches!(tried, TrialResult::Undefined) && descent.shows_no_decrease(&step)
                {
                    let settled = Termination::Converged { reason: Tolerance::RelativeCost };
                    if descent.ends(&settled, step.predicted) {
                        return settled;
                    }
                }
                if descent.is_short(&step) {
                    return match is_cut || descent.is_steep() {
                        true => descent.stalled_by(Stall::TrustRegion),
                        false => Termination::Converged { reason: Tolerance::Step },
                    };
                }
                if descent.interrupted() {
                    return Termination::Interrupted;
                }
                within = 0.5 * within.min(length);
            }
        }
    }
}
