//! The structure of a persistent multifrontal tree: how an update replaces the top of it.
//!
//! ```text
//!                      ┌──────┐
//!                      │ root │  an update redoes the fronts of what it touches,
//!                      └──┬───┘  and all fronts above them
//!              ┌──────────┴─────┐
//!          ┌───┴──┐          ┌──┴───┐
//!          │ redo │          │ keep │  fronts below that stay: their update is
//!          └───┬──┘          └──────┘  at hand, only their parent is another
//!        ┌─────┴────┐
//!     ┌──┴───┐   ┌──┴───┐
//!     │ keep │   │ keep │
//!     └──────┘   └──────┘
//! ```
mod amalgamation;
mod order;
mod saved;

use order::{Group, Order};

/// No front, or no parent.
pub(crate) const NONE: u32 = u32::MAX;

/// Variables that are eliminated together, and those of the boundary, which their update goes to.
#[derive(Debug, Default)]
pub(crate) struct Front {
    /// In the order of elimination, both.
    pub blocks: Vec<u32>,
    pub rows: Vec<u32>,
    /// Scalars of the blocks and of the rows.
    pub width: usize,
    pub below: usize,
    pub parent: u32,
    /// By their lowest variable: updates are added in an order that does not depend on history.
    pub children: Vec<u32>,
    pub lowest: u32,
    /// Multiply-adds to make it again.
    pub operations: f64,
}

impl Front {
    /// What follows from its blocks and rows.
    fn measure(&mut self, dim: impl Fn(u32) -> usize) {
        self.width = self.blocks.iter().map(|v| dim(*v)).sum();
        self.below = self.rows.iter().map(|v| dim(*v)).sum();
        self.lowest = self.blocks.iter().copied().min().unwrap_or(NONE);
        let (k, m) = (self.width as f64, self.below as f64);
        // its elimination, and its update into the parent
        self.operations = k * k * k / 3.0 + k * k * m + k * m * m + 0.5 * m * m;
    }
}

/// Fronts in a slab, and by variable the one that eliminates it.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    pub fronts: Vec<Front>,
    unused: Vec<u32>,
    front_of: Vec<u32>,
    marked: Vec<bool>,
    /// By variable, its number in the local graph.
    local: Vec<u32>,
    order: Order,
}

/// The fronts that an update takes away.
#[derive(Debug, Default)]
pub(crate) struct Affected(pub Vec<u32>);

/// New fronts, which are to take the place of the affected ones.
#[derive(Debug, Default)]
pub(crate) struct Redone {
    /// Children before parents.
    pub new: Vec<u32>,
    /// Fronts that stay as they are, with their parents among the new.
    pub kept: Vec<(u32, u32)>,
}

/// What the tree has to know of the graph.
pub(crate) trait Couplings {
    /// Number of variables, those that are not in the tree among them.
    fn variables(&self) -> usize;
    /// Dimension of a variable's tangent space.
    fn dim(&self, variable: u32) -> usize;
    /// Variables that share a factor with this one, whether they are in the tree or not.
    fn coupled(&self, variable: u32) -> impl Iterator<Item = u32>;
}

impl Tree {
    /// Makes room for so many variables.
    pub(crate) fn resize(&mut self, variables: usize) {
        self.front_of.resize(variables, NONE);
        self.local.resize(variables, NONE);
    }

    /// The front that eliminates a variable; [`NONE`] for one that is not in the tree.
    pub(crate) fn front_of(&self, variable: u32) -> u32 {
        self.front_of.get(variable as usize).copied().unwrap_or(NONE)
    }

    /// Adds a variable's front and those above it to the affected ones.
    pub(crate) fn touch(&mut self, variable: u32, affected: &mut Affected) {
        let mut front = self.front_of(variable);
        while front != NONE && !self.marked[front as usize] {
            self.marked[front as usize] = true;
            affected.0.push(front);
            front = self.fronts[front as usize].parent;
        }
    }

    /// Takes fronts out of the affected ones again, all but the first.
    pub(crate) fn untouch(&mut self, affected: &mut Affected, first: usize) {
        affected.0.drain(first..).for_each(|f| self.marked[f as usize] = false);
    }

    /// Orders the variables of the affected fronts anew, and makes fronts of them. `entering` are variables that were not in
    /// the tree; `leaves` says of the others which are not to be in it any more, `is_last` which to eliminate last.
    pub(crate) fn redo(
        &mut self,
        affected: &Affected,
        entering: &[u32],
        leaves: impl Fn(u32) -> bool,
        is_last: impl Fn(u32) -> bool,
        graph: &impl Couplings,
    ) -> Redone {
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
        Redone { new, kept }
    }

    /// Merges groups into fronts, and puts them into unused places.
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
        // by variable its rank in the order of elimination, by group its front
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

    /// Tells new fronts their children.
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

    /// Puts the new fronts in the place of the affected ones.
    pub(crate) fn swap(&mut self, affected: &Affected, redone: &Redone) {
        for f in &affected.0 {
            self.marked[*f as usize] = false;
            self.unused.push(*f);
            // those that leave; the others are told their new front below
            for b in &self.fronts[*f as usize].blocks {
                self.front_of[*b as usize] = NONE;
            }
        }
        for f in &redone.new {
            self.fronts[*f as usize].blocks.iter().for_each(|b| self.front_of[*b as usize] = *f);
        }
        redone.kept.iter().for_each(|(kept, parent)| self.fronts[*kept as usize].parent = *parent);
    }

    /// Drops the new fronts, and leaves the affected ones where they are.
    pub(crate) fn drop_new(&mut self, affected: &Affected, redone: &Redone) {
        self.unused.extend(redone.new.iter().rev());
        affected.0.iter().for_each(|f| self.marked[*f as usize] = false);
    }
}
