//! Numbers that are checked when they are read.
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// A finite number above zero.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "f64", into = "f64")]
#[schemars(extend("exclusiveMinimum" = 0))]
pub struct Positive(f64);

/// A number that should be positive and is not.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected a finite number above zero, got {0}")]
pub struct NotPositive(pub f64);

impl Positive {
    /// # Errors
    /// Where `x` is zero, negative or not finite.
    pub fn new(x: f64) -> Result<Self, NotPositive> {
        if x > 0.0 && x.is_finite() { Ok(Self(x)) } else { Err(NotPositive(x)) }
    }
    /// For literals in code; a constant that is not positive does not compile where `const` is asked for.
    pub const fn literal(x: f64) -> Self {
        assert!(x > 0.0 && x < f64::INFINITY);
        Self(x)
    }
    /// The number.
    pub const fn get(self) -> f64 {
        self.0
    }
}

/// A number from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Share(
    #[serde(deserialize_with = "within::<0, 1, _>")]
    #[schemars(range(min = 0, max = 1))]
    f64,
);

impl Share {
    /// The number.
    pub const fn get(self) -> f64 {
        self.0
    }
}

/// For fields that are plain numbers in code: `#[serde(deserialize_with = "positive")]`.
///
/// # Errors
/// Where the number is zero, negative or not finite.
pub fn positive<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Positive::deserialize(from).map(Positive::get)
}

/// The same for a number that is 0 or more.
///
/// # Errors
/// Where it is negative, or not finite.
pub fn not_negative<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    let x = f64::deserialize(from)?;
    if x >= 0.0 && x.is_finite() {
        Ok(x)
    } else {
        Err(D::Error::custom(format!("expected a finite number, 0 or more, got {x}")))
    }
}

/// The same for a number that is 1 or more.
///
/// # Errors
/// Where it is less than 1, or not finite.
pub fn one_or_more<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    let x = f64::deserialize(from)?;
    if x >= 1.0 && x.is_finite() {
        Ok(x)
    } else {
        Err(D::Error::custom(format!("expected a finite number, 1 or more, got {x}")))
    }
}

/// The same for a count that is 1 or more.
///
/// # Errors
/// Where it is less than 1, or no whole number.
pub fn at_least_one<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    match usize::deserialize(from)? {
        0 => Err(D::Error::custom("expected a whole number, 1 or more, got 0")),
        count => Ok(count),
    }
}

/// The same for a least and a most, neither of them negative.
///
/// # Errors
/// Where the first is above the second, below zero, or one of them is not a number.
pub fn least_and_most<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 2], D::Error> {
    let [least, most] = <[f64; 2]>::deserialize(from)?;
    if 0.0 <= least && least <= most {
        return Ok([least, most]);
    }
    Err(D::Error::custom(format!("expected two numbers, 0 ≤ least ≤ most, got [{least}, {most}]")))
}

/// The same for a number within bounds: `#[serde(deserialize_with = "within::<0, 180, _>")]`.
///
/// # Errors
/// Where it is not.
pub fn within<'de, const LEAST: i32, const MOST: i32, D: Deserializer<'de>>(
    from: D,
) -> Result<f64, D::Error> {
    let x = f64::deserialize(from)?;
    if (f64::from(LEAST)..=f64::from(MOST)).contains(&x) {
        Ok(x)
    } else {
        Err(D::Error::custom(format!("expected a number from {LEAST} to {MOST}, got {x}")))
    }
}

/// A count that is at most `MOST`, for fields that are plain numbers in code:
/// `#[serde(deserialize_with = "at_most::<1000, _>")]`.
///
/// # Errors
/// Where it is larger.
pub fn at_most<'de, const MOST: usize, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    let n = usize::deserialize(from)?;
    if n <= MOST {
        Ok(n)
    } else {
        Err(D::Error::custom(format!("expected a number of at most {MOST}, got {n}")))
    }
}

impl TryFrom<f64> for Positive {
    type Error = NotPositive;
    fn try_from(x: f64) -> Result<Self, NotPositive> {
        Self::new(x)
    }
}

impl From<Positive> for f64 {
    fn from(x: Positive) -> f64 {
        x.0
    }
}
