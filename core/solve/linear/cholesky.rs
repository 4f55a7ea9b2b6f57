//! Supernodal sparse Cholesky: one symbolic analysis for many numeric factorizations, in reused memory.
mod inverse;
pub(crate) mod kernel;
pub(crate) mod large;
pub(crate) mod structure;
mod subtrees;

use crate::linear::NotPositiveDefinite;
use crate::linear::cholesky::large::Scratch;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;
use structure::{Node, Structure};
use subtrees::subtrees;

/// A factorization of a symmetric matrix with a fixed, already ordered pattern.
pub(crate) struct Cholesky {
    pub(super) structure: Structure,
    /// Panels of L.
    pub(super) values: Vec<f64>,
    /// Workspace for all nodes, in order.
    whole: Workspace,
    /// Workspaces for parallel subtrees; created on first use.
    parts: Option<Vec<Part>>,
    /// Entries of a right-hand side in the rows below a supernode.
    below: Vec<f64>,
    arch: Arch,
}

/// Memory for the factorization of some nodes.
struct Workspace {
    /// Pending updates for parent nodes, from nodes on even and on odd levels.
    updates: [Vec<f64>; 2],
    /// Start of each of the two in the stacks of the whole tree.
    base: [usize; 2],
    /// Nodes with an update on the stack.
    open: Vec<usize>,
    memory: Scratch,
}

/// A subtree with its workspace.
struct Part {
    nodes: Range<usize>,
    workspace: Workspace,
}

/// Operations above which subtrees are factorized in parallel, if there are threads.
const WORTH_THREADS: f64 = 5e7;

impl Cholesky {
    /// Allocates a factor with this structure; `None` if there is no memory.
    pub(crate) fn new(structure: Structure) -> Option<Self> {
        let most = structure.nodes.iter().map(|n| n.below).max().unwrap_or(0);
        let nodes = 0..structure.nodes.len();
        Some(Self {
            values: zeros(structure.values)?,
            whole: Workspace::new(&structure, nodes)?,
            parts: None,
            below: zeros(most)?,
            arch: Arch::new(),
            structure,
        })
    }

    /// Factorizes the matrix with lower triangle `h`, plus `added` on its diagonal. Also computes x ← L⁻¹ x
    /// while the panels are in cache. The result is bitwise identical for any number of threads.
    pub(crate) fn factorize(
        &mut self,
        h: &[f64],
        added: Option<&[f64]>,
        x: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        if rayon::current_num_threads() == 1 || self.structure.flops < WORTH_THREADS {
            return self.in_turn(h, added, x);
        }
        // enter the pool once instead of once per front
        rayon::scope(|_| self.together(h, added, x))
    }

    fn in_turn(
        &mut self,
        h: &[f64],
        added: Option<&[f64]>,
        x: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        let of = Matrix { structure: &self.structure, h, added };
        let nodes = 0..self.structure.nodes.len();
        let (panels, right) = ((&mut self.values[..], 0), Some((x, &mut self.below[..])));
        self.arch.dispatch(Factorize { of, nodes, panels, workspace: &mut self.whole, parts: &[], right })
    }

    /// Factorizes subtrees in parallel, then the nodes above them. Threads share large fronts in both.
    fn together(
        &mut self,
        h: &[f64],
        added: Option<&[f64]>,
        x: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        if self.parts.is_none() {
            self.parts = Some(Part::all(&self.structure).ok_or(NotPositiveDefinite)?);
        }
        let Some(parts) = self.parts.as_mut().filter(|parts| !parts.is_empty()) else {
            return self.in_turn(h, added, x);
        };
        let of = Matrix { structure: &self.structure, h, added };
        let all = 0..self.structure.nodes.len();
        let mut rest = (&mut self.values[..], 0);
        let mut tasks = Vec::with_capacity(parts.len());
        for part in &mut *parts {
            let nodes = &self.structure.nodes[part.nodes.clone()];
            let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else { continue };
            let (_, from) = rest.0.split_at_mut(first.panel - rest.1);
            let end = last.panel + last.height() * last.width;
            let (panels, after) = from.split_at_mut(end - first.panel);
            rest = (after, end);
            let (panels, workspace) = ((panels, first.panel), &mut part.workspace);
            tasks.push(Factorize {
                of,
                nodes: part.nodes.clone(),
                panels,
                workspace,
                parts: &[],
                right: None,
            });
        }
        let arch = self.arch;
        tasks.into_par_iter().try_for_each(|task| arch.dispatch(task))?;
        let (panels, workspace) = ((&mut self.values[..], 0), &mut self.whole);
        arch.dispatch(Factorize { of, nodes: all, panels, workspace, parts, right: None })?;
        arch.dispatch(Solve { cholesky: self, x, lower: true, upper: false });
        Ok(())
    }

    /// x ← H⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        self.arch.dispatch(Solve { cholesky: self, x, lower: true, upper: true });
    }

    /// x ← L⁻ᵀ x: the second half of a solve, if the factorization made the first.
    pub(crate) fn solve_upper(&mut self, x: &mut [f64]) {
        self.arch.dispatch(Solve { cholesky: self, x, lower: false, upper: true });
    }

    /// x ← x + L⁻¹ eᵢ, if x is zero along the path. Only the supernodes from unknown i to its root
    /// contribute. Returns their columns.
    pub(crate) fn solve_unit(&mut self, i: usize, x: &mut [f64]) -> Vec<Range<usize>> {
        let mut columns = vec![];
        x[i] = 1.0;
        let nodes = &self.structure.nodes;
        let mut at = nodes.partition_point(|node| node.first + node.width <= i);
        while let Some(node) = nodes.get(at) {
            columns.push(node.first..node.first + node.width);
            let panel = &self.values[node.panel..node.panel + node.height() * node.width];
            solve_lower(node, &self.structure, panel, x, &mut self.below);
            at = node.parent as usize;
        }
        columns
    }

    /// Visits the pivots: squares of the factor's diagonal.
    pub(crate) fn pivots(&self, visit: &mut impl FnMut(usize, f64)) {
        for node in &self.structure.nodes {
            for c in 0..node.width {
                let diagonal = self.values[node.panel + c * (node.height() + 1)];
                visit(node.first + c, diagonal * diagonal);
            }
        }
    }
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Cholesky({} supernodes, {} values)", self.structure.nodes.len(), self.values.len())
    }
}

pub(super) fn zeros(n: usize) -> Option<Vec<f64>> {
    // check that the memory can be had; `vec!` then gets zeroed pages without writing to each
    Vec::<f64>::new().try_reserve_exact(n).ok()?;
    Some(vec![0.0; n])
}

impl Workspace {
    /// Allocates a workspace for these nodes, which are whole subtrees; `None` if there is no memory.
    fn new(structure: &Structure, nodes: Range<usize>) -> Option<Self> {
        let nodes = &structure.nodes[nodes];
        let of_level = |level: u32| nodes.iter().filter(move |n| n.level % 2 == level);
        let base = [0, 1].map(|level| of_level(level).map(|n| n.update).min().unwrap_or(0));
        let end = |level: u32| of_level(level).map(|n| n.update + n.below.pow(2)).max();
        let size = |level: u32| end(level).map_or(0, |end| end - base[level as usize]);
        let widest = nodes.iter().map(|n| n.width).max().unwrap_or(0);
        Some(Self {
            updates: [zeros(size(0))?, zeros(size(1))?],
            base,
            open: Vec::with_capacity(nodes.len()),
            memory: Scratch::new(widest),
        })
    }
}

impl Part {
    fn all(structure: &Structure) -> Option<Vec<Self>> {
        let part =
            |nodes: Range<usize>| Some(Self { workspace: Workspace::new(structure, nodes.clone())?, nodes });
        subtrees(structure, rayon::current_num_threads()).into_iter().map(part).collect()
    }

    /// Returns the update of the subtree's root.
    fn update(&self, root: &Node) -> &[f64] {
        let level = root.level as usize % 2;
        let at = root.update - self.workspace.base[level];
        &self.workspace.updates[level][at..at + root.below.pow(2)]
    }
}

/// The matrix to be factorized.
#[derive(Clone, Copy)]
struct Matrix<'a> {
    structure: &'a Structure,
    h: &'a [f64],
    added: Option<&'a [f64]>,
}

/// A factorization of some nodes in progress.
struct Factorize<'a> {
    of: Matrix<'a>,
    nodes: Range<usize>,
    /// Panels, and the position of the first one in the factor.
    panels: (&'a mut [f64], usize),
    workspace: &'a mut Workspace,
    /// Subtrees that are already factorized.
    parts: &'a [Part],
    /// A right-hand side for L⁻¹, and a buffer for its rows below a supernode.
    right: Option<(&'a mut [f64], &'a mut [f64])>,
}

impl WithSimd for Factorize<'_> {
    type Output = Result<(), NotPositiveDefinite>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Self::Output {
        let structure = self.of.structure;
        self.workspace.open.clear();
        let mut parts = self.parts.iter().peekable();
        let mut early = structure.early.iter().peekable();
        let mut n = self.nodes.start;
        while n < self.nodes.end {
            let part = parts.next_if(|part| part.nodes.start == n);
            // early fronts must exist before their first descendant; a part creates its own
            while let Some((begin, front)) = early.next_if(|(begin, _)| *begin as usize <= n) {
                let front = *front as usize;
                let is_of_part = part.is_some_and(|part| front < part.nodes.end);
                if *begin as usize == n && front < self.nodes.end && !is_of_part {
                    self.begin_early(&structure.nodes[front]);
                }
            }
            match part {
                Some(part) => n = part.nodes.end - 1,
                None => self.eliminate(simd, &structure.nodes[n])?,
            }
            self.pass_update_on(n, part);
            n += 1;
        }
        Ok(())
    }
}

impl Factorize<'_> {
    /// Fills the panel of a front with the entries of H, and adds the damping to its diagonal.
    #[inline(always)]
    fn fill(&mut self, node: &Node) {
        let Matrix { structure, h, added } = self.of;
        let panel = &mut self.panels.0[node.panel - self.panels.1..][..node.height() * node.width];
        panel.fill(0.0);
        for (at, h) in structure.scatter[node.entries.clone()].iter().zip(&h[node.entries.clone()]) {
            panel[*at as usize] = *h;
        }
        if let Some(added) = added {
            for c in 0..node.width {
                panel[c * (node.height() + 1)] += added[node.first + c];
            }
        }
    }

    /// Creates a front that receives the updates of its children one by one.
    #[inline(always)]
    fn begin_early(&mut self, front: &Node) {
        self.fill(front);
        let Workspace { updates, base, .. } = &mut *self.workspace;
        let level = front.level as usize % 2;
        updates[level][front.update - base[level]..][..front.below.pow(2)].fill(0.0);
    }

    /// Eliminates a front: adds the children's updates to its panel, computes L, and writes its own update.
    #[inline(always)]
    fn eliminate<S: Simd>(&mut self, simd: S, node: &Node) -> Result<(), NotPositiveDefinite> {
        if !node.early {
            self.fill(node);
        }
        let structure = self.of.structure;
        let Workspace { updates: [even, odd], base, open, memory } = &mut *self.workspace;
        let level = node.level as usize % 2;
        let (own, theirs) = if level == 0 { (even, odd) } else { (odd, even) };
        let panel = &mut self.panels.0[node.panel - self.panels.1..][..node.height() * node.width];
        let update = &mut own[node.update - base[level]..][..node.below.pow(2)];
        let of_child = |n: usize| {
            let child = &structure.nodes[n];
            let update = match self.parts.binary_search_by_key(&(n + 1), |part| part.nodes.end) {
                Ok(part) => self.parts[part].update(child),
                Err(_) => &theirs[child.update - base[1 - level]..][..child.below.pow(2)],
            };
            (update, child.rows(&structure.places))
        };
        // an early front has its children's updates already
        let children = if node.early { open.len() } else { open.len() - node.children };
        for child in &open[children..] {
            let (from, places) = of_child(*child);
            kernel::assemble_panel(from, places, panel, node.width);
        }
        let eliminated = match node.early {
            true => kernel::eliminate::<S, false>(simd, panel, update, node.width, memory),
            false => kernel::eliminate::<S, true>(simd, panel, update, node.width, memory),
        };
        eliminated.map_err(|_| NotPositiveDefinite)?;
        if let Some((x, below)) = &mut self.right {
            solve_lower(node, structure, panel, x, below);
        }
        for child in open.drain(children..) {
            let (from, places) = of_child(child);
            kernel::assemble_update(from, places, update, node.below, node.width);
        }
        Ok(())
    }

    /// Adds the update of front `n`, or of `part`, to its parent if that is early. Otherwise the update
    /// stays on the stack.
    #[inline(always)]
    fn pass_update_on(&mut self, n: usize, part: Option<&Part>) {
        let structure = self.of.structure;
        let Workspace { updates: [even, odd], base, open, .. } = &mut *self.workspace;
        let (node, parent) = (&structure.nodes[n], structure.nodes[n].parent as usize);
        let Some(front) = structure.nodes.get(parent).filter(|front| front.early && parent < self.nodes.end)
        else {
            return open.push(n);
        };
        let level = node.level as usize % 2;
        let (own, theirs) = if level == 0 { (even, odd) } else { (odd, even) };
        let update = match part {
            Some(part) => part.update(node),
            None => &own[node.update - base[level]..][..node.below.pow(2)],
        };
        let places = node.rows(&structure.places);
        let panel = &mut self.panels.0[front.panel - self.panels.1..][..front.height() * front.width];
        kernel::assemble_panel(update, places, panel, front.width);
        let sum = &mut theirs[front.update - base[1 - level]..][..front.below.pow(2)];
        kernel::assemble_update(update, places, sum, front.below, front.width);
    }
}

/// The contribution of one panel to x ← L⁻¹ x.
#[inline(always)]
fn solve_lower(node: &Node, structure: &Structure, panel: &[f64], x: &mut [f64], below: &mut [f64]) {
    let below = &mut below[..node.below];
    kernel::solve_lower(panel, &mut x[node.first..node.first + node.width], below);
    let rows = node.rows(&structure.rows);
    rows.iter().zip(&*below).for_each(|(row, value)| x[*row as usize] -= value);
}

struct Solve<'a> {
    cholesky: &'a mut Cholesky,
    x: &'a mut [f64],
    /// Whether to apply L⁻¹, and then L⁻ᵀ.
    lower: bool,
    upper: bool,
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Cholesky { structure, values, below, .. } = self.cholesky;
        let x = self.x;
        let panel = |node: &Node| &values[node.panel..node.panel + node.height() * node.width];
        if self.lower {
            for node in &structure.nodes {
                solve_lower(node, structure, panel(node), x, below);
            }
        }
        for node in structure.nodes.iter().rev().filter(|_| self.upper) {
            let below = &mut below[..node.below];
            let rows = node.rows(&structure.rows);
            below.iter_mut().zip(rows).for_each(|(value, row)| *value = x[*row as usize]);
            kernel::solve_upper(panel(node), &mut x[node.first..node.first + node.width], below);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::layout::Layout;
    use crate::linear::ordering::Order;

    /// A square grid of blocks: dimensions and couplings.
    fn grid() -> (Vec<usize>, Vec<(u32, u32)>) {
        const SIDE: u32 = 40;
        let right = (0..SIDE * SIDE).filter(|i| i % SIDE != SIDE - 1).map(|i| (i, i + 1));
        (
            vec![6; (SIDE * SIDE) as usize],
            right.chain((0..SIDE * (SIDE - 1)).map(|i| (i, i + SIDE))).collect(),
        )
    }

    /// Cameras in a row, and points with six neighbouring views each: fronts with many children.
    fn bundle() -> (Vec<usize>, Vec<(u32, u32)>) {
        let (cameras, points) = (60, 8000);
        let seen = |p: u32| (0..6).map(move |k| (p % (cameras - 5) + k, cameras + p));
        let dims = [vec![9; cameras as usize], vec![3; points as usize]].concat();
        (dims, (0..points).flat_map(seen).collect())
    }

    /// Two overlapping groups of fully coupled blocks: large fronts, one with an update.
    fn cliques() -> (Vec<usize>, Vec<(u32, u32)>) {
        let clique = |from: u32, to: u32| (from..to).flat_map(move |a| (from..a).map(move |b| (a, b)));
        (vec![6; 120], clique(0, 80).chain(clique(40, 120)).collect())
    }

    /// Returns factor and solution of a system on `threads` threads.
    fn solved((dims, pairs): (Vec<usize>, Vec<(u32, u32)>), threads: usize) -> (Vec<f64>, Vec<f64>) {
        let layout = Layout::new(&dims, pairs, &Order::Best).unwrap();
        let mut h: Vec<f64> = (0..layout.row_idx.len()).map(|i| (i as f64 * 0.7).sin()).collect();
        layout.diagonal().iter().for_each(|at| h[*at] += 2000.0);
        let h = h;
        let mut cholesky = Cholesky::new(layout.structure(false)).unwrap();
        assert!(cholesky.structure.flops > WORTH_THREADS, "{}", cholesky.structure.flops);
        let right: Vec<f64> = (0..layout.dim()).map(|i| (i as f64).cos()).collect();
        let mut x = right.clone();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            cholesky.factorize(&h, None, &mut x).unwrap();
            cholesky.solve_upper(&mut x);
        });
        let mut product = vec![0.0; x.len()];
        layout.multiply_add(&h, &x, &mut product);
        assert!(product.iter().zip(&right).all(|(a, b)| (a - b).abs() < 1e-12), "it solves the system");
        (cholesky.values, x)
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for system in [grid(), bundle(), cliques()] {
            let alone = solved(system.clone(), 1);
            for threads in [2, 4] {
                let together = solved(system.clone(), threads);
                assert!(bits(&together.1) == bits(&alone.1), "{threads} threads: another solution");
                assert!(bits(&together.0) == bits(&alone.0), "{threads} threads: another factor");
            }
        }
    }
}
