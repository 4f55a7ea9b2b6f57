//! A 3D unit vector that is checked at parse time.
use crate::algebra::{Lift, Scalar};
use nalgebra::{UnitVector3, Vector3};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::Deref;

/// A direction in 3D: a unit vector. Any three finite numbers except zero are accepted, and normalised.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 3]", into = "[f64; 3]")]
pub struct Direction(UnitVector3<f64>);

/// The error for a vector without a direction: zero or not finite.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected a direction, three finite numbers not all zero; got {0:?}")]
pub struct NoDirection(pub [f64; 3]);

impl Direction {
    /// The x axis.
    pub const X: Direction = Direction(UnitVector3::new_unchecked(Vector3::new(1.0, 0.0, 0.0)));
    /// The z axis, the default for up.
    pub const Z: Direction = Direction(UnitVector3::new_unchecked(Vector3::new(0.0, 0.0, 1.0)));

    /// Returns the direction of `v`.
    ///
    /// # Errors
    /// If `v` is zero or not finite.
    pub fn new(v: Vector3<f64>) -> Result<Self, NoDirection> {
        // scale first: the squares of tiny or huge entries would leave the range of f64
        let scale = v.amax();
        if !(scale > 0.0 && v.iter().all(|x| x.is_finite())) {
            return Err(NoDirection(v.into()));
        }
        // a vector that is normalised already stays unchanged to the last bit, so that documents round trip
        if (v.norm() - 1.0).abs() < 4.0 * f64::EPSILON {
            return Ok(Self(UnitVector3::new_unchecked(v)));
        }
        Ok(Self(UnitVector3::new_normalize(v / scale)))
    }
}

impl Default for Direction {
    fn default() -> Self {
        Self::Z
    }
}

impl Deref for Direction {
    type Target = Vector3<f64>;
    fn deref(&self) -> &Vector3<f64> {
        &self.0
    }
}

impl Lift for Direction {
    type Of<T: Scalar> = Vector3<T>;
    #[inline(always)]
    fn lift<T: Scalar>(&self) -> Vector3<T> {
        self.0.map(T::from)
    }
}

impl TryFrom<[f64; 3]> for Direction {
    type Error = NoDirection;
    fn try_from(v: [f64; 3]) -> Result<Self, NoDirection> {
        Self::new(v.into())
    }
}

impl From<Direction> for [f64; 3] {
    fn from(d: Direction) -> [f64; 3] {
        d.0.into_inner().into()
    }
}

impl JsonSchema for Direction {
    fn schema_name() -> Cow<'static, str> {
        "Direction".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A direction in 3D, of any length but zero.",
            "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3
        })
    }
}

/// The up direction of the world, as given in the document of a factor, or unset. An unset direction is z
/// until a caller fills in a better one, as a run does from gravity. Name the field at the registration:
/// `register_factor!("name", Type, up);`.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(from = "Direction", into = "Direction")]
pub struct Up {
    direction: Direction,
    is_given: bool,
}

impl Up {
    /// Sets the direction if none was given. Returns whether it was unset.
    pub fn fill(&mut self, up: Direction) -> bool {
        let is_open = !self.is_given;
        if is_open {
            *self = up.into();
        }
        is_open
    }
}

impl From<Direction> for Up {
    fn from(direction: Direction) -> Self {
        Self { direction, is_given: true }
    }
}

impl From<Up> for Direction {
    fn from(up: Up) -> Self {
        up.direction
    }
}

impl Deref for Up {
    type Target = Direction;
    fn deref(&self) -> &Direction {
        &self.direction
    }
}

/// Compares the directions only: a given z equals an unset up.
impl PartialEq for Up {
    fn eq(&self, other: &Self) -> bool {
        self.direction == other.direction
    }
}

impl JsonSchema for Up {
    fn schema_name() -> Cow<'static, str> {
        Direction::schema_name()
    }
    fn schema_id() -> Cow<'static, str> {
        Direction::schema_id()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        Direction::json_schema(generator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_length_but_zero_will_do() {
        assert_eq!(Direction::new(Vector3::new(0.0, 0.0, 1e-200)).unwrap(), Direction::Z);
        assert_eq!(Direction::new(Vector3::new(0.0, 0.0, 1e200)).unwrap(), Direction::Z);
        for bad in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            assert!(Direction::try_from(bad).is_err());
        }
    }

    #[test]
    fn up_is_filled_where_it_is_open() {
        let x = Direction::new(Vector3::x()).unwrap();
        let mut open = Up::default();
        assert_eq!(*open, Direction::Z);
        assert!(open.fill(x));
        assert_eq!(*open, x);
        assert!(!open.fill(Direction::Z));
        assert_eq!(*open, x);
        let mut given: Up = serde_json::from_str("[0.0, 0.0, 2.0]").unwrap();
        assert!(!given.fill(x) && *given == Direction::Z);
    }

    #[test]
    fn a_document_round_trips_exactly() {
        let d = Direction::new(Vector3::new(0.1, -0.7, 0.3)).unwrap();
        let text = serde_json::to_string(&d).unwrap();
        assert_eq!(serde_json::from_str::<Direction>(&text).unwrap(), d);
    }
}
