//! Graphs and values that solutions share with the program, copied only when one of them changes.
use crate::errors;
use pyo3::prelude::*;
use std::ops::Deref;
use std::sync::Arc;

/// A graph or values with copy on write. An estimate that was returned to the program never changes.
#[derive(Default)]
pub(crate) struct Shared<T> {
    inner: Arc<T>,
    /// Owner of an immutable object: "solution" or "smoother".
    owner: Option<&'static str>,
}

impl<T: Clone> Shared<T> {
    /// Creates an immutable object that belongs to a solution or a smoother.
    pub(crate) fn of(owner: &'static str, inner: impl Into<Arc<T>>) -> Self {
        Self { inner: inner.into(), owner: Some(owner) }
    }

    /// Returns the current content; later changes do not affect it.
    pub(crate) fn snapshot(&self) -> Arc<T> {
        self.inner.clone()
    }

    /// Returns a mutable copy.
    pub(crate) fn copy(&self) -> Self {
        Self { inner: self.inner.clone(), owner: None }
    }

    /// Returns the content for a change.
    ///
    /// # Errors
    /// If it belongs to a solution or a smoother.
    pub(crate) fn change(&mut self, what: &str) -> PyResult<&mut T> {
        match self.owner {
            None => Ok(Arc::make_mut(&mut self.inner)),
            Some(owner) => {
                let message = format!(
                    "{what} of a {owner} do not change, and the change would be lost: \
                     `copy.copy({what})` makes a copy that can be changed"
                );
                Err(errors::graph(message))
            }
        }
    }
}

impl<T> From<T> for Shared<T> {
    fn from(inner: T) -> Self {
        Self { inner: Arc::new(inner), owner: None }
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.inner
    }
}
