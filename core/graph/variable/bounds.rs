//! Bounds: intervals for coordinates of variables.
use crate::variable::{Key, Variable};
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::{Bound, RangeBounds};

/// A closed interval, with a limit on one side or both.
///
/// ```
/// # use manifactor_graph::{Interval, IntervalError};
/// let positive = Interval::new(0.0..)?;
/// let share = Interval::new(0.0..=1.0)?;
/// assert!(positive.contains(2.0) && !share.contains(2.0));
/// # Ok::<(), IntervalError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Limits", into = "Limits")]
#[schemars(with = "Limits")]
pub struct Interval {
    min: f64,
    max: f64,
}

/// The limits of an interval in a document.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Interval")]
struct Limits {
    /// Smallest value. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    min: Option<f64>,
    /// Largest value. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max: Option<f64>,
}

/// The error of an interval.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntervalError {
    /// The limits are in the wrong order, or one is NaN.
    #[error("expected min ≤ max, got min = {min} and max = {max}")]
    Order {
        /// The given lower limit.
        min: f64,
        /// The given upper limit.
        max: f64,
    },
    /// There is no finite limit.
    #[error("expected a limit: `min`, `max` or both")]
    NoLimit,
    /// The range excludes its end.
    #[error("expected a closed interval, such as 0.0..=1.0, got one without its end {0}")]
    Open(f64),
}

impl Interval {
    /// Returns the interval of a range such as `0.0..=1.0`, `0.0..` or `..=1.0`.
    ///
    /// # Errors
    /// If the range is empty, excludes its end or has no finite limit.
    pub fn new(range: impl RangeBounds<f64>) -> Result<Self, IntervalError> {
        let limit = |bound: Bound<&f64>, unbounded| match bound {
            Bound::Included(limit) => Ok(*limit),
            Bound::Excluded(limit) => Err(IntervalError::Open(*limit)),
            Bound::Unbounded => Ok(unbounded),
        };
        Self::between(
            limit(range.start_bound(), f64::NEG_INFINITY)?,
            limit(range.end_bound(), f64::INFINITY)?,
        )
    }

    fn between(min: f64, max: f64) -> Result<Self, IntervalError> {
        if !(min <= max && min < f64::INFINITY && max > f64::NEG_INFINITY) {
            return Err(IntervalError::Order { min, max });
        }
        if min.is_infinite() && max.is_infinite() {
            return Err(IntervalError::NoLimit);
        }
        Ok(Self { min, max })
    }
    /// Returns the lower limit; negative infinity if there is none.
    pub fn min(&self) -> f64 {
        self.min
    }
    /// Returns the upper limit; infinity if there is none.
    pub fn max(&self) -> f64 {
        self.max
    }
    /// Returns whether a number is in the interval.
    pub fn contains(&self, x: f64) -> bool {
        self.min <= x && x <= self.max
    }
    /// Returns the step closest to `step` after which `x` is in the interval. If `x` is in it, `x + clip(x, step)` does
    /// not leave it by rounding either.
    pub fn clip(&self, x: f64, step: f64) -> f64 {
        let end = x + step;
        if end > self.max {
            let step = self.max - x;
            if x + step > self.max { step.next_down() } else { step }
        } else if end < self.min {
            let step = self.min - x;
            if x + step < self.min { step.next_up() } else { step }
        } else {
            step
        }
    }
}

impl TryFrom<Limits> for Interval {
    type Error = IntervalError;
    fn try_from(Limits { min, max }: Limits) -> Result<Self, IntervalError> {
        Self::between(min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY))
    }
}

impl From<Interval> for Limits {
    fn from(Interval { min, max }: Interval) -> Self {
        Self { min: min.is_finite().then_some(min), max: max.is_finite().then_some(max) }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { min, max } = self;
        match (min.is_finite(), max.is_finite()) {
            (true, true) => write!(f, "from {min} to {max}"),
            (true, false) => write!(f, "{min} or more"),
            (false, _) => write!(f, "{max} or less"),
        }
    }
}

/// Bounds of a variable: an interval for each bounded direction of its tangent space, by name.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(with = "std::collections::BTreeMap<String, Interval>")]
pub struct Bounds(IndexMap<String, Interval>);

impl Bounds {
    /// Sets the limits of a direction. A limit that the interval does not have stays as it is. Limits that exclude each
    /// other are an error of the graph.
    pub fn insert(&mut self, direction: impl Into<String>, interval: Interval) {
        self.change(direction.into(), |before| Interval {
            min: if interval.min.is_finite() { interval.min } else { before.min },
            max: if interval.max.is_finite() { interval.max } else { before.max },
        });
    }
    /// Bounds a direction by an interval in addition to the limits that it has. Limits that exclude each other are an
    /// error of the graph.
    pub fn restrict(&mut self, direction: impl Into<String>, interval: Interval) {
        self.change(direction.into(), |before| Interval {
            min: before.min.max(interval.min),
            max: before.max.min(interval.max),
        });
    }
    fn change(&mut self, direction: String, change: impl FnOnce(Interval) -> Interval) {
        let unbounded = Interval { min: f64::NEG_INFINITY, max: f64::INFINITY };
        let interval = self.0.entry(direction).or_insert(unbounded);
        *interval = change(*interval);
    }
    /// Returns the bounded directions with their intervals.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Interval)> {
        self.0.iter().map(|(direction, interval)| (direction.as_str(), *interval))
    }
    /// Returns whether no direction is bounded.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the index of each bounded direction with its interval and the coordinate there. Unknown directions and
    /// those without a coordinate are left out.
    pub fn of<'a>(&'a self, value: &'a dyn Variable) -> impl Iterator<Item = (usize, Interval, f64)> + 'a {
        let value = value.erased();
        self.iter().filter_map(move |(direction, interval)| {
            let index = value.tangent().iter().position(|name| *name == direction)?;
            Some((index, interval, value.coordinate(index)?))
        })
    }

    /// Returns the coordinates of a value that are out of bounds.
    pub fn out_of_bounds<'a>(
        &'a self,
        key: &'a Key,
        value: &'a dyn Variable,
    ) -> impl Iterator<Item = OutOfBounds> + 'a {
        let tangent = value.erased().tangent();
        // a value that is not finite has its own error
        let is_out = |(_, interval, x): &(usize, Interval, f64)| x.is_finite() && !interval.contains(*x);
        self.of(value).filter(is_out).map(move |(index, interval, value)| OutOfBounds {
            key: key.clone(),
            direction: tangent[index],
            value,
            interval,
        })
    }
}

/// A coordinate that is out of its bounds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}", self.text())]
pub struct OutOfBounds {
    /// The variable.
    pub key: Key,
    /// Name of the direction.
    pub direction: &'static str,
    /// The coordinate.
    pub value: f64,
    /// Its bounds.
    pub interval: Interval,
}

impl OutOfBounds {
    fn text(&self) -> String {
        let Self { key, direction, value, interval } = self;
        if interval.min > interval.max {
            let Interval { min, max } = interval;
            return format!(
                "`{key}`: the bounds of {direction} exclude each other: {min} or more, and {max} or less; change one of them"
            );
        }
        format!("`{key}`: {direction} = {value} is out of its bounds: {interval}; begin within them")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_limits_of_a_direction_are_set_one_by_one() {
        let mut bounds = Bounds::default();
        bounds.insert("x", Interval::new(0.0..).unwrap());
        bounds.insert("x", Interval::new(..=9.0).unwrap());
        assert_eq!(bounds.iter().next(), Some(("x", Interval::new(0.0..=9.0).unwrap())));
        // added limits apply beside the old ones
        bounds.restrict("x", Interval::new(-1.0..=2.0).unwrap());
        assert_eq!(bounds.iter().next(), Some(("x", Interval::new(0.0..=2.0).unwrap())));
        bounds.insert("x", Interval::new(..=-1.0).unwrap());
        let [(_, interval)] = bounds.iter().collect::<Vec<_>>()[..] else { panic!() };
        assert_eq!((interval.min, interval.max), (0.0, -1.0));
    }

    #[test]
    fn limits_have_to_be_finite_and_in_order() {
        assert_eq!(Interval::new(..), Err(IntervalError::NoLimit));
        assert_eq!(Interval::new(0.0..1.0), Err(IntervalError::Open(1.0)));
        assert!(matches!(Interval::new(f64::NAN..), Err(IntervalError::Order { .. })));
        assert!(matches!(Interval::new(f64::INFINITY..), Err(IntervalError::Order { .. })));
        #[allow(clippy::reversed_empty_ranges, reason = "it is the fault")]
        let reversed = Interval::new(1.0..=0.0);
        assert_eq!(reversed, Err(IntervalError::Order { min: 1.0, max: 0.0 }));
    }

    #[test]
    fn documents_leave_out_infinite_limits() {
        for text in [r#"{"min":0.5}"#, r#"{"max":-1.0}"#, r#"{"min":0.0,"max":0.0}"#] {
            let interval: Interval = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&interval).unwrap(), text);
        }
        let error = serde_json::from_str::<Interval>("{}").unwrap_err().to_string();
        assert_eq!(error, "expected a limit: `min`, `max` or both");
    }

    proptest! {
        #[test]
        fn clipped_steps_stay_inside(
            limits in [-1e3..1e3, -1e3..1e3], scale in -9i32..9, share in 0.0..=1.0, step in -1e12..1e12
        ) {
            let [min, max] = [f64::min(limits[0], limits[1]), f64::max(limits[0], limits[1])].map(|x| x * 10f64.powi(scale));
            let interval = Interval::new(min..=max).unwrap();
            let x = f64::clamp(min + share * (max - min), min, max);
            let step = interval.clip(x, step);
            prop_assert!(interval.contains(x + step), "{x} {step} {interval}");
        }
    }
}
