//! Graphs and values that solutions share with the program, without a copy until one of them changes.
use crate::errors;
use pyo3::prelude::*;
use std::ops::Deref;
use std::sync::Arc;

/// A graph or values. A change copies what is shared; an estimate that was handed out does not change.
#[derive(Default)]
pub(crate) struct Shared<T> {
    inner: Arc<T>,
    /// The object that it belongs to: "solution" or "session".
    owner: Option<&'static str>,
}

impl<T: Clone> Shared<T> {
    /// Belongs to a solution or a session, and does not change.
    pub(crate) fn of(owner: &'static str, inner: impl Into<Arc<T>>) -> Self {
        Self { inner: inner.into(), owner: Some(owner) }
    }

    /// The present content, which later changes leave alone.
    pub(crate) fn snapshot(&self) -> Arc<T> {
        self.inner.clone()
    }

    /// A copy that may be changed.
    pub(crate) fn copy(&self) -> Self {
        Self { inner: self.inner.clone(), owner: None }
    }

    /// The content, to be changed.
    ///
    /// # Errors
    /// If it belongs to a solution or a session.
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
