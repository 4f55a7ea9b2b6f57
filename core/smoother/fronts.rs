//! Numerical values of the fronts: panels of the Cholesky factor, and the stored updates to their parents.
//!
//! The right-hand side −g is the last row of each front. Elimination therefore includes the forward
//! substitution, and a kept front already has its part of the result.
mod assembly;
mod elimination;
mod pool;
mod substitution;

use crate::elimination_tree::{Affected, Front, Tree};
use crate::model::{Blocks, Overflow};
use assembly::Run;
use elimination::Build;
use manifactor_solve::front::Scratch;
use pool::Pool;
use pulp::Arch;
use substitution::Backward;

/// A scalar unknown: a variable and a direction of its tangent space.
pub(crate) type Scalar = (u32, u32);

/// The values of one front.
#[derive(Debug, Default)]
struct Numbers {
    /// Column-major, `width` columns of `width + below + 1` rows.
    panel: Vec<f64>,
    /// The lower triangle of a square of `below + 1` columns.
    update: Vec<f64>,
    /// Directions that no factor constrains within f64 precision, after all earlier variables are eliminated.
    undetermined: Vec<Scalar>,
}

/// The values of all fronts of a tree.
#[derive(Debug)]
pub(crate) struct Fronts {
    numbers: Vec<Numbers>,
    pool: Pool,
    /// By variable: the stamp of a front, and the first row of the variable in that front.
    place: Vec<(u64, u32)>,
    stamp: u64,
    runs: Vec<Run>,
    x: Vec<f64>,
    scratch: Scratch,
    arch: Arch,
}

/// Front width that sizes the scratch memory of the dense kernels. Wider fronts need no more.
const SCRATCH_WIDTH: usize = 1 << 10;

impl Default for Fronts {
    fn default() -> Self {
        Self {
            numbers: vec![],
            pool: Pool::default(),
            place: vec![],
            stamp: 0,
            runs: vec![],
            x: vec![],
            scratch: Scratch::new(SCRATCH_WIDTH),
            arch: Arch::new(),
        }
    }
}

impl Fronts {
    /// Makes room for `variables` variables.
    pub(crate) fn resize(&mut self, variables: usize) {
        self.place.resize(variables, (0, 0));
    }

    /// Assembles and factorizes new fronts, children before parents.
    ///
    /// # Errors
    /// If a sum is not finite. The new fronts are dropped.
    pub(crate) fn build(&mut self, tree: &Tree, blocks: &Blocks, new: &[u32]) -> Result<(), Overflow> {
        self.numbers.resize_with(tree.fronts.len(), Numbers::default);
        let arch = self.arch;
        let built = arch.dispatch(Build { fronts: self, tree, blocks, new });
        if built.is_err() {
            self.release(new);
        }
        built
    }

    /// Releases the memory of replaced fronts.
    pub(crate) fn drop_all(&mut self, affected: &Affected) {
        self.release(&affected.0);
    }

    fn release(&mut self, fronts: &[u32]) {
        for f in fronts {
            let Numbers { panel, update, .. } = std::mem::take(&mut self.numbers[*f as usize]);
            self.pool.release(panel);
            self.pool.release(update);
        }
    }

    /// Returns the directions of a front's variables that no factor constrains.
    pub(crate) fn undetermined_directions(&self, front: u32) -> &[Scalar] {
        &self.numbers[front as usize].undetermined
    }

    /// Computes the steps of a front's variables, concatenated, from the steps of its rows. `delta` holds the
    /// steps of all variables.
    pub(crate) fn solve(&mut self, front: &Front, number: u32, blocks: &Blocks, delta: &[f64]) -> &[f64] {
        self.x.resize(front.width, 0.0);
        for row in &front.rows {
            self.x.extend_from_slice(&delta[blocks.range(*row)]);
        }
        let panel = &self.numbers[number as usize].panel[..front.width * (front.width + front.below + 1)];
        self.arch.dispatch(Backward { panel, width: front.width, x: &mut self.x });
        self.x.truncate(front.width);
        &self.x
    }

    /// Computes x ← L⁻¹ x for one front: see [`substitution::forward`].
    pub(crate) fn forward(&self, front: &Front, number: u32, x: &mut [f64], below: &mut [f64]) {
        let panel = &self.numbers[number as usize].panel[..front.width * (front.width + front.below + 1)];
        substitution::forward(panel, x, below);
    }

    /// Returns the bytes of all fronts and of the free lists.
    pub(crate) fn bytes(&self) -> usize {
        self.pool.bytes()
    }
}
