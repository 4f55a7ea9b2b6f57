//! Leverage of measurements: the share of a measurement that the estimate absorbs.
use crate::inspect::CovarianceError;
use crate::linear::system::NoFactor;
use crate::problem::Problem;

/// Damping, as a share of the diagonal of H.
const DAMPING_SHARE: f64 = 1e-11;
/// Lower bound of diagonal entries for the damping, as a share of the largest entry.
const DIAGONAL_FLOOR: f64 = 1e-9;

impl Problem {
    /// Returns the leverage of each row of each factor at the estimate, in the order of the graph. It is
    /// the diagonal of J H⁻¹ Jᵀ, with J whitened and with robust weights. A leverage near 0 means that the
    /// remaining measurements determine the row's value. At 1 no further measurement constrains it, and its
    /// residual is always zero. 1 - leverage is the redundancy of the row. All leverages add up to the
    /// number of determined unknowns. Empty for an inactive factor.
    ///
    /// # Errors
    /// If there is no memory, or a value is not finite.
    pub fn leverages(&mut self) -> Result<Vec<Vec<f64>>, CovarianceError> {
        self.linearize_once();
        let out_of_memory = self.out_of_memory();
        let floor = DIAGONAL_FLOOR * self.system.largest();
        // undetermined directions have zeros in J, so their leverage is zero, whatever their damping
        let damping: Vec<f64> = self.system.diagonal().map(|d| DAMPING_SHARE * d.max(floor)).collect();
        match self.system.factorize_directly(Some(&damping)) {
            Ok(()) => {}
            Err(NoFactor::OutOfMemory) => return Err(out_of_memory),
            Err(NoFactor::NotPositiveDefinite) => return Err(CovarianceError::NotPositiveDefinite),
        }
        let Self { model, system, .. } = self;
        let at_bound = system.held_at_bound().to_vec();
        let inverse =
            system.cholesky().and_then(|cholesky| cholesky.selected_inverse()).ok_or(out_of_memory)?;
        let mut all = vec![vec![]; model.factors.len()];
        model.rows(&mut |factor| {
            let rows = factor.residual.len();
            // the columns of J, each with its unknown
            let columns: Vec<(usize, &[f64])> = factor
                .blocks
                .iter()
                .flat_map(|(start, block)| {
                    block.chunks(rows.max(1)).enumerate().map(move |(d, j)| (start + d, j))
                })
                .filter(|(unknown, _)| !at_bound.contains(unknown))
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
