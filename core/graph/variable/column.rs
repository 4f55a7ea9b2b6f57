//! Variables of one type, stored contiguously.
use crate::algebra::Dimension;
use crate::variable::Manifold;
use crate::variable::Variable;
use std::any::{Any, TypeId};

/// Start of a fixed variable, which is not part of the linear system.
pub const FIXED: u32 = u32::MAX;

/// A vector as a trait object. A new type, so that its impls do not conflict with impls for `Vec`.
#[derive(Debug, Clone)]
pub(crate) struct Plain<T>(pub(crate) Vec<T>);

/// All variables of one type, contiguous.
pub trait Column: Send + Sync {
    /// Returns the column for a downcast to the typed column.
    fn as_any(&self) -> &dyn Any;
    /// Returns the number of variables.
    fn len(&self) -> usize;
    /// Returns whether the column is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Appends a variable of this column's type. A variable of a different type is ignored.
    fn push(&mut self, value: &dyn Variable);
    /// Overwrites a variable with a value of this column's type.
    fn set(&mut self, index: usize, value: &dyn Variable);
    /// Returns a variable for a downcast to its type.
    fn value(&self, index: usize) -> Option<&dyn Any>;
    /// Returns a coordinate of a variable; see [`Manifold::coordinate`].
    fn coordinate(&self, index: usize, direction: usize) -> Option<f64>;
    /// Returns a copy of a variable.
    fn get(&self, index: usize) -> Option<Box<dyn Variable>>;
    /// `self ← from ⊞ step`; the step of variable i begins at `starts[i]`.
    fn retract_from(&mut self, from: &dyn Column, starts: &[u32], step: &[f64]);
    /// `self[index] ← from[index] ⊞ step`, for one variable.
    fn retract_at(&mut self, from: &dyn Column, index: usize, step: &[f64]);
    /// `self[index] ← from[index]`, for one variable.
    fn copy_at(&mut self, from: &dyn Column, index: usize);
    /// Keeps the first `len` variables.
    fn truncate(&mut self, len: usize);
    /// Returns the first variable with a coordinate that is not finite.
    fn first_not_finite(&self) -> Option<usize>;
    /// `self ← from`, for columns of equal type, without allocation if the memory suffices.
    fn copy_from(&mut self, from: &dyn Column);
    /// Returns a copy of the column.
    fn clone_box(&self) -> Box<dyn Column>;
}

impl<M: Manifold + Variable> Column for Plain<M> {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn len(&self) -> usize {
        self.0.len()
    }
    fn push(&mut self, value: &dyn Variable) {
        self.0.extend(value.erased().as_any().downcast_ref::<M>().cloned());
    }
    fn set(&mut self, index: usize, value: &dyn Variable) {
        if let (Some(x), Some(value)) = (self.0.get_mut(index), value.erased().as_any().downcast_ref::<M>()) {
            *x = value.clone();
        }
    }
    fn value(&self, index: usize) -> Option<&dyn Any> {
        self.0.get(index).map(|x| x as &dyn Any)
    }
    fn coordinate(&self, index: usize, direction: usize) -> Option<f64> {
        self.0.get(index)?.coordinate(direction)
    }
    fn get(&self, index: usize) -> Option<Box<dyn Variable>> {
        self.0.get(index).map(|x| Box::new(x.clone()) as Box<dyn Variable>)
    }
    fn retract_from(&mut self, from: &dyn Column, starts: &[u32], step: &[f64]) {
        let Some(from) = from.as_any().downcast_ref::<Plain<M>>() else { return };
        for ((x, old), &start) in self.0.iter_mut().zip(&from.0).zip(starts) {
            *x = if start == FIXED {
                old.clone()
            } else {
                old.retract(&M::Dim::vector(|i| step[start as usize + i]))
            };
        }
    }
    fn retract_at(&mut self, from: &dyn Column, index: usize, step: &[f64]) {
        let Some(from) = from.as_any().downcast_ref::<Plain<M>>() else { return };
        if let (Some(x), Some(old)) = (self.0.get_mut(index), from.0.get(index)) {
            *x = old.retract(&M::Dim::vector(|i| step[i]));
        }
    }
    fn copy_at(&mut self, from: &dyn Column, index: usize) {
        let Some(from) = from.as_any().downcast_ref::<Plain<M>>() else { return };
        if let (Some(x), Some(old)) = (self.0.get_mut(index), from.0.get(index)) {
            *x = old.clone();
        }
    }
    fn truncate(&mut self, len: usize) {
        self.0.truncate(len);
    }
    fn first_not_finite(&self) -> Option<usize> {
        self.0.iter().position(|x| !x.is_finite())
    }
    fn copy_from(&mut self, from: &dyn Column) {
        if let Some(from) = from.as_any().downcast_ref::<Plain<M>>() {
            self.0.clone_from(&from.0);
        }
    }
    fn clone_box(&self) -> Box<dyn Column> {
        Box::new(self.clone())
    }
}

/// One column for each type of variable in a problem.
#[derive(Default)]
pub struct Columns(Vec<(TypeId, Box<dyn Column>)>);

impl Columns {
    /// Adds a column, and returns its index.
    pub fn add(&mut self, id: TypeId, column: Box<dyn Column>) -> usize {
        self.0.push((id, column));
        self.0.len() - 1
    }
    /// Returns the index of the column of a type.
    pub fn position(&self, id: TypeId) -> Option<usize> {
        self.0.iter().position(|(i, _)| *i == id)
    }
    /// Returns the column at an index from [`Columns::add`].
    pub fn column(&self, place: usize) -> &dyn Column {
        &*self.0[place].1
    }
    /// Returns the column at an index, for modification.
    pub fn column_mut(&mut self, place: usize) -> &mut dyn Column {
        &mut *self.0[place].1
    }
    /// Returns the number of columns.
    pub fn len(&self) -> usize {
        self.0.len()
    }
    /// Returns whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
    /// Returns a variable of any type, for a downcast to it.
    pub fn value(&self, id: TypeId, index: usize) -> Option<&dyn Any> {
        self.0.iter().find(|(i, _)| *i == id)?.1.value(index)
    }
    /// Returns the variables of type `M`; empty if there are none.
    pub fn typed<M: Manifold>(&self) -> &[M] {
        let column = self.0.iter().find(|(id, _)| *id == TypeId::of::<M>());
        column.and_then(|(_, c)| c.as_any().downcast_ref::<Plain<M>>()).map_or(&[], |c| &c.0)
    }
}

impl Clone for Columns {
    fn clone(&self) -> Self {
        Columns(self.0.iter().map(|(id, c)| (*id, c.clone_box())).collect())
    }
    fn clone_from(&mut self, from: &Self) {
        if self.0.iter().map(|(id, _)| id).eq(from.0.iter().map(|(id, _)| id)) {
            self.0.iter_mut().zip(&from.0).for_each(|((_, to), (_, from))| to.copy_from(&**from));
        } else {
            *self = from.clone();
        }
    }
}
