//! Supernodal sparse Cholesky: structure once, numbers many times, in memory that is reused.
use super::structure::{Node, Structure};
use super::{NotPositiveDefinite, kernel};
use faer::dyn_stack::MemBuffer;
use pulp::{Arch, Simd, WithSimd};

/// A factorization of a symmetric matrix with a fixed pattern, already ordered.
pub(crate) struct Cholesky {
    pub(super) structure: Structure,
    /// Panels of L.
    pub(super) values: Vec<f64>,
    /// Updates on their way to their parents, of nodes on even and on odd levels.
    updates: [Vec<f64>; 2],
    /// Nodes whose updates are on the stack.
    open: Vec<usize>,
    /// Rows below a supernode, of a right-hand side.
    below: Vec<f64>,
    memory: MemBuffer,
    arch: Arch,
}

impl Cholesky {
    /// Memory for a factor of this structure; `None` where there is none.
    pub(crate) fn new(structure: Structure) -> Option<Self> {
        let most = |f: fn(&Node) -> usize| structure.nodes.iter().map(f).max().unwrap_or(0);
        Some(Self {
            values: zeros(structure.values)?,
            updates: [zeros(structure.updates[0])?, zeros(structure.updates[1])?],
            open: Vec::with_capacity(structure.nodes.len()),
            below: zeros(most(|n| n.below))?,
            memory: kernel::scratch(most(|n| n.width)),
            arch: Arch::new(),
            structure,
        })
    }

    /// Factorizes a matrix with these values in its lower triangle, and `added` to its diagonal. On the way,
    /// while panels are at hand, x ← L⁻¹ x.
    pub(crate) fn factorize(
        &mut self,
        h: &[f64],
        added: Option<&[f64]>,
        x: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        self.arch.dispatch(Factorize { cholesky: self, h, added, x })
    }

    /// x ← H⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        self.arch.dispatch(Solve { cholesky: self, x, lower: true });
    }

    /// x ← L⁻ᵀ x: the rest of a solve whose first half was made while factorizing.
    pub(crate) fn solve_upper(&mut self, x: &mut [f64]) {
        self.arch.dispatch(Solve { cholesky: self, x, lower: false });
    }

    /// The pivots: squares of the factor's diagonal.
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
    // ask first; then take zeroed pages as the system has them, without writing to each
    Vec::<f64>::new().try_reserve_exact(n).ok()?;
    Some(vec![0.0; n])
}

struct Factorize<'a> {
    cholesky: &'a mut Cholesky,
    h: &'a [f64],
    added: Option<&'a [f64]>,
    x: &'a mut [f64],
}

impl WithSimd for Factorize<'_> {
    type Output = Result<(), NotPositiveDefinite>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Cholesky { structure, values, updates, open, below, memory, .. } = self.cholesky;
        open.clear();
        for (n, node) in structure.nodes.iter().enumerate() {
            let panel = &mut values[node.panel..node.panel + node.height() * node.width];
            panel.fill(0.0);
            for (at, h) in structure.scatter[node.entries.clone()].iter().zip(&self.h[node.entries.clone()]) {
                panel[*at as usize] = *h;
            }
            if let Some(added) = self.added {
                for c in 0..node.width {
                    panel[c * (node.height() + 1)] += added[node.first + c];
                }
            }
            let [own, other] = updates;
            let (update, theirs) = if node.level % 2 == 0 { (own, other) } else { (other, own) };
            let children = open.len() - node.children;
            for child in &open[children..] {
                let child = &structure.nodes[*child];
                kernel::assemble_panel(
                    child.update_in(theirs),
                    child.rows(&structure.places),
                    panel,
                    node.width,
                );
            }
            let update = &mut update[node.update..node.update + node.below.pow(2)];
            kernel::eliminate(simd, panel, update, node.width, memory).map_err(|_| NotPositiveDefinite)?;
            solve_lower(node, structure, panel, self.x, below);
            for child in open.drain(children..) {
                let child = &structure.nodes[child];
                let (from, places) = (child.update_in(theirs), child.rows(&structure.places));
                kernel::assemble_update(from, places, update, node.below, node.width);
            }
            open.push(n);
        }
        Ok(())
    }
}

/// The part of x ← L⁻¹ x that one panel has.
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
    /// Whether L⁻¹ comes before L⁻ᵀ.
    lower: bool,
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
        for node in structure.nodes.iter().rev() {
            let below = &mut below[..node.below];
            let rows = node.rows(&structure.rows);
            below.iter_mut().zip(rows).for_each(|(value, row)| *value = x[*row as usize]);
            kernel::solve_upper(panel(node), &mut x[node.first..node.first + node.width], below);
        }
    }
}
