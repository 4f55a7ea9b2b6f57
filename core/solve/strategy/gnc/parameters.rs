//! Settings with a domain.
use statrs::distribution::{ChiSquared, ContinuousCDF};

manifactor_graph::number! {
    /// A number strictly between 0 and 1.
    pub Probability: "a probability above 0 and below 1", |p| p > 0.0 && p < 1.0, { "exclusiveMinimum": 0, "exclusiveMaximum": 1 };
    /// A growth factor of at least 1.01.
    pub Growth: "a finite factor of at least 1.01", |x| x >= 1.01 && x < f64::INFINITY, { "minimum": 1.01 };
}

impl Probability {
    /// Returns the χ² quantile: the squared norm of `rows` standard normal numbers is below it with this
    /// probability.
    pub fn chi_squared(self, rows: usize) -> f64 {
        // the distribution exists, since the number of rows is positive
        ChiSquared::new(rows.max(1) as f64).map_or(f64::INFINITY, |chi| chi.inverse_cdf(self.get()))
    }
}

impl Default for Probability {
    fn default() -> Self {
        Self::literal(0.99)
    }
}

impl Default for Growth {
    fn default() -> Self {
        Self::literal(2.0)
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
            let found = Probability::new(p).unwrap().chi_squared(rows);
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
