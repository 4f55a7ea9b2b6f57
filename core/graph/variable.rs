//! Values in a graph: points of registered manifolds.
mod bounds;
pub mod column;
mod key;
mod manifold;
mod values;

use crate::algebra::Dimension;
use crate::registry::catalogue::{self, Kind};
use crate::variable::column::{Column, Plain};
use std::any::{Any, TypeId};
use std::fmt::Debug;

pub use bounds::{Bounds, Interval, IntervalError, OutOfBounds};
pub use key::Key;
pub use manifold::{Manifold, Motion, Tangent};
pub use values::{ValueError, Values};

/// A point of a registered manifold. Implemented by [`register_manifold!`](crate::register_manifold).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not registered as a type of variables",
    label = "not a type of variables",
    note = "write `register_manifold!(\"its_name\", {Self});` below `impl Manifold for {Self}`, or use a registered one such as `Se3`"
)]
#[typetag::serialize(tag = "type")]
pub trait Variable: Debug + Send + Sync {
    /// Returns the type-erased view of the point.
    fn erased(&self) -> &dyn ErasedManifold;
}

crate::kind!(dyn Variable, "variable");

/// Returns the name of a manifold; a placeholder text if it is not registered.
pub fn manifold_name(id: TypeId) -> &'static str {
    let kind = <dyn Variable as Kind>::NAME;
    let entry = catalogue::entries(kind).into_iter().find(|e| (e.type_id)() == id);
    entry.map_or("an unregistered manifold", |e| e.name)
}

/// The cast from `dyn Any` to a registered type of variables. Created by
/// [`register_manifold!`](crate::register_manifold).
#[derive(Debug)]
pub struct AsVariable {
    /// The type.
    pub type_id: fn() -> TypeId,
    /// Dimension of its tangent space.
    pub dimension: usize,
    /// Casts a variable; `None` if it has a different type.
    pub cast: for<'a> fn(&'a dyn Any) -> Option<&'a dyn Variable>,
}
inventory::collect!(AsVariable);

/// Returns the cast with which a [`DynamicResidual`](crate::DynamicResidual) gets its variables as trait
/// objects; `None` for a type that is not registered.
pub fn as_variable(id: TypeId) -> Option<&'static AsVariable> {
    inventory::iter::<AsVariable>.into_iter().find(|c| (c.type_id)() == id)
}

impl Clone for Box<dyn Variable> {
    fn clone(&self) -> Self {
        self.erased().clone_box()
    }
}

/// The object-safe view of [`Manifold`], implemented once for all manifolds.
pub trait ErasedManifold {
    /// Returns the point for a downcast to the concrete type.
    fn as_any(&self) -> &dyn Any;
    /// Returns the concrete type.
    fn type_id(&self) -> TypeId;
    /// Returns the dimension of the tangent space.
    fn dim(&self) -> usize;
    /// Returns the names of the tangent directions.
    fn tangent(&self) -> &'static [&'static str];
    /// Returns the point at `delta`; `None` if its length is not the dimension.
    fn retract(&self, delta: &[f64]) -> Option<Box<dyn Variable>>;
    /// Returns the tangent vector to `other`; `None` if that has a different type.
    fn local(&self, other: &dyn Variable) -> Option<Vec<f64>>;
    /// See [`Manifold::coordinate`].
    fn coordinate(&self, direction: usize) -> Option<f64>;
    /// See [`Manifold::position`].
    fn position(&self) -> Option<[f64; 3]>;
    /// See [`Manifold::moved`].
    fn moved(&self, motion: Motion) -> Option<Vec<f64>>;
    /// Returns whether every coordinate is finite.
    fn is_finite(&self) -> bool;
    /// Returns a copy of the point.
    fn clone_box(&self) -> Box<dyn Variable>;
    /// Returns an empty column of this type.
    fn new_column(&self) -> Box<dyn Column>;
}

impl<M: Manifold + Variable> ErasedManifold for M {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn type_id(&self) -> TypeId {
        TypeId::of::<M>()
    }
    fn dim(&self) -> usize {
        M::Dim::N
    }
    fn tangent(&self) -> &'static [&'static str] {
        M::TANGENT
    }
    fn retract(&self, delta: &[f64]) -> Option<Box<dyn Variable>> {
        (delta.len() == M::Dim::N)
            .then(|| Box::new(Manifold::retract(self, &M::Dim::vector(|i| delta[i]))) as Box<dyn Variable>)
    }
    fn local(&self, other: &dyn Variable) -> Option<Vec<f64>> {
        let other = other.erased().as_any().downcast_ref::<M>()?;
        Some(Manifold::local(self, other).as_ref().to_vec())
    }
    fn coordinate(&self, direction: usize) -> Option<f64> {
        Manifold::coordinate(self, direction)
    }
    fn position(&self) -> Option<[f64; 3]> {
        Manifold::position(self)
    }
    fn moved(&self, motion: Motion) -> Option<Vec<f64>> {
        Some(Manifold::moved(self, motion)?.as_ref().to_vec())
    }
    fn is_finite(&self) -> bool {
        Manifold::is_finite(self)
    }
    fn clone_box(&self) -> Box<dyn Variable> {
        Box::new(self.clone())
    }
    fn new_column(&self) -> Box<dyn Column> {
        Box::new(Plain::<M>(Vec::new()))
    }
}
