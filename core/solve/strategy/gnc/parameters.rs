//! Settings that have a domain.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A setting outside its domain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BadParameter {
    /// Not a probability.
    #[error("expected a probability above 0 and below 1, got {0}")]
    Probability(f64),
    /// Nothing that a schedule could grow by.
    #[error("expected a finite factor of at least 1.01, got {0}")]
    Growth(f64),
}

/// A number between 0 and 1, neither of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "f64", into = "f64")]
#[schemars(with = "f64", extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
pub struct Probability(f64);

impl Probability {
    /// The squared norm that as many standard normal numbers as there are `rows` stay below with this probability.
    pub fn chi_squared(self, rows: usize) -> f64 {
        // with the number of rows above zero there is a distribution
        ChiSquared::new(rows.max(1) as f64).map_or(f64::INFINITY, |chi| chi.inverse_cdf(self.0))
    }
}

impl Default for Probability {
    fn default() -> Self {
        Self(0.99)
    }
}

impl TryFrom<f64> for Probability {
    type Error = BadParameter;
    fn try_from(p: f64) -> Result<Self, BadParameter> {
        if p > 0.0 && p < 1.0 { Ok(Self(p)) } else { Err(BadParameter::Probability(p)) }
    }
}

impl From<Probability> for f64 {
    fn from(p: Probability) -> f64 {
        p.0
    }
}

/// A factor above 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "f64", into = "f64")]
#[schemars(with = "f64", extend("minimum" = 1.01))]
pub struct Growth(f64);

impl Growth {
    pub(super) fn get(self) -> f64 {
        self.0
    }
}

impl Default for Growth {
    fn default() -> Self {
        Self(2.0)
    }
}

impl TryFrom<f64> for Growth {
    type Error = BadParameter;
    fn try_from(factor: f64) -> Result<Self, BadParameter> {
        if factor >= 1.01 && factor.is_finite() {
            Ok(Self(factor))
        } else {
            Err(BadParameter::Growth(factor))
        }
    }
}

impl From<Growth> for f64 {
    fn from(growth: Growth) -> f64 {
        growth.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (p, rows, quantile) in
            [(0.99, 1, 6.634_897), (0.99, 3, 11.344_867), (0.99, 6, 16.811_894), (0.95, 2, 5.991_465)]
        {
            let found = Probability(p).chi_squared(rows);
            assert!((found - quantile).abs() < 1e-5, "{found} {quantile}");
        }
    }

    #[test]
    fn settings_outside_their_domain_are_refused() {
        for (document, expected) in [
            (r#"{"type": "gnc", "probability": 1.0}"#, "expected a probability above 0 and below 1, got 1"),
            (r#"{"type": "gnc", "step": 1.0}"#, "expected a finite factor of at least 1.01, got 1"),
            (r#"{"type": "gnc", "threshold": 0.0}"#, "expected a finite number above zero, got 0"),
            (r#"{"type": "gnc", "types": ["betwen"]}"#, "there is no factor `betwen`"),
        ] {
            let error = serde_json::from_str::<Box<dyn crate::Optimizer>>(document).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
