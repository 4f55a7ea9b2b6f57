//! Semi-axes of an ellipsoid: three lengths that are neither zero nor endless.
use nalgebra::Vector3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The shortest semi-axis, in metres. Fourth powers of what lies between the bounds stay normal.
pub const SHORTEST: f64 = 1e-9;
/// The longest semi-axis, in metres.
pub const LONGEST: f64 = 1e9;

/// Three lengths from 1e-9 to 1e9 metres, checked when they are read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 3]", into = "[f64; 3]")]
pub struct SemiAxes(Vector3<f64>);

/// Lengths that no semi-axes have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected three semi-axes from 1e-9 to 1e9 metres, got {0:?}")]
pub struct NotSemiAxes(pub [f64; 3]);

/// s·exp(δ), within the bounds. NaN stays NaN.
pub(crate) fn step(s: f64, delta: f64) -> f64 {
    (s * delta.exp()).clamp(SHORTEST, LONGEST)
}

impl SemiAxes {
    /// # Errors
    /// If one is not a number from 1e-9 to 1e9.
    pub fn new(s: Vector3<f64>) -> Result<Self, NotSemiAxes> {
        let fits = s.iter().all(|s| (SHORTEST..=LONGEST).contains(s));
        if fits { Ok(Self(s)) } else { Err(NotSemiAxes(s.into())) }
    }
    /// On the way out, where nothing is checked.
    pub(crate) fn unchecked(s: Vector3<f64>) -> Self {
        Self(s)
    }
    /// The lengths, in metres.
    pub fn vector(&self) -> Vector3<f64> {
        self.0
    }
}

impl TryFrom<[f64; 3]> for SemiAxes {
    type Error = NotSemiAxes;
    fn try_from(s: [f64; 3]) -> Result<Self, NotSemiAxes> {
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
        let length = json_schema!({ "type": "number", "minimum": SHORTEST, "maximum": LONGEST });
        json_schema!({ "type": "array", "items": length, "minItems": 3, "maxItems": 3 })
    }
}
