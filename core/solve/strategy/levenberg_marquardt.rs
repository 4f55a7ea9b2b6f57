//! Levenberg-Marquardt: steps damped along the diagonal of H.
use crate::inspect::null_space::undetermined;
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::outcome::{Termination, Tolerance};
use crate::problem::Problem;
use crate::strategy::descent::{Descent, TrialResult, TrialStep};
use crate::strategy::optimizer::{Optimizer, Stopping};
use manifactor_graph::checked::{OneOrMore, Positive};
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Damped steps, each of which lowers the cost: (H + λ diag H) δ = -g.
///
/// λ follows Nielsen's rule: it falls by a factor of up to `decrease` after a step that agrees with the
/// model, and rises after other steps. A rejected step costs a factorization, not a linearization. If only
/// damping constrains a direction, the outcome reports it as undetermined.
///
/// ```toml
/// solver = { type = "levenberg_marquardt", initial_lambda = 1e-5, stop = { relative_cost = 1e-6 } }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LevenbergMarquardt {
    /// Damping of the first step, as a share of the diagonal.
    pub initial_lambda: Positive,
    /// Minimum damping.
    pub min_lambda: Positive,
    /// Maximum damping, at which a solve gives up.
    pub max_lambda: Positive,
    /// Largest factor by which a successful step lowers the damping.
    pub decrease: OneOrMore,
    /// Lower and upper bound of the diagonal entries for damping.
    pub diagonal: DiagonalLimits,
    /// Stopping criteria.
    pub stop: Stopping,
    /// Solver of the linear system of each step.
    pub linear: LinearSolver,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self {
            initial_lambda: Positive::literal(1e-5),
            min_lambda: Positive::literal(1e-15),
            max_lambda: Positive::literal(1e12),
            decrease: OneOrMore::literal(10.0),
            diagonal: DiagonalLimits { least: 1e-6, most: 1e32 },
            stop: Stopping::default(),
            linear: LinearSolver::default(),
        }
    }
}

/// Lower and upper bound of the diagonal entries for damping: two numbers, 0 ≤ least ≤ most.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "[f64; 2]", into = "[f64; 2]")]
#[schemars(with = "[f64; 2]")]
pub struct DiagonalLimits {
    least: f64,
    most: f64,
}

/// The error for bounds in the wrong order, or NaN.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected two numbers, 0 ≤ least ≤ most, got [{}, {}]", .0[0], .0[1])]
pub struct NotLimits([f64; 2]);

impl TryFrom<[f64; 2]> for DiagonalLimits {
    type Error = NotLimits;
    fn try_from([least, most]: [f64; 2]) -> Result<Self, NotLimits> {
        if 0.0 <= least && least <= most { Ok(Self { least, most }) } else { Err(NotLimits([least, most])) }
    }
}

impl From<DiagonalLimits> for [f64; 2] {
    fn from(DiagonalLimits { least, most }: DiagonalLimits) -> Self {
        [least, most]
    }
}

impl DiagonalLimits {
    /// Equal damping in every direction, instead of the diagonal.
    pub const EVEN: Self = Self { least: 1.0, most: 1.0 };
}

/// A step is accepted if it reaches this share of the predicted decrease.
const MIN_GAIN: f64 = 1e-4;
/// Minimum λ after a rejected step, because a smaller λ changes the step by almost nothing.
const MIN_RAISED_LAMBDA: f64 = 1e-3;
/// λ above which a small step alone does not indicate a minimum.
const MAX_TRUSTED_LAMBDA: f64 = 1.0;
/// Share of the slope due to damping above which damping holds the step back. With bounds, the damping
/// diagonal may far exceed that of H.
const HELD_BACK_SHARE: f64 = 0.5;
/// A step that damping holds back does not end the solve if an undamped step predicts a decrease above this
/// share of the cost. Smaller decreases come from nearly undetermined directions, along which the steps
/// would never end.
const HELD_BACK_DECREASE: f64 = 1e-3;
/// Share of the slope due to damping above which damping may hold back a step in one of many directions,
/// such as a landmark along its ray. The limit for the predicted decrease is then
/// `SLIGHTLY_HELD_BACK_DECREASE`, because an undamped step may diverge in the remaining directions.
const SLIGHTLY_HELD_BACK_SHARE: f64 = 1e-6;
const SLIGHTLY_HELD_BACK_DECREASE: f64 = 0.5;
/// λ up to which one small step means convergence; above, two in a row are required.
const MAX_LIGHT_LAMBDA: f64 = 1e-2;

#[typetag::serialize(name = "levenberg_marquardt")]
impl Optimizer for LevenbergMarquardt {
    fn linear(&self) -> LinearSolver {
        self.linear.clone()
    }

    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let DiagonalLimits { least, most } = self.diagonal;
        self.solve_within(&|descent| [least * descent.unit(), most], problem, observer)
    }
}
register!(dyn Optimizer, "levenberg_marquardt", LevenbergMarquardt);

/// Lower and upper bound of the diagonal entries for damping, at a linearization.
pub(crate) type Bounds<'a> = &'a dyn Fn(&Descent<'_>) -> [f64; 2];

impl LevenbergMarquardt {
    /// Like `descend`, with bounds of the diagonal that may depend on the cost.
    pub(crate) fn solve_within(
        &self,
        bounds: Bounds<'_>,
        problem: &mut Problem,
        observer: &mut dyn Observer,
    ) -> Outcome {
        let mut descent = match Descent::begin(problem, &self.stop, observer) {
            Ok(descent) => descent,
            Err(outcome) => return *outcome,
        };
        let mut lambda = *self.initial_lambda;
        let termination = loop {
            let termination = self.iterate(&mut descent, &mut lambda, bounds);
            if !descent.leave_stationary_point(&termination) {
                break termination;
            }
            lambda = *self.initial_lambda;
        };
        // damping hides undetermined directions; by now it is small enough to detect them
        let open = match termination {
            Termination::Interrupted | Termination::NonFinite { .. } => None,
            _ if descent.iterations == 0 => None,
            _ => {
                undetermined(descent.problem, descent.is_refactorized, lambda * descent.problem.dim() as f64)
            }
        };
        descent.account(termination, open)
    }

    fn iterate(&self, descent: &mut Descent<'_>, lambda: &mut f64, bounds: Bounds<'_>) -> Termination {
        let (mut rise, mut small_before) = (2.0, false);
        let (mut step, mut damping) = (TrialStep::default(), vec![]);
        'linearized: loop {
            if let Some(termination) = descent.next() {
                return termination;
            }
            loop {
                let [least, most] = bounds(descent);
                damping.clear();
                damping.extend(descent.problem.system.diagonal().map(|d| *lambda * d.max(least).min(most)));
                step.control = *lambda;
                if descent.damped(&damping, &mut step) {
                    let is_trusted = step.control <= MAX_TRUSTED_LAMBDA;
                    let doubt = match step.damped {
                        damped if damped > HELD_BACK_SHARE => Some(HELD_BACK_DECREASE),
                        damped if damped > SLIGHTLY_HELD_BACK_SHARE => Some(SLIGHTLY_HELD_BACK_DECREASE),
                        _ => None,
                    };
                    let tried = descent.attempt(&step);
                    let accepted = matches!(tried, TrialResult::Lower { gain } if gain > MIN_GAIN);
                    descent.record(&step, accepted);
                    if let (true, TrialResult::Lower { gain }) = (accepted, &tried) {
                        let fall = (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / *self.decrease).min(1.0);
                        (*lambda, rise) = ((*lambda * fall).max(*self.min_lambda), 2.0);
                        let ended = descent.accept(&step);
                        // a step that is small because of damping does not show convergence
                        let small = ended.is_some() && is_trusted;
                        match ended {
                            Some(_)
                                if doubt.is_some_and(|share| descent.predicts_decrease(&mut step, share)) =>
                            {
                                small_before = false;
                            }
                            Some(termination)
                                if small
                                    && (small_before || step.control <= MAX_LIGHT_LAMBDA)
                                    && descent.ends(&termination, descent.change()) =>
                            {
                                return termination;
                            }
                            Some(termination) if !is_trusted && descent.is_at_rest(&mut step) => {
                                return termination;
                            }
                            _ => small_before = small,
                        }
                        continue 'linearized;
                    }
                    let reason =
                        if !matches!(tried, TrialResult::Undefined) && descent.shows_no_decrease(&step) {
                            Some(Tolerance::RelativeCost)
                        } else if descent.is_short(&step) && !descent.is_steep() {
                            Some(Tolerance::Step)
                        } else {
                            None
                        };
                    if let Some(reason) = reason.filter(|_| is_trusted && !step.is_clipped)
                        && !doubt.is_some_and(|share| descent.predicts_decrease(&mut step, share))
                    {
                        let settled = Termination::Converged { reason };
                        if descent.ends(&settled, step.predicted) {
                            return settled;
                        }
                    }
                }
                if descent.interrupted() {
                    return Termination::Interrupted;
                }
                (*lambda, rise) = ((*lambda * rise).max(MIN_RAISED_LAMBDA), rise * 2.0);
                if *lambda > *self.max_lambda {
                    return match descent.is_at_rest(&mut step) {
                        true => Termination::Converged { reason: Tolerance::RelativeCost },
                        false => descent.stalled(),
                    };
                }
            }
        }
    }
}
