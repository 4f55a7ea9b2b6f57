//! The factorization: the elimination tree, the numbers of its fronts, and the directions that no factor constrains.
mod covariance;

pub use covariance::CovarianceError;

use super::undetermined::Moves;
use crate::elimination_tree::{Affected, Couplings, NONE, Redone, Tree};
use crate::fronts::{Fronts, Scalar};
use crate::model::{Model, Overflow};
use crate::saved::SavedFront;
use std::collections::BTreeSet;

/// The elimination tree and its fronts.
#[derive(Default)]
pub(super) struct Factorization {
    tree: Tree,
    fronts: Fronts,
    /// Directions that no factor constrains, of all fronts.
    open: BTreeSet<Scalar>,
}

impl Factorization {
    /// Makes room for so many variables.
    pub(super) fn resize(&mut self, variables: usize) {
        self.tree.resize(variables);
        self.fronts.resize(variables);
    }

    /// Returns whether a variable is solved for.
    pub(super) fn contains(&self, variable: u32) -> bool {
        self.tree.front_of(variable) != NONE
    }

    /// Directions that no factor constrains: they are held.
    pub(super) fn open(&self) -> impl Iterator<Item = Scalar> {
        self.open.iter().copied()
    }

    /// Returns whether no factor constrains one of a variable's directions.
    pub(super) fn is_open(&self, variable: u32) -> bool {
        self.open.range((variable, 0)..=(variable, u32::MAX)).next().is_some()
    }

    /// Bytes of all fronts.
    pub(super) fn bytes(&self) -> usize {
        self.fronts.bytes()
    }

    /// Multiply-adds of fronts.
    pub(super) fn operations(&self, fronts: &[u32]) -> f64 {
        fronts.iter().map(|f| self.tree.fronts[*f as usize].operations).sum()
    }

    /// Number of variables that a front eliminates.
    pub(super) fn width(&self, front: u32) -> usize {
        self.tree.fronts[front as usize].blocks.len()
    }

    /// Adds a variable's front and those above it to the affected ones.
    pub(super) fn touch(&mut self, variable: u32, affected: &mut Affected) {
        self.tree.touch(variable, affected);
    }

    /// Touches a variable's front and those of its neighbours: all fronts that have it among their rows are above those.
    pub(super) fn touch_around(&mut self, model: &Model, variable: u32, affected: &mut Affected) {
        self.tree.touch(variable, affected);
        model.coupled(variable).for_each(|other| self.tree.touch(other, affected));
    }

    /// Removes all but the first fronts from the affected ones.
    pub(super) fn untouch(&mut self, affected: &mut Affected, first: usize) {
        self.tree.untouch(affected, first);
    }

    /// Replaces the affected fronts: orders and factorizes their variables again, those of `last` last.
    ///
    /// # Errors
    /// If a sum is not finite. The factorization is as before then.
    pub(super) fn rebuild(
        &mut self,
        model: &Model,
        affected: &Affected,
        moves: &Moves,
        last: &[u32],
    ) -> Result<Redone, Overflow> {
        let leaves = |v: u32| moves.leaving.binary_search(&v).is_ok();
        let is_last = |v: u32| last.binary_search(&v).is_ok();
        let redone = self.tree.redo(affected, &moves.entering, leaves, is_last, model);
        let finite = self.check_finite(model, &redone);
        if let Err(overflow) = finite.and_then(|()| self.fronts.build(&self.tree, &model.blocks, &redone.new))
        {
            self.tree.drop_new(affected, &redone);
            return Err(overflow);
        }
        for f in &affected.0 {
            for scalar in self.fronts.open(*f) {
                self.open.remove(scalar);
            }
        }
        self.tree.swap(affected, &redone);
        self.fronts.drop_all(affected);
        for f in &redone.new {
            self.open.extend(self.fronts.open(*f));
        }
        Ok(redone)
    }

    /// Checks H and g of new fronts: a number that is not finite would spread.
    fn check_finite(&self, model: &Model, redone: &Redone) -> Result<(), Overflow> {
        let blocks = redone.new.iter().flat_map(|f| &self.tree.fronts[*f as usize].blocks);
        let bad = blocks.copied().find(|v| !model.blocks.is_finite(*v));
        bad.map_or(Ok(()), |v| Err(Overflow(v)))
    }

    /// All fronts without a parent.
    pub(super) fn roots(&self) -> Vec<u32> {
        self.tree.roots()
    }

    /// The rows of a front, and the fronts below it.
    pub(super) fn below(&self, front: u32) -> (&[u32], &[u32]) {
        let front = &self.tree.fronts[front as usize];
        (&front.rows, &front.children)
    }

    /// A front's variables and their steps, one after the other, from the steps of its rows: `delta` by scalar of all variables.
    pub(super) fn solve(&mut self, model: &Model, front: u32, delta: &[f64]) -> (&[u32], &[f64]) {
        let Self { tree, fronts, .. } = self;
        let number = front;
        let front = &tree.fronts[number as usize];
        (&front.blocks, fronts.solve(front, number, &model.blocks, delta))
    }

    /// The elimination tree, to be saved.
    pub(super) fn save(&self) -> Vec<SavedFront> {
        self.tree.save()
    }

    /// The factorization in a saved elimination tree. `Ok(None)` if it does not fit the model.
    ///
    /// # Errors
    /// If a sum is not finite.
    pub(super) fn load(saved: Vec<SavedFront>, model: &Model) -> Result<Option<Self>, Overflow> {
        let Some(tree) = Tree::load(saved, model, |v| model.is_in_tree(v)) else { return Ok(None) };
        let mut loaded = Self { tree, ..Self::default() };
        loaded.resize(model.variables());
        let all: Vec<u32> = (0..loaded.tree.fronts.len() as u32).collect();
        loaded.fronts.build(&loaded.tree, &model.blocks, &all)?;
        for f in all {
            loaded.open.extend(loaded.fronts.open(f));
        }
        Ok(Some(loaded))
    }
}
