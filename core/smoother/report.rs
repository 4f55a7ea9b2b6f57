//! What an update did.
use crate::factor_id::FactorId;
use manifactor_graph::Key;
use serde::Serialize;
use std::ops::Deref;
use std::sync::Arc;

/// The account of one update.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    /// Variables whose part of the factorization was made again.
    pub redone: usize,
    /// Variables that were linearized at a new point.
    pub relinearized: usize,
    /// Variables whose relinearization the budget has put off: they come in the next updates.
    pub postponed: usize,
    /// Variables whose step was computed again.
    pub solved: usize,
    /// Multiplications and additions of the factorization.
    pub operations: f64,
    /// Passes: one, and one more for each time that something could not wait.
    pub passes: usize,
    /// Where the cost would have risen: variables whose steps were damped, one that was damped twice counting twice.
    pub damped: usize,
    /// Where many variables had to be: steps that were halved.
    pub halved: usize,
    /// True if the update ended in a batch solve, as neither helped.
    pub solved_batch: bool,
    /// Variables that wait for factors to determine them. Their own block of H has no full rank, so that they and their
    /// factors take no part yet.
    pub parked: Shared<Key>,
    /// Directions that nothing constrains, by variable and name of the tangent direction: a free gauge, say. They are held
    /// where they were.
    pub undetermined: Vec<(Key, &'static str)>,
    /// Variables that have left: their factors are part of a linear prior now.
    pub sealed: Vec<Key>,
    /// Variables that were to leave and stay, as their linear prior or the sums with it overflow. A window tries them again with
    /// the next update. Remedy: scale the noise of their factors.
    pub stayed: Vec<Key>,
    /// Factors that were dropped with those that have left, as they took no part.
    pub dropped: Vec<FactorId>,
    /// Factors that this update has rejected as outliers.
    pub rejected: Vec<FactorId>,
    /// Factors that were rejected by an update before, and count again.
    pub readmitted: Vec<FactorId>,
    /// Trials of rejected factors: whether these are right, and what counts is wrong.
    pub trials: usize,
    /// Factors that are not defined where they were last linearized, and take no part.
    pub inactive: usize,
}

/// A factor that is rejected as an outlier.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rejection {
    /// The factor.
    pub factor: FactorId,
    /// The update that rejected it, the first being 1.
    pub since: usize,
    /// ½ρ(‖r‖²) at the estimate; `None` where it is not defined there.
    pub cost: Option<f64>,
}

/// A list that reports share until it changes: it may be long, and most updates leave it as it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Shared<T>(Arc<[T]>);

impl<T> Default for Shared<T> {
    fn default() -> Self {
        Self(Arc::from([]))
    }
}
impl<T> Deref for Shared<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}
impl<T> FromIterator<T> for Shared<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Self(items.into_iter().collect())
    }
}
impl<'a, T> IntoIterator for &'a Shared<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}
