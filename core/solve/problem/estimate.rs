//! Checked updates of values and weights in a compiled problem.
use crate::problem::Problem;
use manifactor_graph::{ValueError, Values};

/// The error for invalid weights of factors. The problem keeps its previous weights.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WeightError {
    /// The number of weights differs from the number of factors.
    #[error("expected a weight for each of the {factors} factors, in the order of the graph, got {weights}")]
    Count {
        /// Number of given weights.
        weights: usize,
        /// Number of factors in the problem.
        factors: usize,
    },
    /// A weight is negative or not finite.
    #[error("factor {factor}: expected a finite weight, 0 or more, got {weight}")]
    Domain {
        /// Index of the factor in the graph, from 0.
        factor: usize,
        /// The given weight.
        weight: f64,
    },
}

impl Problem {
    /// Sets the estimate of the variables in `values`. The remaining variables keep their estimate, and the
    /// structure stays.
    ///
    /// # Errors
    /// If `values` has an unknown key, a different type, or a value that is not finite or out of its bounds.
    /// The estimate is then unchanged.
    pub fn set_values(&mut self, values: &Values) -> Result<(), ValueError> {
        let mut known = 0;
        for place in &self.model.variables {
            let Some(value) = values.variable(place.key.as_str()) else { continue };
            known += 1;
            let (erased, key) = (value.erased(), place.key.clone());
            if self.model.columns().position(erased.type_id()) != Some(place.column) {
                let before = self.model.columns().column(place.column).get(place.index);
                let expected = before.map_or("another type", |value| value.typetag_name());
                return Err(ValueError::WrongType { key, expected, found: value.typetag_name() });
            }
            if !erased.is_finite() {
                return Err(ValueError::NotFinite { key });
            }
        }
        if known < values.len() {
            let is_unknown = |key: &str| self.model.variables.iter().all(|place| place.key.as_str() != key);
            if let Some((key, _)) = values.iter().find(|(key, _)| is_unknown(key.as_str())) {
                return Err(ValueError::Missing { key: key.clone() });
            }
        }
        if let Some(out) = self.out_of_bounds(values) {
            return Err(out.into());
        }
        self.model.set_values(values);
        Ok(())
    }

    /// Sets the weight of each factor, which multiplies the weight of its loss.
    ///
    /// # Errors
    /// If there is not one weight for each factor, or one is negative or not finite.
    pub fn set_weights(&mut self, weights: &[f64]) -> Result<(), WeightError> {
        let factors = self.factors();
        if weights.len() != factors {
            return Err(WeightError::Count { weights: weights.len(), factors });
        }
        let bad = |weight: &f64| !(*weight >= 0.0 && weight.is_finite());
        if let Some(factor) = weights.iter().position(bad) {
            return Err(WeightError::Domain { factor, weight: weights[factor] });
        }
        self.model.set_weights(weights);
        Ok(())
    }
}
