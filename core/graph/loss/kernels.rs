//! The built-in losses. `scale` is in σ's, the units of the whitened residual, so it is dimensionless.
use super::RobustLoss;
use crate::register_loss;
use crate::registry::checked::Positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An equality constraint: the residual has to be zero. Its noise gives the unit in which a violation is measured.
///
/// A solve minimizes the cost of the other factors subject to all constraints, by the method of multipliers, and the
/// outcome has the multipliers. A constraint has to be possible: one between two fixed variables, or two that
/// contradict each other, end the solve without a result.
///
/// ```toml
/// loss = { type = "constraint" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Constraint {}
impl RobustLoss for Constraint {
    /// The penalty for a violation; solvers scale and shift it.
    #[inline]
    fn rho(&self, s: f64) -> (f64, f64) {
        (s, 1.0)
    }
    fn tempered(&self, _: Positive) -> Option<Self> {
        Some(self.clone())
    }
}
register_loss!("constraint", Constraint);

/// Declares a loss with one scale: docs, default, ρ, and the scale of ρ(τs)/τ as a function of (k, τ). The
/// latter is k/√τ by default, for scales in σ's.
macro_rules! loss {
    ($(#[$doc:meta])* $type:ident, $name:literal, $scale:literal, |$s:ident, $k:ident| $rho:expr) => {
        loss! { $(#[$doc])* $type, $name, $scale, |$s, $k| $rho, |k, tau| k / tau.sqrt() }
    };
    ($(#[$doc:meta])* $type:ident, $name:literal, $scale:literal, |$s:ident, $k:ident| $rho:expr, $tempered:expr) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $type {
            /// The scale k of the formula above, in σ's unless the text says otherwise.
            pub scale: Positive,
        }
        impl $type {
            /// A loss of this scale.
            ///
            /// # Errors
            /// If `scale` is not positive and finite.
            pub fn new(scale: f64) -> Result<Self, crate::registry::checked::OutOfDomain> {
                Ok(Self { scale: Positive::new(scale)? })
            }
        }
        impl Default for $type {
            fn default() -> Self {
                Self { scale: Positive::literal($scale) }
            }
        }
        impl RobustLoss for $type {
            #[inline]
            fn rho(&self, $s: f64) -> (f64, f64) {
                let $k = self.scale.get();
                $rho
            }
            fn tempered(&self, tau: Positive) -> Option<Self> {
                let scale: fn(f64, f64) -> f64 = $tempered;
                // a scale that underflows is left to the wrapper
                Self::new(scale(self.scale.get(), tau.get())).ok()
            }
        }
        register_loss!($name, $type);
    };
}

/// No robustness: ρ = s. Equivalent to no loss.
///
/// ```toml
/// loss = { type = "l2" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct L2 {}
impl RobustLoss for L2 {
    #[inline]
    fn rho(&self, s: f64) -> (f64, f64) {
        (s, 1.0)
    }
    fn tempered(&self, _: Positive) -> Option<Self> {
        Some(self.clone())
    }
}
register_loss!("l2", L2);

/// Below √s = k times this share, [`L1`] is a parabola.
const PARABOLA_SHARE: f64 = 1e-6;

loss! {
    /// The norm instead of its square: ρ = 2k√s.
    ///
    /// The scale is the slope: half the cost of one more σ. The weight k/√s has no bound; below √s = 1e-6 k
    /// the loss continues as a parabola with the slope at that point.
    ///
    /// ```toml
    /// loss = { type = "l1" }
    /// ```
    L1, "l1", 1.0, |s, k| {
        let r = s.sqrt();
        let small = PARABOLA_SHARE * k;
        if r < small { (s / PARABOLA_SHARE, 1.0 / PARABOLA_SHARE) } else { (k * (2.0 * r - small), k / r) }
    }
}

loss! {
    /// Squares up to the scale k, linear beyond: ρ = s for √s ≤ k, 2k√s - k² beyond.
    ///
    /// ```toml
    /// loss = { type = "huber", scale = 1.345 }
    /// ```
    Huber, "huber", 1.345, |s, k| {
        let r = s.sqrt();
        if r <= k { (s, 1.0) } else { (2.0 * k * r - k * k, k / r) }
    }
}

loss! {
    /// Grows with the logarithm: ρ = k² ln(1 + s/k²).
    ///
    /// ```toml
    /// loss = { type = "cauchy", scale = 1.0 }
    /// ```
    Cauchy, "cauchy", 1.0, |s, k| {
        let k2 = k * k;
        (k2 * (s / k2).ln_1p(), 1.0 / (1.0 + s / k2))
    }
}

loss! {
    /// Ignores residuals beyond the scale: ρ = k²/3 (1 - (1 - s/k²)³) up to √s = k, k²/3 beyond.
    ///
    /// ```toml
    /// loss = { type = "tukey", scale = 4.685 }
    /// ```
    Tukey, "tukey", 4.685, |s, k| {
        let k2 = k * k;
        let x = s / k2;
        // s (1 - x + x²/3) is equal to the formula above, and stays accurate for small x
        if x < 1.0 { (s * (1.0 - x + x * x / 3.0), (1.0 - x) * (1.0 - x)) } else { (k2 / 3.0, 0.0) }
    }
}

loss! {
    /// Saturates at k²: ρ = k² s / (k² + s).
    ///
    /// ```toml
    /// loss = { type = "geman_mcclure", scale = 1.0 }
    /// ```
    GemanMcClure, "geman_mcclure", 1.0, |s, k| {
        let k2 = k * k;
        let u = k2 / (k2 + s);
        (s * u, u * u)
    }
}

loss! {
    /// Saturates at k², faster: ρ = k² (1 - exp(-s/k²)).
    ///
    /// ```toml
    /// loss = { type = "welsch", scale = 2.985 }
    /// ```
    Welsch, "welsch", 2.985, |s, k| {
        let k2 = k * k;
        (-k2 * (-s / k2).exp_m1(), (-s / k2).exp())
    }
}

loss! {
    /// Between squares and the norm: ρ = 2k² (√s/k - ln(1 + √s/k)).
    ///
    /// ```toml
    /// loss = { type = "fair", scale = 1.4 }
    /// ```
    Fair, "fair", 1.4, |s, k| {
        let u = s.sqrt() / k;
        // for small u the difference loses its digits, so the series ρ = s (1 - 2u/3 + u²/2 - …) is used
        let rho = if u < 1e-4 { s * (1.0 - u * (2.0 / 3.0) + u * u * 0.5) } else { 2.0 * k * k * (u - u.ln_1p()) };
        (rho, 1.0 / (1.0 + u))
    }
}

loss! {
    /// Dynamic covariance scaling: squares up to s = k, weight (2k/(k + s))² beyond.
    ///
    /// Unlike in the other losses, the scale Φ = k is in units of s, i.e. squared σ's (Agarwal et al., ICRA
    /// 2013, eq. 15). The paper gives only a weight. The cost is its integral: ρ = k (3s - k)/(k + s)
    /// beyond k, which saturates at 3k.
    ///
    /// ```toml
    /// loss = { type = "dcs", scale = 1.0 }
    /// ```
    Dcs, "dcs", 1.0, |s, k| {
        let z = 2.0 * k / (k + s);
        if s <= k { (s, 1.0) } else { (k * (3.0 - 2.0 * z), z * z) }
    }, |k, tau| k / tau
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::Loss;
    use proptest::prelude::*;

    fn all(k: f64) -> Vec<Box<dyn Loss>> {
        vec![
            Box::new(L2 {}),
            Box::new(L1::new(k).unwrap()),
            Box::new(Huber::new(k).unwrap()),
            Box::new(Cauchy::new(k).unwrap()),
            Box::new(Tukey::new(k).unwrap()),
            Box::new(GemanMcClure::new(k).unwrap()),
            Box::new(Welsch::new(k).unwrap()),
            Box::new(Fair::new(k).unwrap()),
            Box::new(Dcs::new(k).unwrap()),
        ]
    }

    proptest! {
        #[test]
        fn weight_is_the_derivative_of_rho(k in 0.05..20.0f64, s in 1e-3..400.0f64) {
            for loss in all(k) {
                let loss = loss.erased();
                let h = 1e-5 * s;
                let numeric = (loss.rho(s + h).0 - loss.rho(s - h).0) / (2.0 * h);
                let (_, weight) = loss.rho(s);
                // second derivatives jump at the scale of Huber and Tukey
                prop_assert!((numeric - weight).abs() < 1e-4 * (1.0 + weight), "{numeric} {weight} {s} {k}");
            }
        }

        #[test]
        fn small_residuals_cost_their_square(k in 0.5..20.0f64, s in 0.0..1e-9f64) {
            for loss in all(k) {
                if loss.typetag_name() != "l1" {
                    let (rho, weight) = loss.erased().rho(s);
                    prop_assert!((rho - s).abs() <= 1e-3 * s && (weight - 1.0).abs() < 1e-3);
                }
            }
        }

        #[test]
        fn cost_never_falls_and_weight_never_rises(k in 0.05..20.0f64, s in 0.0..1e6f64, more in 0.0..1e6f64) {
            for loss in all(k) {
                let ((rho, weight), (rho_more, weight_more)) = (loss.erased().rho(s), loss.erased().rho(s + more));
                prop_assert!(rho_more >= rho * (1.0 - 1e-12) && weight_more <= weight * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn a_residual_of_zero_costs_nothing_and_is_finite() {
        for loss in all(1.0) {
            let (rho, weight) = loss.erased().rho(0.0);
            assert!(rho == 0.0 && weight.is_finite(), "{loss:?}");
        }
    }

    #[test]
    fn a_scale_must_be_positive() {
        for bad in ["-1.0", "0.0", "1e999"] {
            assert!(serde_json::from_str::<Cauchy>(&format!("{{\"scale\":{bad}}}")).is_err());
        }
    }
}
