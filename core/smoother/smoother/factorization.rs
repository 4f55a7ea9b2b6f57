//! The factorization: the elimination tree, the values of its fronts, and the directions that no factor
//! constrains.
mod covariance;

pub use covariance::SmootherCovarianceError;

use super::undetermined::Moves;
use crate::elimination_tree::{Affected, Couplings, NONE, RebuiltFronts, Tree};
use crate::fronts::{Fronts, Scalar};
use crate::model::{Model, Overflow};
use crate::saved::SavedFront;
use std::collections::BTreeSet;

/// The elimination tree and its fronts.
#[derive(Default)]
pub(super) struct Factorization {
    tree: Tree,
    fronts: Fronts,
    /// Directions of all fronts that no factor constrains.
    undetermined_directions: BTreeSet<Scalar>,
}

impl Factorization {
    /// Makes room for `variables` variables.
    pub(super) fn resize(&mut self, variables: usize) {
        self.tree.resize(variables);
        self.fronts.resize(variables);
    }

    /// Returns whether a variable is solved for.
    pub(super) fn contains(&self, variable: u32) -> bool {
        self.tree.front_of(variable) != NONE
    }

    /// Returns the directions that no factor constrains. They are held.
    pub(super) fn undetermined_directions(&self) -> impl Iterator<Item = Scalar> {
        self.undetermined_directions.iter().copied()
    }

    /// Returns whether no factor constrains one of a variable's directions.
    pub(super) fn has_undetermined(&self, variable: u32) -> bool {
        self.undetermined_directions.range((variable, 0)..=(variable, u32::MAX)).next().is_some()
    }

    /// Returns the bytes of all fronts.
    pub(super) fn bytes(&self) -> usize {
        self.fronts.bytes()
    }

    /// Returns the multiply-adds of some fronts.
    pub(super) fn operations(&self, fronts: &[u32]) -> f64 {
        fronts.iter().map(|f| self.tree.fronts[*f as usize].operations).sum()
    }

    /// Returns the number of variables that a front eliminates.
    pub(super) fn width(&self, front: u32) -> usize {
        self.tree.fronts[front as usize].blocks.len()
    }

    /// Adds the front of a variable and all fronts above it to the affected ones.
    pub(super) fn touch(&mut self, variable: u32, affected: &mut Affected) {
        self.tree.touch(variable, affected);
    }

    /// Adds the fronts of a variable and its neighbours to the affected ones. All fronts with the variable
    /// among their rows are above one of these.
    pub(super) fn touch_around(&mut self, model: &Model, variable: u32, affected: &mut Affected) {
        self.tree.touch(variable, affected);
        model.coupled(variable).for_each(|other| self.tree.touch(other, affected));
    }

    /// Removes all but the first fronts from the affected ones.
    pub(super) fn untouch(&mut self, affected: &mut Affected, first: usize) {
        self.tree.untouch(affected, first);
    }

    /// Replaces the affected fronts: reorders and factorizes their variables, with the variables of `last` at
    /// the end.
    ///
    /// # Errors
    /// If a sum is not finite. The factorization is unchanged then.
    pub(super) fn rebuild(
        &mut self,
        model: &Model,
        affected: &Affected,
        moves: &Moves,
        last: &[u32],
    ) -> Result<RebuiltFronts, Overflow> {
        let leaves = |v: u32| moves.leaving.binary_search(&v).is_ok();
        let is_last = |v: u32| last.binary_search(&v).is_ok();
        let rebuilt = self.tree.rebuild(affected, &moves.entering, leaves, is_last, model);
        let finite = self.check_finite(model, &rebuilt);
        if let Err(overflow) =
            finite.and_then(|()| self.fronts.build(&self.tree, &model.blocks, &rebuilt.new))
        {
            self.tree.drop_new(affected, &rebuilt);
            return Err(overflow);
        }
        for f in &affected.0 {
            for scalar in self.fronts.undetermined_directions(*f) {
                self.undetermined_directions.remove(scalar);
            }
        }
        self.tree.swap(affected, &rebuilt);
        self.fronts.drop_all(affected);
        for f in &rebuilt.new {
            self.undetermined_directions.extend(self.fronts.undetermined_directions(*f));
        }
        Ok(rebuilt)
    }

    /// Checks H and g of new fronts, because values that are not finite would spread.
    fn check_finite(&self, model: &Model, rebuilt: &RebuiltFronts) -> Result<(), Overflow> {
        let blocks = rebuilt.new.iter().flat_map(|f| &self.tree.fronts[*f as usize].blocks);
        let bad = blocks.copied().find(|v| !model.blocks.is_finite(*v));
        bad.map_or(Ok(()), |v| Err(Overflow(v)))
    }

    /// Returns all fronts without a parent.
    pub(super) fn roots(&self) -> Vec<u32> {
        self.tree.roots()
    }

    /// Returns the rows of a front and its children.
    pub(super) fn below(&self, front: u32) -> (&[u32], &[u32]) {
        let front = &self.tree.fronts[front as usize];
        (&front.rows, &front.children)
    }

    /// Returns the variables of a front and their steps, concatenated. `delta` holds the steps of all
    /// variables by scalar; the steps of the front's rows are its input.
    pub(super) fn solve(&mut self, model: &Model, front: u32, delta: &[f64]) -> (&[u32], &[f64]) {
        let Self { tree, fronts, .. } = self;
        let number = front;
        let front = &tree.fronts[number as usize];
        (&front.blocks, fronts.solve(front, number, &model.blocks, delta))
    }

    /// Returns the elimination tree for saving.
    pub(super) fn save(&self) -> Vec<SavedFront> {
        self.tree.save()
    }

    /// Factorizes the model in a saved elimination tree. Returns `Ok(None)` if the tree does not fit the
    /// model.
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
            loaded.undetermined_directions.extend(loaded.fronts.undetermined_directions(f));
        }
        Ok(Some(loaded))
    }
}
