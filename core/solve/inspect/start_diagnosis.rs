//! Diagnosis of the initial values of a solve.
use crate::inspect::CovarianceError;
use crate::outcome::{InactiveFactor, UnconstrainedVariables, Undetermined};
use crate::problem::Problem;
use serde::Serialize;

/// Above this number of variables, the linear system is not analysed, since that takes several
/// factorizations.
const MAX_ANALYSED_VARIABLES: usize = 50_000;
/// Condition number above which a solution keeps few of its sixteen digits.
const WEAK_CONDITION: f64 = 1e10;

/// Diagnosis of the initial values of a solve. Only `not_finite` is an error.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct StartDiagnosis {
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
    #[serde(rename = "untouched", skip_serializing_if = "Option::is_none")]
    pub unconstrained: Option<UnconstrainedVariables>,
    /// An undetermined direction, such as a gauge freedom, or the depth of an object with a single view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
    /// A direction that is almost undetermined, for example because of a small parallax.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weak: Option<WeakDirection>,
}

/// The direction with the weakest constraint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WeakDirection {
    /// See [`Problem::condition`].
    pub condition: f64,
    /// The direction.
    pub direction: Undetermined,
}

impl Problem {
    /// Diagnoses the estimate as the start of a solve. Skips the search for weak and undetermined
    /// directions above 50,000 variables, and if a factor is not finite or a variable has no factor.
    pub fn diagnose_start(&mut self) -> StartDiagnosis {
        let evaluation = self.linearize();
        let named = |factor: usize| InactiveFactor {
            factor,
            name: self.model.factors[factor].label(),
            keys: self.model.keys(factor),
        };
        let not_finite = evaluation.not_finite.map(named);
        let mut found = StartDiagnosis {
            cost: evaluation.cost,
            inactive: evaluation.inactive,
            inactive_factors: self.inactive_factors(),
            not_finite,
            unconstrained: self.unconstrained(),
            undetermined: None,
            weak: None,
        };
        let is_sound = found.not_finite.is_none() && found.unconstrained.is_none();
        if is_sound && self.dim() > 0 && self.model.variables.len() <= MAX_ANALYSED_VARIABLES {
            match self.factorized() {
                Ok(mut system) => {
                    found.weak = system.weakest().filter(|weak| weak.condition > WEAK_CONDITION);
                }
                Err(CovarianceError::Indeterminate(open)) => found.undetermined = Some(open),
                Err(_) => {}
            }
        }
        found
    }
}
