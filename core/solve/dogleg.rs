//! Powell's dogleg: a trust region between the gradient and the Gauss-Newton step.
use crate::diagnose::undetermined;
use crate::linear_solver::LinearSolver;
use crate::observer::Observer;
use crate::optimizer::{Optimizer, Session, Step, Stopping, Tried};
use crate::outcome::Outcome;
use crate::problem::Problem;
use crate::system::{dot, norm};
use crate::termination::{Stall, Termination, Tolerance};
use manifactor_graph::checked::Positive;
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Steps within a trust region, each of which lowers the cost.
///
/// The step is the Gauss-Newton step where that is within the radius, else the point on the path from
/// the minimum along the gradient to it. Lengths are measured by √diag H, so that radians and metres
/// compare. A refused step costs neither a linearization nor a factorization.
///
/// ```toml
/// solver = { type = "dogleg", stop = { max_iterations = 50 } }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Dogleg {
    /// Radius of the first step, in standard deviations; the length of the first Gauss-Newton step,
    /// where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial_radius: Option<Positive>,
    /// When to stop.
    pub stop: Stopping,
    /// How the linear system of each step is solved.
    pub linear: LinearSolver,
}

/// Least share of the predicted decrease that makes a step good enough to take.
const GAIN: f64 = 1e-4;

#[typetag::serialize(name = "dogleg")]
impl Optimizer for Dogleg {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn solve(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let mut session = match Session::begin(problem, &self.stop, observer) {
            Ok(session) => session,
            Err(outcome) => return *outcome,
        };
        let termination = self.iterate(&mut session);
        session.end(termination, None)
    }
}
register!(dyn Optimizer, "dogleg", Dogleg);

/// Both ends of the path, and the measure of length.
#[derive(Default)]
struct Path {
    scale: Vec<f64>,
    newton: Vec<f64>,
    cauchy: Vec<f64>,
}

impl Path {
    fn new(problem: &mut Problem) -> Self {
        let mut path = Self::default();
        problem.diagonal(&mut path.scale);
        path.scale.iter_mut().for_each(|d| *d = d.max(1e-12));
        problem.newton_step(&mut path.newton);
        // steepest descent where lengths are measured by the diagonal: -D⁻¹g
        path.cauchy = problem.g.iter().zip(&path.scale).map(|(g, d)| -g / d).collect();
        let curvature = dot(&path.cauchy, &problem.multiply(&path.cauchy));
        let length = -dot(&path.cauchy, &problem.g) / curvature.max(f64::MIN_POSITIVE);
        path.cauchy.iter_mut().for_each(|x| *x *= length);
        path
    }
    fn inner(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.scale).map(|((a, b), d)| a * b * d).sum()
    }
    fn length(&self, a: &[f64]) -> f64 {
        self.inner(a, a).sqrt()
    }
    /// The point of the path at this distance, or its end.
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
    fn iterate(&self, session: &mut Session<'_>) -> Termination {
        let mut radius = self.initial_radius.map(Positive::get);
        'linearized: loop {
            if let Some(termination) = session.finished() {
                return termination;
            }
            session.iterations += 1;
            let factorized = session.problem.factorize(None);
            if let Some(direction) = undetermined(session.problem, factorized.is_err(), 0.0) {
                return Termination::Indeterminate(direction);
            }
            if factorized.is_err() && !regularize(session.problem) {
                return Termination::Stalled { reason: Stall::Damping };
            }
            let path = Path::new(session.problem);
            let mut within = radius.unwrap_or_else(|| path.length(&path.newton));
            loop {
                let delta = path.point(within);
                let (g, length) = (dot(&delta, &session.problem.g), path.length(&delta));
                let predicted = -g - 0.5 * dot(&delta, &session.problem.multiply(&delta));
                let step = Step { predicted, norm: norm(&delta), control: within };
                let tried = session.attempt(&delta, &step);
                let accepted = matches!(tried, Tried::Lower { gain } if gain > GAIN);
                session.record(&step, accepted);
                if let (true, Tried::Lower { gain }) = (accepted, &tried) {
                    radius = Some(match *gain {
                        gain if gain > 0.75 => within.max(3.0 * length),
                        gain if gain < 0.25 => 0.5 * within,
                        _ => within,
                    });
                    match session.take(&step) {
                        Some(termination) => return termination,
                        None => continue 'linearized,
                    }
                }
                if !matches!(tried, Tried::Undefined) && session.settled(&step) {
                    return Termination::Converged { reason: Tolerance::RelativeCost };
                }
                if step.norm <= session.stop.step {
                    return Termination::Stalled { reason: session.stall(Stall::TrustRegion) };
                }
                if session.interrupted() {
                    return Termination::Interrupted;
                }
                within = 0.5 * within.min(length);
            }
        }
    }
}

/// Factorizes with just enough added to the diagonal; whether that was possible.
fn regularize(problem: &mut Problem) -> bool {
    let mut diagonal = vec![];
    problem.diagonal(&mut diagonal);
    [1e-12, 1e-9, 1e-6, 1e-3].into_iter().any(|share| {
        let added: Vec<f64> = diagonal.iter().map(|d| share * d.max(1e-6)).collect();
        problem.factorize(Some(&added)).is_ok()
    })
}
