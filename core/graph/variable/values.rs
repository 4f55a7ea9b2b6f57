//! The estimate: a point for each key.
use crate::variable::Key;
use crate::variable::OutOfBounds;
use crate::variable::Variable;
use crate::variable::manifold_name;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::any::TypeId;

/// A value for each key, in the order of insertion.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Values(IndexMap<Key, Box<dyn Variable>, foldhash::fast::RandomState>);

/// The error for a value that is missing or has the wrong type.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// There is no variable with this name.
    #[error("there is no variable `{key}`")]
    Missing {
        /// The requested key.
        key: Key,
    },
    /// The variable has a different type.
    #[error("the variable `{key}` is of type {found}, not {expected}")]
    WrongType {
        /// The requested key.
        key: Key,
        /// The requested type.
        expected: &'static str,
        /// The type of the variable.
        found: &'static str,
    },
    /// The value has a coordinate that is not finite.
    #[error("the value of `{key}` is not finite")]
    NotFinite {
        /// Its key.
        key: Key,
    },
    /// The value is out of the bounds of its variable.
    #[error(transparent)]
    OutOfBounds(#[from] OutOfBounds),
}

impl Values {
    /// Makes an empty set of values.
    pub fn new() -> Self {
        Self::default()
    }
    /// Sets the value of a key, and returns its previous value.
    pub fn insert(
        &mut self,
        key: impl Into<Key>,
        value: impl Variable + 'static,
    ) -> Option<Box<dyn Variable>> {
        self.insert_boxed(key.into(), Box::new(value))
    }
    /// Sets the value of a key, and returns its previous value.
    pub fn insert_boxed(&mut self, key: Key, value: Box<dyn Variable>) -> Option<Box<dyn Variable>> {
        self.0.insert(key, value)
    }
    /// Returns the value of a key, of any type.
    pub fn variable(&self, key: &str) -> Option<&dyn Variable> {
        self.0.get(key).map(|v| &**v)
    }
    /// Returns the value of a key.
    ///
    /// # Errors
    /// If there is no value, or its type is not `M`.
    pub fn get<M: Variable + 'static>(&self, key: impl AsRef<str>) -> Result<&M, ValueError> {
        let key = key.as_ref();
        let value = self.variable(key).ok_or_else(|| ValueError::Missing { key: key.into() })?;
        value.erased().as_any().downcast_ref().ok_or_else(|| ValueError::WrongType {
            key: key.into(),
            expected: manifold_name(TypeId::of::<M>()),
            found: value.typetag_name(),
        })
    }
    /// Returns all values of one type, in order.
    pub fn all<M: Variable + 'static>(&self) -> impl Iterator<Item = (&Key, &M)> {
        self.iter().filter_map(|(key, v)| Some((key, v.erased().as_any().downcast_ref()?)))
    }
    /// Returns all values, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&Key, &dyn Variable)> {
        self.0.iter().map(|(key, value)| (key, &**value))
    }
    /// Returns the value of a key, of any type, and its position in the order.
    pub fn find(&self, key: &str) -> Option<(usize, &dyn Variable)> {
        self.0.get_full(key).map(|(place, _, value)| (place, &**value))
    }
    /// Returns the position of a key in the order.
    pub fn position(&self, key: &str) -> Option<usize> {
        self.0.get_index_of(key)
    }
    /// Removes a key. The remaining ones keep their order.
    pub fn remove(&mut self, key: &str) -> Option<Box<dyn Variable>> {
        self.0.shift_remove(key)
    }
    /// Returns whether the key has a value.
    pub fn contains(&self, key: &str) -> bool {
        self.0.contains_key(key)
    }
    /// Returns the number of values.
    pub fn len(&self) -> usize {
        self.0.len()
    }
    /// Returns whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
