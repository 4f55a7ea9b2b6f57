//! The report of an update.
use crate::factor_id::FactorId;
use manifactor_graph::Key;
use serde::Serialize;
use std::ops::Deref;
use std::sync::Arc;

/// Report of one update.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct UpdateReport {
    /// Number of variables whose part of the factorization was recomputed.
    #[serde(rename = "redone")]
    pub refactorized: usize,
    /// Number of variables with a new linearization point.
    pub relinearized: usize,
    /// Number of variables whose relinearization exceeds the budget. The next updates relinearize them.
    pub postponed: usize,
    /// Number of variables whose step was recomputed.
    pub solved: usize,
    /// Multiply-adds of the factorization.
    pub operations: f64,
    /// Number of passes: one, plus one for each repetition within the update.
    pub passes: usize,
    /// Number of dampings of variables whose steps would have raised the cost. A variable that was damped
    /// twice counts twice.
    pub damped: usize,
    /// Number of step halvings. They replace damping if many variables step too far.
    pub halved: usize,
    /// True if neither damping nor halving helped, and the update ended in a batch solve.
    pub solved_batch: bool,
    /// Undetermined variables: their diagonal block of H is rank deficient. They and their factors take no
    /// part until more factors determine them.
    #[serde(rename = "parked")]
    pub undetermined_variables: SharedList<Key>,
    /// Directions that no factor constrains, such as a free gauge, by variable and name of the tangent
    /// direction. They are held at their current value.
    #[serde(rename = "undetermined")]
    pub undetermined_directions: Vec<(Key, &'static str)>,
    /// Marginalized variables. A linear prior replaces their factors.
    #[serde(rename = "sealed")]
    pub marginalized: Vec<Key>,
    /// Variables that could not be marginalized, because their linear prior or its sums overflow. A window
    /// tries them again with the next update. Remedy: scale the noise of their factors.
    #[serde(rename = "stayed")]
    pub not_marginalized: Vec<Key>,
    /// Factors that took no part and were dropped together with marginalized variables.
    pub dropped: Vec<FactorId>,
    /// Factors that this update has rejected as outliers.
    pub rejected: Vec<FactorId>,
    /// Factors that an earlier update rejected and that count again.
    pub readmitted: Vec<FactorId>,
    /// Number of trials, which test whether rejected factors are right and accepted ones wrong.
    pub trials: usize,
    /// Number of factors that take no part, because they were not defined at their last linearization or have
    /// weight 0.
    pub inactive: usize,
}

/// The rejection of a factor as an outlier.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FactorRejection {
    /// The factor.
    pub factor: FactorId,
    /// The update that rejected it. The first update is 1.
    pub since: usize,
    /// ½ρ(‖r‖²) at the estimate; `None` if the factor is not defined there.
    pub cost: Option<f64>,
}

/// A list that is shared between reports until it changes. It can be long, and most updates do not change it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct SharedList<T>(Arc<[T]>);

impl<T> Default for SharedList<T> {
    fn default() -> Self {
        Self(Arc::from([]))
    }
}
impl<T> Deref for SharedList<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}
impl<T> FromIterator<T> for SharedList<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Self(items.into_iter().collect())
    }
}
impl<'a, T> IntoIterator for &'a SharedList<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}
