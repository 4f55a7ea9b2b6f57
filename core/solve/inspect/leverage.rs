//! How much of each measurement the estimate takes up: its leverage.
use crate::inspect::CovarianceError;
use crate::linear::system::NoFactor;
use crate::problem::Problem;

/// Damping, as a share of the diagonal of H.
const SHIFT: f64 = 1e-11;
/// Of the largest entry of the diagonal: less than this share of it counts as this share.
const FLOOR: f64 = 1e-9;

impl Problem {
    /// The leverage of each row of each factor at the estimate, in the order of the graph: the diagonal of J H⁻¹ Jᵀ, J
    /// whitened and with robust weights. From 0, where all other measurements say the same, to 1, where no other measurement
    /// says anything and the residual is zero whatever is measured. One less it is the row's redundancy; all leverages
    /// together are the number of unknowns that anything constrains. Empty for a factor that takes no part.
    ///
    /// # Errors
    /// If there is no memory, or something is not finite.
    pub fn leverages(&mut self) -> Result<Vec<Vec<f64>>, CovarianceError> {
        self.linearize_once();
        let out_of_memory = self.out_of_memory();
        let floor = FLOOR * self.system.largest();
        // a direction that nothing constrains has rows of zeros in J: it takes nothing up, however it is held
        let damping: Vec<f64> = self.system.diagonal().map(|d| SHIFT * d.max(floor)).collect();
        match self.system.factorize_directly(Some(&damping)) {
            Ok(()) => {}
            Err(NoFactor::OutOfMemory) => return Err(out_of_memory),
            Err(NoFactor::NotPositiveDefinite) => return Err(CovarianceError::NotPositiveDefinite),
        }
        let Self { model, system, .. } = self;
        let inverse =
            system.cholesky().and_then(|cholesky| cholesky.selected_inverse()).ok_or(out_of_memory)?;
        let mut all = vec![vec![]; model.factors.len()];
        model.rows(&mut |factor| {
            let rows = factor.residual.len();
            // the columns of J, with the unknown that each belongs to
            let columns: Vec<(usize, &[f64])> = factor
                .blocks
                .iter()
                .flat_map(|(start, block)| {
                    block.chunks(rows.max(1)).enumerate().map(move |(d, j)| (start + d, j))
                })
                .collect();
            let mut leverages = vec![0.0; rows];
            for (a, (i, left)) in columns.iter().enumerate() {
                for (b, (k, right)) in columns.iter().enumerate().take(a + 1) {
                    let twice = if a == b { 1.0 } else { 2.0 };
                    let covariance = twice * inverse.get(*i, *k).unwrap_or(0.0);
                    for (row, leverage) in leverages.iter_mut().enumerate() {
                        *leverage += left[row] * covariance * right[row];
                    }
                }
            }
            if let Some(place) = all.get_mut(factor.entry) {
                *place = leverages;
            }
        });
        Ok(all)
    }
}
