//! Diagnosis of the initial values of a solve.
use crate::inspect::CovarianceError;
use crate::outcome::{InactiveFactor, Undetermined, Untouched};
use crate::problem::Problem;
use serde::Serialize;

/// Above this number of variables, the linear system is not analysed, since that takes several
/// factorizations.
const LARGE: usize = 50_000;
/// Condition number above which a solution keeps few of its sixteen digits.
const WEAK: f64 = 1e10;

/// Diagnosis of the initial values of a solve. Only `not_finite` is an error.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AtStart {
    /// ½ Σ ρ over the factors that are defined at these values.
    pub cost: f64,
    /// Number of factors that are undefined at these values.
    pub inactive: usize,
    /// The first of these undefined factors.
    pub inactive_factors: Vec<InactiveFactor>,
    /// A factor that is defined, although its residual or derivative is not finite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_finite: Option<InactiveFactor>,
    /// Variables without a factor that is defined at these values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untouched: Option<Untouched>,
    /// An undetermined direction, such as a gauge freedom, or the depth of an object with a single view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
    /// A direction that is almost undetermined, for example because of a small parallax.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weak: Option<Weak>,
}

/// The direction with the weakest constraint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Weak {
    /// See [`Problem::condition`].
    pub condition: f64,
    /// The direction.
    pub direction: Undetermined,
}

impl Problem {
    /// Diagnoses the estimate as the start of a solve. Skips the search for weak and undetermined
    /// directions above 50,000 variables, and if a factor is not finite or a variable has no factor.
    pub fn at_start(&mut self) -> AtStart {
        let evaluation = self.linearize();
        let named = |factor: usize| InactiveFactor {
            factor,
            name: self.model.factors[factor].label(),
            keys: self.model.keys(factor),
        };
        let not_finite = evaluation.not_finite.map(named);
        let mut found = AtStart {
            cost: evaluation.cost,
            inactive: evaluation.inactive,
            inactive_factors: self.inactive_factors(),
            not_finite,
            untouched: self.untouched(),
            undetermined: None,
            weak: None,
        };
        let is_sound = found.not_finite.is_none() && found.untouched.is_none();
        if is_sound && self.dim() > 0 && self.model.variables.len() <= LARGE {
            match self.factorized() {
                Ok(mut system) => found.weak = system.weakest().filter(|weak| weak.condition > WEAK),
                Err(CovarianceError::Indeterminate(open)) => found.undetermined = Some(open),
                Err(_) => {}
            }
        }
        found
    }
}
