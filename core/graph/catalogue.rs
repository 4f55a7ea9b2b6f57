//! Everything that can be named in a config, collected from the crates that are linked.
//!
//! A trait whose implementations are chosen by name is a [`Kind`]; [`register!`](crate::register)
//! enters an implementation. The catalogue takes a type's summary, explanation and example from its
//! doc comment, which travels in its JSON Schema: the first paragraph is the summary, the first
//! `toml` block the example.
use schemars::Schema;
use serde_json::Value;
use std::any::{Any, TypeId};

/// A trait object whose implementations are chosen by name.
pub trait Kind: 'static {
    /// What it is called: `factor`, `loss`, `solver`, …
    const NAME: &'static str;
}

/// Why a registered type could not be read, with the path to the place.
pub type ParseError = serde_path_to_error::Error<serde_json::Error>;

/// One registered type.
pub struct Entry {
    /// The [`Kind`] that it is of.
    pub kind: &'static str,
    /// Its name in documents.
    pub name: &'static str,
    /// The module that registered it.
    pub module: &'static str,
    /// Schema of its fields, without the tag `type`; the type's docs are its description.
    pub schema: fn() -> Schema,
    /// The concrete type.
    pub type_id: fn() -> TypeId,
    /// What a factor or a manifold has beyond a name.
    pub signature: fn() -> Signature,
    #[doc(hidden)]
    pub parse: fn(Value) -> Result<Box<dyn Any>, ParseError>,
}
inventory::collect!(Entry);

/// What a factor connects, or what a manifold's tangent is called.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signature {
    /// Rows of a factor's residual.
    pub rows: Option<usize>,
    /// Types of a factor's variables, in order.
    pub variables: Vec<TypeId>,
    /// A factor of any number of variables, all of the one type in `variables`.
    pub many: bool,
    /// Names of a manifold's tangent directions.
    pub tangent: &'static [&'static str],
}

impl Entry {
    /// Reads the fields of this type, without the tag, into a trait object of kind `K`.
    ///
    /// # Errors
    /// Whatever serde finds, with the path to it.
    pub fn parse<K: Kind + ?Sized>(&self, fields: Value) -> Result<Box<K>, ParseError> {
        let any = (self.parse)(fields)?;
        any.downcast::<Box<K>>().map(|b| *b).map_err(|_| {
            let text = format!("`{}` is a {}, not a {}", self.name, self.kind, K::NAME);
            ParseError::new(Path::empty(), serde::de::Error::custom(text))
        })
    }

    /// The type's doc comment.
    pub fn docs(&self) -> String {
        let schema = (self.schema)();
        let text = |key| schema.get(key).and_then(Value::as_str).map(str::to_owned);
        text("description").unwrap_or_default()
    }

    /// First paragraph of the docs, on one line.
    pub fn summary(&self) -> String {
        let docs = self.docs();
        let paragraph = docs.split("\n\n").next().unwrap_or_default();
        paragraph.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// The first `toml` block of the docs.
    pub fn example(&self) -> Option<String> {
        let docs = self.docs();
        let (_, rest) = docs.split_once("```toml\n")?;
        let (example, _) = rest.split_once("```")?;
        Some(example.trim_end().to_owned())
    }
}

use path::Path;
mod path {
    /// serde_path_to_error builds no path by hand: track one over nothing.
    pub(super) struct Path;
    impl Path {
        pub(super) fn empty() -> serde_path_to_error::Path {
            serde_path_to_error::Track::new().path()
        }
    }
}

/// Every entry that is linked, by kind and name.
pub fn all() -> Vec<&'static Entry> {
    let mut all: Vec<_> = inventory::iter::<Entry>.into_iter().collect();
    // inventory's order differs between builds
    all.sort_by_key(|e| (e.kind, e.name));
    all
}

/// The entries of one kind, by name.
pub fn entries(kind: &str) -> Vec<&'static Entry> {
    all().into_iter().filter(|e| e.kind == kind).collect()
}

/// Two entries of one kind and one name: a document could mean either.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "two types are registered as the {kind} `{name}`, in `{}` and in `{}`: give one of them another name in its \
     `register_…!` line", modules[0], modules[1]
)]
pub struct NameTaken {
    /// What both are.
    pub kind: &'static str,
    /// What both are called.
    pub name: &'static str,
    /// Where they are registered.
    pub modules: [&'static str; 2],
}

/// Checks that every registered type has a name of its own among its kind.
///
/// # Errors
/// The first two that share one.
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

/// The entry of this kind and name.
pub fn find(kind: &str, name: &str) -> Option<&'static Entry> {
    inventory::iter::<Entry>.into_iter().find(|e| e.kind == kind && e.name == name)
}

/// The name of a registered manifold; its Rust type's name, where it is not registered.
pub fn manifold_name(id: TypeId) -> &'static str {
    let kind = <dyn crate::Variable as Kind>::NAME;
    let entry = inventory::iter::<Entry>.into_iter().find(|e| e.kind == kind && (e.type_id)() == id);
    entry.map_or("an unregistered manifold", |e| e.name)
}

/// Enters `$type` into the catalogue as a `$kind`, for traits that have `#[typetag::serde]` on the impl.
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
                parse: |fields| {
                    let x: $type = $crate::__private::serde_path_to_error::deserialize(fields)?;
                    let boxed: ::std::boxed::Box<$kind> = ::std::boxed::Box::new(x);
                    Ok(::std::boxed::Box::new(boxed))
                },
            }
        }
    };
}

/// Registers a [`Residual`](crate::Residual) as a factor: `register_factor!("between_se3", Between<Se3>);`
#[macro_export]
macro_rules! register_factor {
    ($name:literal, $type:ty) => {
        const _: () = {
            use $crate::__private::typetag;
            #[typetag::serde(name = $name)]
            impl $crate::Factor for $type {
                fn erased(&self) -> &dyn $crate::ErasedResidual {
                    self
                }
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
            #[typetag::serde(name = $name)]
            impl $crate::Variable for $type {
                fn erased(&self) -> &dyn $crate::ErasedManifold {
                    self
                }
            }
            $crate::__private::inventory::submit! {
                $crate::AsVariable {
                    type_id: || ::std::any::TypeId::of::<$type>(),
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
            #[typetag::serde(name = $name)]
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
            parse: |_| Err(ParseError::new(Path::empty(), serde::de::Error::custom("none"))),
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
