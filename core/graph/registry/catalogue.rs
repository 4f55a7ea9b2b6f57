//! The catalogue of all types that a config can name, collected from the linked crates.
//!
//! A trait whose implementations are chosen by name is a [`Kind`]; [`register!`](crate::register) adds an
//! implementation. The catalogue takes summary, explanation and example of a type from its doc comment,
//! which is part of its JSON Schema. The first paragraph is the summary, the first `toml` block the
//! example.
use manifactor_document::{Fault, Node, ReadError, Reader};
use schemars::Schema;
use serde_json::Value;
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::OnceLock;

/// The document field that names a type.
pub(crate) const TAG: &str = "type";

/// A trait object whose implementations are chosen by name. [`kind!`](crate::kind) makes a trait one.
pub trait Kind: 'static {
    /// Its name: `factor`, `loss`, `solver`, …
    const NAME: &'static str;
}

/// One registered type.
pub struct Entry {
    /// The [`Kind`] of this type.
    pub kind: &'static str,
    /// Its name in documents.
    pub name: &'static str,
    /// The module that registered it.
    pub module: &'static str,
    /// Schema of its fields, without the tag `type`; the type's docs are its description.
    pub schema: fn() -> Schema,
    /// The concrete type.
    pub type_id: fn() -> TypeId,
    /// Signature of a factor or a manifold; empty for further kinds.
    pub signature: fn() -> Signature,
    #[doc(hidden)]
    pub read_boxed: fn(Reader<'_>) -> Result<Box<dyn Any>, ReadError>,
}
inventory::collect!(Entry);

/// The variables and rows of a factor, or the tangent directions of a manifold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signature {
    /// Rows of a factor's residual.
    pub rows: Option<usize>,
    /// Names of these rows; empty if the author gave none.
    pub row_names: &'static [&'static str],
    /// Types of a factor's variables, in order.
    pub variables: Vec<TypeId>,
    /// Whether the factor takes any number of variables, all of the single type in `variables`.
    pub many: bool,
    /// Names of a manifold's tangent directions.
    pub tangent: &'static [&'static str],
}

impl Entry {
    /// Reads the fields of this type into a trait object of kind `K`. The field `type` is skipped.
    ///
    /// # Errors
    /// Any error of serde, with its position.
    pub fn read<K: Kind + ?Sized>(&self, fields: &Node) -> Result<Box<K>, ReadError> {
        let any = (self.read_boxed)(Reader::without(fields, TAG)).map_err(|error| error.at(fields))?;
        any.downcast::<Box<K>>().map(|boxed| *boxed).map_err(|_| {
            let text = format!("`{}` is a {}, not a {}", self.name, self.kind, K::NAME);
            ReadError::new(fields.place.clone(), Fault::invalid(text))
        })
    }

    /// Returns the doc comment of the type.
    pub fn docs(&self) -> String {
        let schema = (self.schema)();
        let text = |key| schema.get(key).and_then(Value::as_str).map(str::to_owned);
        text("description").unwrap_or_default()
    }

    /// Returns the first paragraph of the docs, on one line.
    pub fn summary(&self) -> String {
        let docs = self.docs();
        let paragraph = docs.split("\n\n").next().unwrap_or_default();
        paragraph.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Returns the first `toml` block of the docs.
    pub fn example(&self) -> Option<String> {
        let docs = self.docs();
        let (_, rest) = docs.split_once("```toml\n")?;
        let (example, _) = rest.split_once("```")?;
        Some(example.trim_end().to_owned())
    }
}

/// Returns every linked entry, sorted by kind and name.
pub fn all() -> Vec<&'static Entry> {
    let mut all: Vec<_> = inventory::iter::<Entry>.into_iter().collect();
    // the order of inventory differs between builds
    all.sort_by_key(|e| (e.kind, e.name));
    all
}

/// Returns the entries of one kind, sorted by name.
pub fn entries(kind: &str) -> Vec<&'static Entry> {
    all().into_iter().filter(|e| e.kind == kind).collect()
}

/// The error for two entries with equal kind and name, which documents cannot distinguish.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "two types are registered as the {kind} `{name}`, in `{}` and in `{}`: give one of them another name in its \
     `register_…!` line", modules[0], modules[1]
)]
pub struct NameTaken {
    /// Kind of both entries.
    pub kind: &'static str,
    /// Name of both entries.
    pub name: &'static str,
    /// Modules that register them.
    pub modules: [&'static str; 2],
}

/// Checks that every registered type has a unique name within its kind.
///
/// # Errors
/// The first two entries with equal names.
pub fn check_names(sorted: &[&Entry]) -> Result<(), NameTaken> {
    let same = sorted.windows(2).find(|pair| (pair[0].kind, pair[0].name) == (pair[1].kind, pair[1].name));
    match same {
        Some(pair) => {
            let modules = [pair[0].module, pair[1].module];
            Err(NameTaken { kind: pair[0].kind, name: pair[0].name, modules })
        }
        None => Ok(()),
    }
}

pub use crate::registry::registered::read;

/// Returns the schema of a trait object: a reference to the definition with all linked types.
#[doc(hidden)]
pub fn reference(kind: &str) -> Schema {
    schemars::json_schema!({ "$ref": format!("#/$defs/{kind}") })
}

/// Returns the entry with this kind and name.
pub fn find(kind: &str, name: &str) -> Option<&'static Entry> {
    static INDEX: OnceLock<HashMap<(&str, &str), &Entry>> = OnceLock::new();
    // the first of two entries with equal names wins, as in `check_names`
    let index = INDEX.get_or_init(|| all().into_iter().rev().map(|e| ((e.kind, e.name), e)).collect());
    index.get(&(kind, name)).copied()
}

/// Makes a trait a [`Kind`](crate::registry::catalogue::Kind) with this name:
/// `kind!(dyn Optimizer, "solver");`. Documents select the type of a box by `type`;
/// `#[typetag::serialize(tag = "type")]` on the trait writes it.
#[macro_export]
macro_rules! kind {
    ($kind:ty, $name:literal) => {
        impl $crate::catalogue::Kind for $kind {
            const NAME: &'static str = $name;
        }
        impl<'de> $crate::__private::serde::Deserialize<'de> for ::std::boxed::Box<$kind> {
            fn deserialize<D>(deserializer: D) -> ::std::result::Result<Self, D::Error>
            where
                D: $crate::__private::serde::Deserializer<'de>,
            {
                $crate::__private::manifactor_document::deserialize_with(deserializer, |node| {
                    let read: Self = $crate::catalogue::read::<$kind>(node)?;
                    Ok(::std::boxed::Box::new(read))
                })
            }
        }
        impl $crate::__private::schemars::JsonSchema for $kind {
            fn inline_schema() -> bool {
                true
            }
            fn schema_name() -> ::std::borrow::Cow<'static, str> {
                $name.into()
            }
            fn json_schema(
                _: &mut $crate::__private::schemars::SchemaGenerator,
            ) -> $crate::__private::schemars::Schema {
                $crate::catalogue::reference($name)
            }
        }
    };
}

/// Adds `$type` to the catalogue as a `$kind`, for traits with `#[typetag::serialize(name = …)]` on the
/// impl.
///
/// `register!(dyn Optimizer, "gauss_newton", GaussNewton);`
#[macro_export]
macro_rules! register {
    ($kind:ty, $name:literal, $type:ty) => {
        $crate::register!($kind, $name, $type, $crate::catalogue::Signature::default());
    };
    ($kind:ty, $name:literal, $type:ty, $signature:expr) => {
        $crate::__private::inventory::submit! {
            $crate::catalogue::Entry {
                kind: <$kind as $crate::catalogue::Kind>::NAME,
                name: $name,
                module: module_path!(),
                schema: || $crate::__private::schemars::schema_for!($type),
                type_id: || ::std::any::TypeId::of::<$type>(),
                signature: || $signature,
                read_boxed: |fields| {
                    let x: $type = $crate::__private::serde::Deserialize::deserialize(fields)?;
                    let boxed: ::std::boxed::Box<$kind> = ::std::boxed::Box::new(x);
                    Ok(::std::boxed::Box::new(boxed))
                },
            }
        }
    };
}

/// Registers a [`Residual`](crate::Residual) as a factor: `register_factor!("between_se3", Between<Se3>);`.
/// A factor that depends on the up direction of the world names its field of type [`Up`](crate::Up):
/// `register_factor!("upright", Upright, up);`
#[macro_export]
macro_rules! register_factor {
    ($name:literal, $type:ty $(, $up:ident)?) => {
        const _: () = {
            use $crate::__private::typetag;
            #[typetag::serialize(name = $name)]
            impl $crate::Factor for $type {
                fn erased(&self) -> &dyn $crate::ErasedResidual {
                    self
                }
                $(
                    fn with_up(
                        &self,
                        up: $crate::Direction,
                    ) -> ::std::option::Option<::std::boxed::Box<dyn $crate::Factor>> {
                        let mut filled = ::std::clone::Clone::clone(self);
                        match filled.$up.fill(up) {
                            true => ::std::option::Option::Some(::std::boxed::Box::new(filled)),
                            false => ::std::option::Option::None,
                        }
                    }
                )?
            }
            $crate::register!(dyn $crate::Factor, $name, $type, $crate::signature::<$type>());
        };
    };
}

/// Registers a [`Manifold`](crate::Manifold) as a type of variables: `register_manifold!("se3", Se3);`
#[macro_export]
macro_rules! register_manifold {
    ($name:literal, $type:ty) => {
        const _: () = {
            use $crate::__private::typetag;
            #[typetag::serialize(name = $name)]
            impl $crate::Variable for $type {
                fn erased(&self) -> &dyn $crate::ErasedManifold {
                    self
                }
            }
            $crate::__private::inventory::submit! {
                $crate::AsVariable {
                    type_id: || ::std::any::TypeId::of::<$type>(),
                    dimension: <$type as $crate::Manifold>::TANGENT.len(),
                    cast: |x| x.downcast_ref::<$type>().map(|x| x as &dyn $crate::Variable),
                }
            }
            $crate::register!(
                dyn $crate::Variable,
                $name,
                $type,
                $crate::catalogue::Signature {
                    tangent: <$type as $crate::Manifold>::TANGENT,
                    ..Default::default()
                }
            );
        };
    };
}

/// Registers a [`RobustLoss`](crate::loss::RobustLoss): `register_loss!("cauchy", Cauchy);`
#[macro_export]
macro_rules! register_loss {
    ($name:literal, $type:ty) => {
        const _: () = {
            use $crate::__private::typetag;
            #[typetag::serialize(name = $name)]
            impl $crate::loss::Loss for $type {
                fn erased(&self) -> &dyn $crate::loss::ErasedLoss {
                    self
                }
            }
            $crate::register!(dyn $crate::loss::Loss, $name, $type);
        };
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_of_one_name_are_told_with_where_they_are() {
        let entry = |name, module| Entry {
            kind: "factor",
            name,
            module,
            schema: || schemars::schema_for!(f64),
            type_id: || TypeId::of::<f64>(),
            signature: Signature::default,
            read_boxed: |_| Err(serde::de::Error::custom("none")),
        };
        let (a, b, c) = (entry("leans", "one"), entry("rests_on", "one"), entry("rests_on", "other"));
        assert_eq!(check_names(&[&a, &b]), Ok(()));
        let error = check_names(&[&a, &b, &c]).unwrap_err().to_string();
        assert!(
            error.starts_with("two types are registered as the factor `rests_on`, in `one` and in `other`"),
            "{error}"
        );
    }
}
