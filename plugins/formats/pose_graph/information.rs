//! Conversion of information matrices to noise models, with repair of invalid ones.
use super::InformationRepair;
use crate::error::Mistake;
use manifactor_graph::Noise;
use manifactor_graph::noise::NoiseError;
use nalgebra::{DMatrix, SymmetricEigen};

/// Eigenvalues are raised to this share of the largest: far below any measured value, and far enough above
/// rounding for a Cholesky factorization.
const EIGENVALUE_FLOOR: f64 = 1e-9;

/// Noise model of an edge, and how it was obtained.
pub(crate) enum EdgeNoise {
    AsWritten(Noise),
    Clamped(Noise),
    Rejected,
}

pub(crate) fn noise(information: &DMatrix<f64>, repair: InformationRepair) -> Result<EdgeNoise, Mistake> {
    match (Noise::information(information.clone()), repair) {
        (Ok(noise), _) => Ok(EdgeNoise::AsWritten(noise)),
        (Err(NoiseError::NotPositiveDefinite { .. }), InformationRepair::Reject) => Ok(EdgeNoise::Rejected),
        (Err(NoiseError::NotPositiveDefinite { .. }), InformationRepair::Clamp) => Ok(clamped(information)),
        (Err(e), _) => Err(e.into()),
    }
}

fn clamped(information: &DMatrix<f64>) -> EdgeNoise {
    let SymmetricEigen { eigenvectors, mut eigenvalues } = SymmetricEigen::new(information.clone());
    let floor = EIGENVALUE_FLOOR * eigenvalues.max();
    eigenvalues.apply(|x| *x = x.max(floor));
    let m = &eigenvectors * DMatrix::from_diagonal(&eigenvalues) * eigenvectors.transpose();
    // The product is symmetric only up to rounding.
    match Noise::information((&m + m.transpose()) * 0.5) {
        Ok(noise) => EdgeNoise::Clamped(noise),
        Err(_) => EdgeNoise::Rejected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn clamping_keeps_what_is_positive() {
        let indefinite = dmatrix![2.0, 0.0; 0.0, -1.0];
        let Ok(EdgeNoise::Clamped(noise)) = noise(&indefinite, InformationRepair::Clamp) else {
            panic!("expected a clamped noise")
        };
        let m = noise.information_matrix(2).unwrap();
        assert!((m - dmatrix![2.0, 0.0; 0.0, 2e-9]).norm() < 1e-15);
    }

    #[test]
    fn nothing_is_left_of_a_matrix_without_information() {
        for none in [dmatrix![0.0, 0.0; 0.0, 0.0], dmatrix![-1.0, 0.0; 0.0, -2.0]] {
            assert!(matches!(noise(&none, InformationRepair::Clamp), Ok(EdgeNoise::Rejected)));
            assert!(matches!(noise(&none, InformationRepair::Reject), Ok(EdgeNoise::Rejected)));
            assert!(noise(&none, InformationRepair::Error).is_err());
        }
    }
}
