//! What stands out at the values that a solve is to begin with.
use crate::inspect::CovarianceError;
use crate::outcome::{InactiveFactor, Undetermined, Untouched};
use crate::problem::Problem;
use serde::Serialize;

/// Variables up to which the linear system is looked at: it takes some factorizations.
const LARGE: usize = 50_000;
/// A condition number from which on a solution has few digits left of sixteen.
const WEAK: f64 = 1e10;

/// What stands out at the values that a solve is to begin with. None of it is an error but a factor that is not finite.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AtStart {
    /// ½ Σ ρ over the factors that are defined there.
    pub cost: f64,
    /// Number of factors that are not defined there, and the first of them.
    pub inactive: usize,
    /// See `inactive`.
    pub inactive_factors: Vec<InactiveFactor>,
    /// A factor that is defined there, and whose residual or derivative is not finite all the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_finite: Option<InactiveFactor>,
    /// Variables that no factor touches which is defined there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untouched: Option<Untouched>,
    /// A direction that nothing constrains there: a gauge that is not held, an object that is seen from one place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
    /// A direction that next to nothing constrains there: too small a parallax, say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weak: Option<Weak>,
}

/// The direction that is constrained least.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Weak {
    /// See [`Problem::condition`].
    pub condition: f64,
    /// The direction.
    pub direction: Undetermined,
}

impl Problem {
    /// Looks at the estimate as the start of a solve. Directions are not looked for among more than 50,000 variables, nor where
    /// something is not finite or untouched.
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
