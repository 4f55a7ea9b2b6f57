//! Names from the catalogue, checked when they are read.
use super::catalogue::{Kind, entries, find};
use manifactor_document::advice;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// The name of a registered type of kind `K`: `TypeName<dyn Factor>` names a factor.
///
/// ```
/// use manifactor_graph::{Factor, TypeName};
/// let error = TypeName::<dyn Factor>::new("betwen").unwrap_err();
/// assert!(error.to_string().starts_with("there is no factor `betwen`"));
/// ```
pub struct TypeName<K: ?Sized> {
    name: &'static str,
    kind: PhantomData<fn(&K)>,
}

/// The error for a name without a registered type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no {kind} `{name}`: {}", known(kind, name))]
pub struct UnknownType {
    kind: &'static str,
    name: String,
}

fn known(kind: &str, name: &str) -> String {
    let known: Vec<String> = entries(kind).iter().map(|entry| entry.name.to_owned()).collect();
    let advice = advice(name, &known);
    advice.unwrap_or_else(|| "this program has none; link the crate that registers it".to_owned())
}

impl<K: Kind + ?Sized> TypeName<K> {
    /// Returns the name of a registered type.
    ///
    /// # Errors
    /// If no linked crate registers a type of this kind with this name.
    pub fn new(name: &str) -> Result<Self, UnknownType> {
        let unknown = || UnknownType { kind: K::NAME, name: name.to_owned() };
        let entry = find(K::NAME, name).ok_or_else(unknown)?;
        Ok(Self { name: entry.name, kind: PhantomData })
    }
}

impl<K: ?Sized> TypeName<K> {
    /// Returns the name.
    pub fn as_str(&self) -> &'static str {
        self.name
    }
}

// the derives would ask for the same of `K`
impl<K: ?Sized> Clone for TypeName<K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: ?Sized> Copy for TypeName<K> {}

impl<K: ?Sized> PartialEq for TypeName<K> {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl<K: ?Sized> Eq for TypeName<K> {}

impl<K: ?Sized> fmt::Debug for TypeName<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TypeName({:?})", self.name)
    }
}

impl<K: ?Sized> Serialize for TypeName<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl<'de, K: Kind + ?Sized> Deserialize<'de> for TypeName<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::new(&Cow::<str>::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}

impl<K: ?Sized> JsonSchema for TypeName<K> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "TypeName".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        String::json_schema(generator)
    }
}
