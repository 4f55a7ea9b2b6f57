//! The offset between two clocks, in the document of a factor.
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::borrow::Cow;
use std::fmt;

/// Word for a variable in documents.
const VARIABLE: &str = "variable";

/// An offset between two clocks, known or to be estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeOffset {
    /// A constant. Unit: seconds.
    Constant(f64),
    /// A variable of the factor. In documents: `"variable"`.
    Variable,
}

impl TimeOffset {
    /// Returns the offset if it is constant. Unit: seconds.
    pub fn constant(self) -> Option<f64> {
        match self {
            Self::Constant(offset) => Some(offset),
            Self::Variable => None,
        }
    }
    pub(super) fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

impl Default for TimeOffset {
    fn default() -> Self {
        Self::Constant(0.0)
    }
}

impl From<f64> for TimeOffset {
    fn from(offset: f64) -> Self {
        Self::Constant(offset)
    }
}

impl Serialize for TimeOffset {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Constant(offset) => to.serialize_f64(*offset),
            Self::Variable => to.serialize_str(VARIABLE),
        }
    }
}

// serde's own untagged enum would only report that no variant fits
impl<'de> Deserialize<'de> for TimeOffset {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct TimeOffsetVisitor;
        impl de::Visitor<'_> for TimeOffsetVisitor {
            type Value = TimeOffset;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a number of seconds or \"{VARIABLE}\"")
            }
            fn visit_f64<E: de::Error>(self, offset: f64) -> Result<TimeOffset, E> {
                Ok(TimeOffset::Constant(offset))
            }
            fn visit_i64<E: de::Error>(self, offset: i64) -> Result<TimeOffset, E> {
                Ok(TimeOffset::Constant(offset as f64))
            }
            fn visit_u64<E: de::Error>(self, offset: u64) -> Result<TimeOffset, E> {
                Ok(TimeOffset::Constant(offset as f64))
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<TimeOffset, E> {
                match word {
                    VARIABLE => Ok(TimeOffset::Variable),
                    other => Err(E::unknown_variant(other, &[VARIABLE])),
                }
            }
        }
        from.deserialize_any(TimeOffsetVisitor)
    }
}

impl JsonSchema for TimeOffset {
    fn schema_name() -> Cow<'static, str> {
        "TimeOffset".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "number" }, { "const": VARIABLE }] })
    }
}
