//! The structure of a persistent elimination tree of fronts. An update replaces the top of the tree.
//!
//! ```text
//!                      ┌──────┐
//!                      │ root │  an update recomputes the fronts that it touches,
//!                      └──┬───┘  and all fronts above them
//!              ┌──────────┴─────┐
//!          ┌───┴──┐          ┌──┴───┐
//!          │ redo │          │ keep │  untouched fronts below are kept: their update
//!          └───┬──┘          └──────┘  is stored, only their parent changes
//!        ┌─────┴────┐
//!     ┌──┴───┐   ┌──┴───┐
//!     │ keep │   │ keep │
//!     └──────┘   └──────┘
//! ```
mod amalgamation;
mod order;
mod saved;

use order::{Group, Order};

/// Marks a missing front or parent.
pub(crate) const NONE: u32 = u32::MAX;

/// Variables that are eliminated together, and the boundary variables that receive their update.
#[derive(Debug, Default)]
pub(crate) struct Front {
    /// Variables that this front eliminates, in the order of elimination.
    pub blocks: Vec<u32>,
    pub rows: Vec<u32>,
    /// Number of scalars of `blocks` (`width`) and of `rows` (`below`).
    pub width: usize,
    pub below: usize,
    pub parent: u32,
    /// Sorted by `lowest`, so that updates are added in an order that does not depend on history.
    pub children: Vec<u32>,
    pub lowest: u32,
    /// Multiply-adds of one factorization of this front.
    pub operations: f64,
}

impl Front {
    /// Computes the fields that follow from `blocks` and `rows`.
    fn measure(&mut self, dim: impl Fn(u32) -> usize) {
        self.width = self.blocks.iter().map(|v| dim(*v)).sum();
        self.below = self.rows.iter().map(|v| dim(*v)).sum();
        self.lowest = self.blocks.iter().copied().min().unwrap_or(NONE);
        let (k, m) = (self.width as f64, self.below as f64);
        // elimination of the front, and addition of its update to the parent
        self.operations = k * k * k / 3.0 + k * k * m + k * m * m + 0.5 * m * m;
    }
}

/// A slab of fronts, and for each variable the front that eliminates it.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    pub fronts: Vec<Front>,
    unused: Vec<u32>,
    front_of: Vec<u32>,
    marked: Vec<bool>,
    /// Number in the local graph, by variable.
    local: Vec<u32>,
    order: Order,
}

/// The fronts that an update replaces.
#[derive(Debug, Default)]
pub(crate) struct Affected(pub Vec<u32>);

/// New fronts that replace the affected ones.
#[derive(Debug, Default)]
pub(crate) struct RebuiltFronts {
    /// New fronts, children before parents.
    pub new: Vec<u32>,
    /// Untouched fronts with their new parents.
    pub kept: Vec<(u32, u32)>,
}

/// The structure of the factor graph, as the tree needs it.
pub(crate) trait Couplings {
    /// Returns the number of variables, including variables outside of the tree.
    fn variables(&self) -> usize;
    /// Returns the dimension of a variable's tangent space.
    fn dim(&self, variable: u32) -> usize;
    /// Returns the variables that share a factor with this one, inside or outside of the tree.
    fn coupled(&self, variable: u32) -> impl Iterator<Item = u32>;
}

impl Tree {
    /// Makes room for `variables` variables.
    pub(crate) fn resize(&mut self, variables: usize) {
        self.front_of.resize(variables, NONE);
        self.local.resize(variables, NONE);
    }

    /// Returns the front that eliminates a variable; [`NONE`] if the variable is not in the tree.
    pub(crate) fn front_of(&self, variable: u32) -> u32 {
        self.front_of.get(variable as usize).copied().unwrap_or(NONE)
    }

    /// Adds the front of a variable and all fronts above it to the affected ones.
    pub(crate) fn touch(&mut self, variable: u32, affected: &mut Affected) {
        let mut front = self.front_of(variable);
        while front != NONE && !self.marked[front as usize] {
            self.marked[front as usize] = true;
            affected.0.push(front);
            front = self.fronts[front as usize].parent;
        }
    }

    /// Removes all but the first `first` fronts from the affected ones.
    pub(crate) fn untouch(&mut self, affected: &mut Affected, first: usize) {
        affected.0.drain(first..).for_each(|f| self.marked[f as usize] = false);
    }

    /// Reorders the variables of the affected fronts and builds new fronts from them.
    ///
    /// `entering` are variables that were not in the tree. `leaves` selects variables that drop out of the
    /// tree, and `is_last` those to eliminate last.
    pub(crate) fn rebuild(
        &mut self,
        affected: &Affected,
        entering: &[u32],
        leaves: impl Fn(u32) -> bool,
        is_last: impl Fn(u32) -> bool,
        graph: &impl Couplings,
    ) -> RebuiltFronts {
        let mut variables = entering.to_vec();
        let mut kept = vec![];
        for f in &affected.0 {
            let front = &self.fronts[*f as usize];
            variables.extend(front.blocks.iter().copied().filter(|v| !leaves(*v)));
            kept.extend(front.children.iter().filter(|c| !self.marked[**c as usize]).map(|c| (*c, NONE)));
        }
        variables.sort_unstable();
        variables.iter().enumerate().for_each(|(i, v)| self.local[*v as usize] = i as u32);
        self.order.begin(variables.iter().map(|v| (graph.dim(*v) as u32, is_last(*v))));
        for (i, v) in variables.iter().enumerate() {
            for other in graph.coupled(*v).map(|u| self.local[u as usize]).filter(|u| *u != NONE) {
                self.order.couple(i, other);
            }
        }
        for (kept, _) in &kept {
            self.order.clique(self.fronts[*kept as usize].rows.iter().map(|v| self.local[*v as usize]));
        }
        let groups = self.order.groups();
        let new = self.fronts_of(groups, &variables, &mut kept, graph);
        variables.iter().for_each(|v| self.local[*v as usize] = NONE);
        RebuiltFronts { new, kept }
    }

    /// Merges groups into fronts and stores these in unused slots.
    fn fronts_of(
        &mut self,
        mut groups: Vec<Group>,
        variables: &[u32],
        kept: &mut [(u32, u32)],
        graph: &impl Couplings,
    ) -> Vec<u32> {
        let dim = |local: u32| graph.dim(variables[local as usize]);
        let mut group_of = vec![NONE; variables.len()];
        for (g, group) in groups.iter().enumerate() {
            group.blocks.iter().for_each(|b| group_of[*b as usize] = g as u32);
        }
        let parent = |group: &Group| group.rows.iter().map(|r| group_of[*r as usize]).min().unwrap_or(NONE);
        let mut parents: Vec<u32> = groups.iter().map(parent).collect();
        amalgamation::merge(&mut groups, &mut parents, dim);
        // rank in the order of elimination by variable; front by group
        let (mut rank, mut number) = (vec![0_u32; variables.len()], vec![NONE; groups.len()]);
        let (mut ranks, mut new) = (0.., vec![]);
        for (g, group) in groups.iter().enumerate().filter(|(_, group)| !group.blocks.is_empty()) {
            for b in &group.blocks {
                rank[*b as usize] = ranks.next().unwrap_or(NONE);
                group_of[*b as usize] = g as u32;
            }
            number[g] = self.unused.pop().unwrap_or_else(|| {
                self.fronts.push(Front::default());
                self.marked.push(false);
                self.fronts.len() as u32 - 1
            });
            new.push(number[g]);
        }
        for (g, group) in groups.into_iter().enumerate().filter(|(_, group)| !group.blocks.is_empty()) {
            let Group { mut blocks, mut rows } = group;
            rows.sort_unstable_by_key(|r| rank[*r as usize]);
            [&mut blocks, &mut rows].into_iter().flatten().for_each(|b| *b = variables[*b as usize]);
            let front = &mut self.fronts[number[g] as usize];
            front.children.clear();
            front.parent = number.get(parents[g] as usize).copied().unwrap_or(NONE);
            (front.blocks, front.rows) = (blocks, rows);
            front.measure(|v| graph.dim(v));
        }
        for (kept, parent) in kept.iter_mut() {
            let rows = self.fronts[*kept as usize].rows.iter().map(|v| self.local[*v as usize] as usize);
            let first = rows.min_by_key(|r| rank[*r]);
            *parent = first.map_or(NONE, |r| number[group_of[r] as usize]);
        }
        self.adopt(&new, kept);
        new
    }

    /// Adds new and kept fronts to the children of their parents.
    fn adopt(&mut self, new: &[u32], kept: &[(u32, u32)]) {
        let children = new.iter().map(|f| (*f, self.fronts[*f as usize].parent));
        let children: Vec<(u32, u32)> = children.chain(kept.iter().copied()).collect();
        for (child, parent) in children {
            if let Some(parent) = self.fronts.get_mut(parent as usize) {
                parent.children.push(child);
            }
        }
        for f in new {
            self.sort_children(*f);
        }
    }

    fn sort_children(&mut self, front: u32) {
        let mut children = std::mem::take(&mut self.fronts[front as usize].children);
        children.sort_unstable_by_key(|c| self.fronts[*c as usize].lowest);
        self.fronts[front as usize].children = children;
    }

    /// Replaces the affected fronts by the new ones.
    pub(crate) fn swap(&mut self, affected: &Affected, rebuilt: &RebuiltFronts) {
        for f in &affected.0 {
            self.marked[*f as usize] = false;
            self.unused.push(*f);
            // variables that drop out of the tree; the loop below assigns the remaining ones to their new
            // front
            for b in &self.fronts[*f as usize].blocks {
                self.front_of[*b as usize] = NONE;
            }
        }
        for f in &rebuilt.new {
            self.fronts[*f as usize].blocks.iter().for_each(|b| self.front_of[*b as usize] = *f);
        }
        rebuilt.kept.iter().for_each(|(kept, parent)| self.fronts[*kept as usize].parent = *parent);
    }

    /// Drops the new fronts and keeps the affected ones.
    pub(crate) fn drop_new(&mut self, affected: &Affected, rebuilt: &RebuiltFronts) {
        self.unused.extend(rebuilt.new.iter().rev());
        affected.0.iter().for_each(|f| self.marked[*f as usize] = false);
    }
}
