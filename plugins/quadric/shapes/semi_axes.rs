//! Semi-axes of an ellipsoid: three positive, bounded lengths.
use nalgebra::Vector3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Minimum semi-axis, in metres. Fourth powers of lengths within the bounds are normal floating-point
/// numbers.
pub const MIN_SEMI_AXIS: f64 = 1e-9;
/// Maximum semi-axis, in metres.
pub const MAX_SEMI_AXIS: f64 = 1e9;

/// Three lengths from 1e-9 to 1e9 metres, checked when read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 3]", into = "[f64; 3]")]
pub struct SemiAxes(Vector3<f64>);

/// Lengths that are not valid semi-axes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected three semi-axes from 1e-9 to 1e9 metres, got {0:?}")]
pub struct SemiAxesError(pub [f64; 3]);

/// Returns s·exp(δ), clamped to the bounds. NaN stays NaN.
pub(crate) fn step(s: f64, delta: f64) -> f64 {
    (s * delta.exp()).clamp(MIN_SEMI_AXIS, MAX_SEMI_AXIS)
}

impl SemiAxes {
    /// Creates the semi-axes from three lengths, in metres.
    ///
    /// # Errors
    /// If one is not a number from 1e-9 to 1e9.
    pub fn new(s: Vector3<f64>) -> Result<Self, SemiAxesError> {
        let fits = s.iter().all(|s| (MIN_SEMI_AXIS..=MAX_SEMI_AXIS).contains(s));
        if fits { Ok(Self(s)) } else { Err(SemiAxesError(s.into())) }
    }
    /// Wraps lengths for writing, without a check.
    pub(crate) fn unchecked(s: Vector3<f64>) -> Self {
        Self(s)
    }
    /// Returns the lengths, in metres.
    pub fn vector(&self) -> Vector3<f64> {
        self.0
    }
}

impl TryFrom<[f64; 3]> for SemiAxes {
    type Error = SemiAxesError;
    fn try_from(s: [f64; 3]) -> Result<Self, SemiAxesError> {
        Self::new(s.into())
    }
}

impl From<SemiAxes> for [f64; 3] {
    fn from(s: SemiAxes) -> [f64; 3] {
        s.0.into()
    }
}

impl JsonSchema for SemiAxes {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "SemiAxes".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let length = json_schema!({ "type": "number", "minimum": MIN_SEMI_AXIS, "maximum": MAX_SEMI_AXIS });
        json_schema!({ "type": "array", "items": length, "minItems": 3, "maxItems": 3 })
    }
}
