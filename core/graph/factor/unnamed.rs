//! Factors without a name in documents.
use super::{ErasedResidual, Factor};
use crate::residual::Residual;
use serde::{Serialize, Serializer};
use std::any::type_name;

/// A [`Residual`] as a factor without registration, for programs that save no graph.
///
/// The residual needs neither serde nor a name: `graph.add(["x0", "p3"], Unnamed(Sighting { pixel }))`. A graph
/// with such a factor cannot be written to a document.
#[derive(Debug, Clone)]
pub struct Unnamed<R>(pub R);

impl<R> Serialize for Unnamed<R> {
    fn serialize<S: Serializer>(&self, _: S) -> Result<S::Ok, S::Error> {
        let message = format!(
            "`{}` has no name in documents: register it with `register_factor!`, in place of `Unnamed`",
            type_name::<R>()
        );
        Err(serde::ser::Error::custom(message))
    }
}

#[typetag::serialize(name = "unnamed")]
impl<R: Residual> Factor for Unnamed<R> {
    fn erased(&self) -> &dyn ErasedResidual {
        &self.0
    }
}
