//! Least squares min ‖J δ + r‖ by the sparse QR factorization of J, which does not square the condition
//! number.
use crate::linear::NotPositiveDefinite;
use faer::Col;
use faer::linalg::solvers::SolveLstsq;
use faer::sparse::linalg::solvers::{Qr as Factor, SymbolicQr};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, Triplet};

/// Rows of a least-squares problem, and the structure of its factor.
#[derive(Default)]
pub(crate) struct Qr {
    entries: Vec<Triplet<usize, usize, f64>>,
    right: Vec<f64>,
    /// Symbolic factorization of the last pattern. The pattern changes when factors become undefined.
    symbolic: Option<(SymbolicSparseColMat<usize>, SymbolicQr<usize>)>,
}

impl Qr {
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
        self.right.clear();
    }

    /// Adds a row: its entries, and its residual.
    pub(crate) fn push(&mut self, entries: impl Iterator<Item = (usize, f64)>, residual: f64) {
        let row = self.right.len();
        self.entries.extend(entries.map(|(column, value)| Triplet::new(row, column, value)));
        self.right.push(-residual);
    }

    /// Writes the solution to `x`, one entry for each unknown.
    ///
    /// # Errors
    /// If there is no solution, or it is not finite.
    pub(crate) fn solve(&mut self, x: &mut [f64]) -> Result<(), NotPositiveDefinite> {
        let (rows, columns) = (self.right.len(), x.len());
        if rows < columns {
            return Err(NotPositiveDefinite);
        }
        let j = SparseColMat::try_new_from_triplets(rows, columns, &self.entries)
            .map_err(|_| NotPositiveDefinite)?;
        let is_known = self.symbolic.as_ref().is_some_and(|(pattern, _)| {
            pattern.col_ptr() == j.symbolic().col_ptr() && pattern.row_idx() == j.symbolic().row_idx()
        });
        if !is_known {
            let symbolic = SymbolicQr::try_new(j.symbolic()).map_err(|_| NotPositiveDefinite)?;
            self.symbolic = Some((j.symbolic().to_owned().map_err(|_| NotPositiveDefinite)?, symbolic));
        }
        let Some((_, symbolic)) = &self.symbolic else { return Err(NotPositiveDefinite) };
        let factor =
            Factor::try_new_with_symbolic(symbolic.clone(), j.as_ref()).map_err(|_| NotPositiveDefinite)?;
        let solution = factor.solve_lstsq(Col::from_fn(rows, |i| self.right[i]));
        x.iter_mut().zip(solution.iter()).for_each(|(x, s)| *x = *s);
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(NotPositiveDefinite) }
    }
}

impl std::fmt::Debug for Qr {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Qr({} rows)", self.right.len())
    }
}
