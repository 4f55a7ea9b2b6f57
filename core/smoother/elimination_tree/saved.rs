//! Saving the tree, and checking it when it is loaded.
use super::{Couplings, Front, NONE, Tree};
use crate::saved::SavedFront;

impl Tree {
    /// Returns all fronts, children before parents.
    pub(crate) fn save(&self) -> Vec<SavedFront> {
        let mut order = vec![];
        let mut open = self.roots();
        while let Some(f) = open.pop() {
            order.push(f);
            open.extend(&self.fronts[f as usize].children);
        }
        order.reverse();
        let mut place = vec![NONE; self.fronts.len()];
        order.iter().enumerate().for_each(|(i, f)| place[*f as usize] = i as u32);
        let one = |f: &u32| {
            let front = &self.fronts[*f as usize];
            let parent = place.get(front.parent as usize).copied();
            SavedFront { blocks: front.blocks.clone(), rows: front.rows.clone(), parent }
        };
        order.iter().map(one).collect()
    }

    pub(crate) fn roots(&self) -> Vec<u32> {
        let roots = self.front_of.iter().copied().filter(|f| *f != NONE);
        let mut roots: Vec<u32> = roots.filter(|f| self.fronts[*f as usize].parent == NONE).collect();
        roots.sort_unstable_by_key(|f| self.fronts[*f as usize].lowest);
        roots.dedup();
        roots
    }

    /// Builds the tree from saved fronts.
    ///
    /// Returns `None` unless the fronts eliminate each variable that `is_in` exactly once, and coupled
    /// variables lie on one path to the root.
    pub(crate) fn load(
        saved: Vec<SavedFront>,
        graph: &impl Couplings,
        is_in: impl Fn(u32) -> bool,
    ) -> Option<Self> {
        let mut tree = Tree::default();
        let n = graph.variables();
        tree.resize(n);
        for (f, SavedFront { blocks, .. }) in saved.iter().enumerate() {
            for v in blocks {
                let front = tree.front_of.get_mut(*v as usize).filter(|front| **front == NONE)?;
                *front = f as u32;
            }
        }
        let are_in = (0..n).all(|v| is_in(v as u32) == (tree.front_of[v] != NONE));
        are_in.then_some(())?;
        let mut is_row = vec![NONE; n];
        for (f, SavedFront { blocks, rows, parent }) in saved.into_iter().enumerate() {
            let f = f as u32;
            for row in &rows {
                let is_new = is_row.get(*row as usize).is_some_and(|at| *at != f);
                let is_later = tree.front_of[is_new.then_some(*row as usize)?] > f;
                (is_later && tree.front_of[*row as usize] != NONE).then_some(())?;
                is_row[*row as usize] = f;
            }
            let coupled = blocks.iter().flat_map(|v| graph.coupled(*v)).filter(|u| is_in(*u));
            let mut later = coupled.filter(|u| tree.front_of[*u as usize] > f);
            later.all(|u| is_row[u as usize] == f).then_some(())?;
            // a front has a parent exactly if it has rows, and the parent comes later
            (parent.is_some() != rows.is_empty() && parent.is_none_or(|p| p > f)).then_some(())?;
            let mut front = Front { blocks, rows, parent: parent.unwrap_or(NONE), ..Front::default() };
            front.measure(|v| graph.dim(v));
            (!front.blocks.is_empty()).then_some(())?;
            tree.fronts.push(front);
        }
        for f in 0..tree.fronts.len() as u32 {
            let parent = tree.fronts[f as usize].parent;
            if parent != NONE {
                tree.fronts.get_mut(parent as usize)?.children.push(f);
            }
        }
        is_row.fill(NONE);
        for f in 0..tree.fronts.len() as u32 {
            let front = &tree.fronts[f as usize];
            front.blocks.iter().chain(&front.rows).for_each(|v| is_row[*v as usize] = f);
            let mut handed_up = front.children.iter().flat_map(|c| &tree.fronts[*c as usize].rows);
            handed_up.all(|v| is_row[*v as usize] == f).then_some(())?;
            tree.sort_children(f);
        }
        tree.marked = vec![false; tree.fronts.len()];
        Some(tree)
    }
}
