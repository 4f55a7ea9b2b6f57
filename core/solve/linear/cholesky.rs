//! Supernodal sparse Cholesky: structure once, numbers many times, in memory that is reused.
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// A factorization of a symmetric matrix with a fixed pattern, already ordered.
pub(crate) struct Cholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    memory: MemBuffer,
}

/// The matrix is not positive definite, as far as f64 can tell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NotPositiveDefinite;

impl Cholesky {
    /// Analyses a lower triangle in compressed columns; `None` where there is no memory for it.
    pub(crate) fn analyze(col_ptr: &[usize], row_idx: &[usize]) -> Option<Self> {
        let n = col_ptr.len() - 1;
        let lower = SymbolicSparseColMatRef::new_checked(n, n, col_ptr, None, row_idx);
        // faer 0.24 reads an upper pattern here for `Identity`, whatever the side says, while its
        // numeric part wants lower values
        let upper = lower.to_row_major().ok()?;
        let params = CholeskySymbolicParams {
            // its own choice takes the simplicial kernel for pose graphs: up to three times slower
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(
            upper.as_ref().transpose(),
            Side::Upper,
            SymmetricOrdering::Identity,
            params,
        )
        .ok()?;
        let need = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]);
        let mut values = vec![];
        values.try_reserve_exact(symbolic.len_val()).ok()?;
        values.resize(symbolic.len_val(), 0.0);
        Some(Self { values, memory: MemBuffer::try_new(need).ok()?, symbolic })
    }

    /// Factorizes a matrix of the analysed pattern.
    pub(crate) fn factorize(
        &mut self,
        col_ptr: &[usize],
        row_idx: &[usize],
        values: &[f64],
    ) -> Result<(), NotPositiveDefinite> {
        let n = col_ptr.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, col_ptr, None, row_idx);
        let stack = MemStack::new(&mut self.memory);
        let lower = SparseColMatRef::new(pattern, values);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.values,
                lower,
                Side::Lower,
                Default::default(),
                // threads bring nothing on graphs of this size, and would change the order of sums
                Par::Seq,
                stack,
                Default::default(),
            )
            .map(|_| ())
            .map_err(|_| NotPositiveDefinite)
    }

    /// x ← H⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        let stack = MemStack::new(&mut self.memory);
        let x = MatMut::from_column_major_slice_mut(x, n, 1);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
    }

    /// The pivots: squares of the factor's diagonal.
    pub(crate) fn pivots(&self, visit: &mut impl FnMut(usize, f64)) {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else { return };
        let factor = SupernodalLltRef::new(symbolic, &self.values);
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let (first, block) = (node.start(), node.val());
            for i in 0..block.ncols() {
                visit(first + i, block[(i, i)] * block[(i, i)]);
            }
        }
    }
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Cholesky({} values)", self.values.len())
    }
}
