//! The fixed part of a variable.
use serde::de::value::SeqAccessDeserializer;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// The fixed part of a variable, which stays at its initial value.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum Fixed {
    /// All of it (`true`), or nothing.
    Whole(bool),
    /// These directions of the tangent space, by name.
    Directions(Vec<String>),
}

impl<'de> Deserialize<'de> for Fixed {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct FixedVisitor;
        impl<'de> Visitor<'de> for FixedVisitor {
            type Value = Fixed;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("true, false, or an array of directions of the tangent space")
            }
            fn visit_bool<E: serde::de::Error>(self, whole: bool) -> Result<Fixed, E> {
                Ok(Fixed::Whole(whole))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, names: A) -> Result<Fixed, A::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(names)).map(Fixed::Directions)
            }
        }
        from.deserialize_any(FixedVisitor)
    }
}

impl Default for Fixed {
    fn default() -> Self {
        Self::Whole(false)
    }
}

impl Fixed {
    /// Returns what is fixed, together with these directions.
    pub(super) fn with_directions(self, more: &[&str]) -> Self {
        let mut names = match self {
            Self::Whole(true) => return self,
            Self::Whole(false) => vec![],
            Self::Directions(names) => names,
        };
        for name in more {
            if !names.iter().any(|known| known == name) {
                names.push((*name).to_owned());
            }
        }
        Self::Directions(names)
    }

    /// Returns one bit for each tangent direction, set if the direction is fixed.
    pub fn bits(&self, tangent: &[&str]) -> u32 {
        let bit = |name: &str| tangent.iter().position(|t| *t == name).map_or(0, |i| 1 << i);
        match self {
            Self::Whole(true) => u32::MAX.checked_shr(32 - tangent.len().min(32) as u32).unwrap_or(0),
            Self::Whole(false) => 0,
            Self::Directions(names) => names.iter().fold(0, |bits, name| bits | bit(name)),
        }
    }

    /// Returns the directions that a tangent space does not have.
    pub fn unknown_directions<'a>(&'a self, tangent: &'a [&str]) -> impl Iterator<Item = &'a str> {
        let names = match self {
            Self::Directions(names) => &names[..],
            Self::Whole(_) => &[],
        };
        names.iter().map(String::as_str).filter(|name| !tangent.contains(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_fixed_adds_up() {
        let directions =
            |names: &[&str]| Fixed::Directions(names.iter().map(|name| (*name).to_owned()).collect());
        assert_eq!(directions(&["x"]).with_directions(&["y", "x"]), directions(&["x", "y"]));
        assert_eq!(Fixed::Whole(true).with_directions(&["x"]), Fixed::Whole(true));
        assert_eq!(Fixed::default().with_directions(&["x"]), directions(&["x"]));
        assert_eq!(directions(&["x", "z"]).unknown_directions(&["x", "y"]).collect::<Vec<_>>(), ["z"]);
    }
}
