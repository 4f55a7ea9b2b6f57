//! Numbers with a domain. A value outside of it cannot be created, neither in code nor by a document.
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::Deref;

/// A number outside its domain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected {expected}, got {got}")]
pub struct OutOfDomain {
    /// The domain.
    pub expected: &'static str,
    /// The number.
    pub got: f64,
}

/// Defines types of numbers with a domain: docs, a name, the domain in words and as an expression, and its
/// JSON schema. Settings use them as field types, so that code and documents get equal checks:
///
/// ```
/// # use manifactor_graph::number;
/// number! {
///     /// A temperature in kelvin.
///     pub Kelvin: "a finite number, 0 or more", |x| x >= 0.0 && x < f64::INFINITY, { "minimum": 0 };
/// }
/// const ROOM: Kelvin = Kelvin::literal(293.15);
/// assert!(Kelvin::new(-1.0).is_err());
/// assert!(ROOM.sqrt() < *ROOM);
/// ```
#[macro_export]
macro_rules! number {
    ($(
        $(#[$doc:meta])*
        $visible:vis $name:ident: $expected:literal, |$x:ident| $is_within:expr, { $($key:literal: $value:expr),* };
    )+) => { $(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
        $visible struct $name(f64);

        #[allow(dead_code, reason = "not every number is used in every way")]
        impl $name {
            /// Checks a number at run time.
            ///
            /// # Errors
            /// If the number is outside the domain or not finite.
            pub const fn new($x: f64) -> Result<Self, $crate::checked::OutOfDomain> {
                if $is_within {
                    Ok(Self($x))
                } else {
                    Err($crate::checked::OutOfDomain { expected: $expected, got: $x })
                }
            }
            /// Makes a number from a literal. Outside the domain, a constant fails to compile, and a call
            /// at run time panics.
            #[track_caller]
            pub const fn literal($x: f64) -> Self {
                assert!($is_within, concat!("expected ", $expected));
                Self($x)
            }
            /// Returns the number.
            pub const fn get(self) -> f64 {
                self.0
            }
        }
        impl ::std::ops::Deref for $name {
            type Target = f64;
            fn deref(&self) -> &f64 {
                &self.0
            }
        }
        impl TryFrom<f64> for $name {
            type Error = $crate::checked::OutOfDomain;
            fn try_from(x: f64) -> Result<Self, $crate::checked::OutOfDomain> {
                Self::new(x)
            }
        }
        impl From<$name> for f64 {
            fn from(x: $name) -> f64 {
                x.0
            }
        }
        impl $crate::__private::serde::Serialize for $name {
            fn serialize<S: $crate::__private::serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_f64(self.0)
            }
        }
        impl<'de> $crate::__private::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::__private::serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let x = <f64 as $crate::__private::serde::Deserialize>::deserialize(from)?;
                Self::new(x).map_err($crate::__private::serde::de::Error::custom)
            }
        }
        impl $crate::__private::schemars::JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }
            fn schema_name() -> ::std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(
                _: &mut $crate::__private::schemars::SchemaGenerator,
            ) -> $crate::__private::schemars::Schema {
                $crate::__private::schemars::json_schema!({ "type": "number", "format": "double" $(, $key: $value)* })
            }
        }
    )+ };
}

number! {
    /// A finite number.
    pub Finite: "a finite number", |x| x.is_finite(), {};
    /// A finite number above zero.
    pub Positive: "a finite number above zero", |x| x > 0.0 && x < f64::INFINITY, { "exclusiveMinimum": 0 };
    /// A finite number, 0 or more.
    pub NotNegative: "a finite number, 0 or more", |x| x >= 0.0 && x < f64::INFINITY, { "minimum": 0 };
    /// A finite number, 1 or more.
    pub OneOrMore: "a finite number, 1 or more", |x| x >= 1.0 && x < f64::INFINITY, { "minimum": 1 };
    /// A number from 0 to 1.
    pub Share: "a number from 0 to 1", |x| x >= 0.0 && x <= 1.0, { "minimum": 0, "maximum": 1 };
}

/// A whole number from `MIN` to `MAX`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct Count<const MIN: usize, const MAX: usize>(usize);

impl<const MIN: usize, const MAX: usize> Count<MIN, MAX> {
    /// Makes a number from a literal. Outside the domain, a constant fails to compile, and a call at run
    /// time panics.
    #[track_caller]
    pub const fn literal(n: usize) -> Self {
        assert!(MIN <= n && n <= MAX);
        Self(n)
    }
}

impl<const MIN: usize, const MAX: usize> Deref for Count<MIN, MAX> {
    type Target = usize;
    fn deref(&self) -> &usize {
        &self.0
    }
}

impl<'de, const MIN: usize, const MAX: usize> Deserialize<'de> for Count<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match usize::deserialize(from)? {
            n if (MIN..=MAX).contains(&n) => Ok(Self(n)),
            n if MIN == 0 => Err(D::Error::custom(format!("expected a number of at most {MAX}, got {n}"))),
            n => Err(D::Error::custom(format!("expected a number from {MIN} to {MAX}, got {n}"))),
        }
    }
}

impl<const MIN: usize, const MAX: usize> JsonSchema for Count<MIN, MAX> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("from_{MIN}_to_{MAX}").into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "integer", "format": "uint", "minimum": MIN, "maximum": MAX })
    }
}
