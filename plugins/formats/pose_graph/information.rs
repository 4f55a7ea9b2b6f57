//! Conversion of information matrices to noise models, with repair of invalid ones.
use super::Repair;
use crate::error::Mistake;
use manifactor_graph::Noise;
use manifactor_graph::noise::NoiseError;
use nalgebra::{DMatrix, SymmetricEigen};

/// Eigenvalues are raised to this share of the largest: far below any measured value, and far enough above
/// rounding for a Cholesky factorization.
const FLOOR: f64 = 1e-9;

/// Noise model of an edge, and how it was obtained.
pub(crate) enum Outcome {
    AsWritten(Noise),
    Clamped(Noise),
    Rejected,
}

pub(crate) fn noise(information: &DMatrix<f64>, repair: Repair) -> Result<Outcome, Mistake> {
    match (Noise::information(information.clone()), repair) {
        (Ok(noise), _) => Ok(Outcome::AsWritten(noise)),
        (Err(NoiseError::NotPositiveDefinite { .. }), Repair::Reject) => Ok(Outcome::Rejected),
        (Err(NoiseError::NotPositiveDefinite { .. }), Repair::Clamp) => Ok(clamped(information)),
        (Err(e), _) => Err(e.into()),
    }
}

fn clamped(information: &DMatrix<f64>) -> Outcome {
    let SymmetricEigen { eigenvectors, mut eigenvalues } = SymmetricEigen::new(information.clone());
    let floor = FLOOR * eigenvalues.max();
    eigenvalues.apply(|x| *x = x.max(floor));
    let m = &eigenvectors * DMatrix::from_diagonal(&eigenvalues) * eigenvectors.transpose();
    // The product is symmetric only up to rounding.
    match Noise::information((&m + m.transpose()) * 0.5) {
        Ok(noise) => Outcome::Clamped(noise),
        Err(_) => Outcome::Rejected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn clamping_keeps_what_is_positive() {
        let indefinite = dmatrix![2.0, 0.0; 0.0, -1.0];
        let Ok(Outcome::Clamped(noise)) = noise(&indefinite, Repair::Clamp) else {
            panic!("expected a clamped noise")
        };
        let m = noise.information_matrix(2).unwrap();
        assert!((m - dmatrix![2.0, 0.0; 0.0, 2e-9]).norm() < 1e-15);
    }

    #[test]
    fn nothing_is_left_of_a_matrix_without_information() {
        for none in [dmatrix![0.0, 0.0; 0.0, 0.0], dmatrix![-1.0, 0.0; 0.0, -2.0]] {
            assert!(matches!(noise(&none, Repair::Clamp), Ok(Outcome::Rejected)));
            assert!(matches!(noise(&none, Repair::Reject), Ok(Outcome::Rejected)));
            assert!(noise(&none, Repair::Error).is_err());
        }
    }
}
