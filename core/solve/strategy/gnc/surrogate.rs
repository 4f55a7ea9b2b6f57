//! The surrogate costs, which lead from a convex cost to the robust one, and their weights.
//!
//! u is the cost of a factor divided by its inlier bound: u = ‖r‖²/c².
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A robust cost, in units of the inlier bound.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Truncation {
    /// min(u, 1): a factor counts in full or not at all.
    #[default]
    TruncatedLeastSquares,
    /// u / (1 + u): a factor counts the less the worse it fits.
    GemanMcclure,
}

use Truncation::{GemanMcclure, TruncatedLeastSquares};

impl Truncation {
    /// Returns the first μ, for a worst factor with u = `worst`; `None` if no graduation is necessary.
    pub(super) fn first(self, worst: f64) -> Option<f64> {
        match self {
            // remark 5 of the paper: convex up to the worst factor
            TruncatedLeastSquares => Some(2.0 * worst - 1.0).filter(|d| *d > 0.0).map(f64::recip),
            GemanMcclure => Some(2.0 * worst).filter(|mu| *mu > 1.0),
        }
    }

    /// Returns the next μ, `step` times closer to the robust cost; `None` once that is reached.
    pub(super) fn next(self, mu: f64, step: f64) -> Option<f64> {
        match self {
            TruncatedLeastSquares => Some(mu * step).filter(|mu| *mu < self.last()),
            GemanMcclure => Some(mu / step).filter(|mu| *mu > self.last()),
        }
    }

    /// Returns the μ of the robust cost. It is infinite for truncated least squares. The finite value here
    /// changes the cost only within a millionth of u = 1.
    pub(super) fn last(self) -> f64 {
        match self {
            TruncatedLeastSquares => 1e6,
            GemanMcclure => 1.0,
        }
    }

    /// Returns the weight of a factor for this μ: equations 12 and 14.
    pub(super) fn weight(self, mu: f64, u: f64) -> f64 {
        match self {
            TruncatedLeastSquares if u <= mu / (mu + 1.0) => 1.0,
            TruncatedLeastSquares if u >= (mu + 1.0) / mu => 0.0,
            TruncatedLeastSquares => ((mu * (mu + 1.0) / u).sqrt() - mu).clamp(0.0, 1.0),
            GemanMcclure => (mu / (u + mu)).powi(2),
        }
    }

    /// Returns the robust cost.
    pub(super) fn rho(self, u: f64) -> f64 {
        match self {
            TruncatedLeastSquares => u.min(1.0),
            GemanMcclure => u / (1.0 + u),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The surrogates ρ_μ, equations 8 and 10 in units of c².
    fn surrogate(cost: Truncation, mu: f64, u: f64) -> f64 {
        match cost {
            TruncatedLeastSquares if u <= mu / (mu + 1.0) => u,
            TruncatedLeastSquares if u >= (mu + 1.0) / mu => 1.0,
            TruncatedLeastSquares => 2.0 * (u * mu * (mu + 1.0)).sqrt() - mu * (1.0 + u),
            GemanMcclure => mu * u / (mu + u),
        }
    }

    fn both() -> impl Strategy<Value = Truncation> {
        prop_oneof![Just(TruncatedLeastSquares), Just(GemanMcclure)]
    }

    proptest! {
        #[test]
        fn a_weight_is_the_slope_of_its_surrogate(cost in both(), log_mu in -8.0..4.0f64, log_u in -4.0..8.0f64) {
            let (mu, u) = (log_mu.exp(), log_u.exp());
            let h = 1e-6 * u;
            let slope = (surrogate(cost, mu, u + h) - surrogate(cost, mu, u - h)) / (2.0 * h);
            let weight = cost.weight(mu, u);
            prop_assert!((slope - weight).abs() < 1e-3 * (1.0 + weight) * (1.0 + mu.sqrt()), "{slope} {weight}");
        }

        #[test]
        fn the_last_surrogate_is_the_robust_cost(cost in both(), u in 0.0..100.0f64) {
            prop_assert!((surrogate(cost, cost.last(), u) - cost.rho(u)).abs() < 1e-5);
        }

        #[test]
        fn the_schedule_leads_from_almost_all_of_the_worst_to_the_end(cost in both(), worst in 1.0..1e9f64) {
            let mut mu = cost.first(worst);
            // at the start, the second derivative in √u is positive everywhere
            prop_assert!(mu.is_some_and(|mu| cost.weight(mu, worst) > 0.0));
            let mut steps = 0;
            while let Some(now) = mu {
                mu = cost.next(now, 1.4);
                steps += 1;
            }
            prop_assert!(steps < 120);
        }
    }

    #[test]
    fn what_fits_everywhere_needs_no_schedule() {
        assert!(TruncatedLeastSquares.first(0.4).is_none() && GemanMcclure.first(0.4).is_none());
    }
}
