//! Numbers of a linearization that are not finite, and the factor that they come from.
use crate::problem::Problem;
use manifactor_graph::batch::FactorRows;

impl Problem {
    /// Whether g and H are finite. No entry of a sum of JᵀJ is larger than those on its diagonal, so these will do.
    pub(crate) fn is_finite(&self) -> bool {
        let diagonal = || self.layout.diagonal().iter().map(|i| self.h[*i]);
        self.g.iter().all(|g| g.is_finite()) && diagonal().all(f64::is_finite)
    }

    /// The factor with a residual or a derivative that is not finite; where all are, the one with the largest. Walks
    /// through the rows of all factors: for solves that have failed.
    pub(crate) fn not_finite_factor(&self) -> usize {
        let (mut factor, mut largest) = (0, f64::NEG_INFINITY);
        self.rows(&mut |rows| {
            let size = size(&rows);
            if size > largest {
                (factor, largest) = (rows.entry, size);
            }
        });
        factor
    }
}

/// Largest entry of a factor's rows; infinite where one is not a number.
fn size(rows: &FactorRows<'_>) -> f64 {
    let entries = rows.residual.iter().chain(rows.blocks.iter().flat_map(|(_, block)| block));
    entries.fold(0.0, |most, x| if x.is_nan() { f64::INFINITY } else { f64::max(most, x.abs()) })
}
