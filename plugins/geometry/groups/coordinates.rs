//! Vectors of finite numbers, as written in documents.
use manifactor_graph::{Lift, Scalar};
use nalgebra::SVector;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::Deref;

/// `N` numbers that are checked to be finite when read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct Coordinates<const N: usize>(SVector<f64, N>);

/// An invalid vector of coordinates.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoordinatesError {
    /// The number of entries is wrong.
    #[error("expected {expected} numbers, got {found}")]
    Count {
        /// The expected number of entries.
        expected: usize,
        /// The number of entries given.
        found: usize,
    },
    /// An entry is infinite or not a number.
    #[error("expected finite numbers, got {value} at position {position}")]
    NotFinite {
        /// Index of the entry, from 0.
        position: usize,
        /// Value of the entry.
        value: f64,
    },
}

impl<const N: usize> Coordinates<N> {
    /// Creates the coordinates from a vector.
    ///
    /// # Errors
    /// If an entry is not finite.
    pub fn new(vector: SVector<f64, N>) -> Result<Self, CoordinatesError> {
        match vector.iter().position(|x| !x.is_finite()) {
            Some(position) => Err(CoordinatesError::NotFinite { position, value: vector[position] }),
            None => Ok(Self(vector)),
        }
    }
    /// Wraps a vector for writing, without a check.
    pub(crate) fn unchecked(vector: SVector<f64, N>) -> Self {
        Self(vector)
    }
    /// Returns the vector.
    pub fn vector(&self) -> SVector<f64, N> {
        self.0
    }
}

impl<const N: usize> Deref for Coordinates<N> {
    type Target = SVector<f64, N>;
    fn deref(&self) -> &SVector<f64, N> {
        &self.0
    }
}

impl<const N: usize> Default for Coordinates<N> {
    fn default() -> Self {
        Self(SVector::zeros())
    }
}

impl<const N: usize> Lift for Coordinates<N> {
    type Of<T: Scalar> = SVector<T, N>;
    #[inline(always)]
    fn lift<T: Scalar>(&self) -> SVector<T, N> {
        self.0.lift()
    }
}

impl<const N: usize> TryFrom<Vec<f64>> for Coordinates<N> {
    type Error = CoordinatesError;
    fn try_from(numbers: Vec<f64>) -> Result<Self, CoordinatesError> {
        if numbers.len() != N {
            return Err(CoordinatesError::Count { expected: N, found: numbers.len() });
        }
        Self::new(SVector::from_column_slice(&numbers))
    }
}

impl<const N: usize> From<Coordinates<N>> for Vec<f64> {
    fn from(x: Coordinates<N>) -> Vec<f64> {
        x.0.as_slice().to_vec()
    }
}

impl<const N: usize> JsonSchema for Coordinates<N> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("Coordinates{N}").into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "array", "items": { "type": "number" }, "minItems": N, "maxItems": N })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn count_and_finiteness_are_checked() {
        let read = |numbers: &[f64]| Coordinates::<2>::try_from(numbers.to_vec());
        assert_eq!(read(&[1.0]), Err(CoordinatesError::Count { expected: 2, found: 1 }));
        let nan = read(&[1.0, f64::INFINITY]).unwrap_err();
        assert_eq!(nan.to_string(), "expected finite numbers, got inf at position 1");
        assert_eq!(*read(&[1.0, 2.0]).unwrap(), nalgebra::Vector2::new(1.0, 2.0));
    }
}
