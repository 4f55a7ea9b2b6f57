//! Rotations and poses from matrices, which are checked.
use crate::{Se2, Se3, Sim3, So2, So3};
use nalgebra::{Matrix2, Matrix3, Matrix4, SMatrix};

/// Largest entry of RᵀR - 1 in a rotation matrix R. Unit quaternions have the same tolerance. Matrices in
/// single precision, and those printed with four decimals, are within it.
const TOLERANCE: f64 = 1e-3;

/// A matrix that is not a rotation or a pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// An entry is infinite or not a number.
    #[error("expected finite numbers, got {value} in row {row}, column {column}")]
    NotFinite {
        /// Index of the row, from 0.
        row: usize,
        /// Index of the column, from 0.
        column: usize,
        /// Value of the entry.
        value: f64,
    },
    /// The columns of the rotation are not of length one, or not perpendicular.
    #[error("expected a rotation R with RᵀR = 1, got one with entries of RᵀR that are off by {deviation:.6}")]
    NotOrthonormal {
        /// Largest entry of RᵀR - 1.
        deviation: f64,
    },
    /// The matrix changes right-handed axes to left-handed ones.
    #[error("expected a rotation, of determinant 1, got a reflection, of determinant {determinant:.6}")]
    Reflection {
        /// The determinant, close to -1.
        determinant: f64,
    },
    /// The matrix is not a rotation times a positive scale.
    #[error("expected a rotation times a positive scale, got a matrix of determinant {determinant:.6}")]
    NotSimilar {
        /// The determinant, zero or negative.
        determinant: f64,
    },
    /// The last row of a homogeneous matrix is not (0, …, 0, 1).
    #[error("expected zeros and a one in the last row, [R t; 0 1], got {value} in column {column}")]
    LastRow {
        /// Index of the first wrong column, from 0.
        column: usize,
        /// Value of the entry.
        value: f64,
    },
}

fn check_finite<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Result<(), MatrixError> {
    match matrix.iter().position(|x| !x.is_finite()) {
        Some(at) => Err(MatrixError::NotFinite { row: at % N, column: at / N, value: matrix[at] }),
        None => Ok(()),
    }
}

fn check_rotation<const N: usize>(r: &SMatrix<f64, N, N>, determinant: f64) -> Result<(), MatrixError> {
    let deviation = (r.transpose() * r - SMatrix::<f64, N, N>::identity()).amax();
    if deviation > TOLERANCE {
        return Err(MatrixError::NotOrthonormal { deviation });
    }
    if determinant < 0.0 { Err(MatrixError::Reflection { determinant }) } else { Ok(()) }
}

fn check_last_row<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Result<(), MatrixError> {
    let row = matrix.row(N - 1);
    let expected = |column: usize| if column + 1 == N { 1.0 } else { 0.0 };
    let wrong = row.iter().enumerate().find(|(column, x)| (**x - expected(*column)).abs() > TOLERANCE);
    wrong.map_or(Ok(()), |(column, value)| Err(MatrixError::LastRow { column, value: *value }))
}

impl So2 {
    /// Creates the rotation from a matrix that is orthogonal to within 0.001, of determinant 1.
    ///
    /// # Errors
    /// If the matrix is not a rotation.
    pub fn try_from_matrix(matrix: &Matrix2<f64>) -> Result<Self, MatrixError> {
        check_finite(matrix)?;
        check_rotation(matrix, matrix.determinant())?;
        Ok(Self::exp(matrix[(1, 0)].atan2(matrix[(0, 0)])))
    }
}

impl So3 {
    /// Creates the rotation from a matrix that is orthogonal to within 0.001, of determinant 1.
    ///
    /// # Errors
    /// If the matrix is not a rotation.
    pub fn try_from_matrix(matrix: &Matrix3<f64>) -> Result<Self, MatrixError> {
        check_finite(matrix)?;
        check_rotation(matrix, matrix.determinant())?;
        Ok(Self::from_matrix(matrix))
    }
}

impl Se2 {
    /// Creates the pose from the homogeneous matrix [R t; 0 1].
    ///
    /// # Errors
    /// If R is not a rotation, or if the last row is not (0, 0, 1).
    pub fn try_from_matrix(matrix: &Matrix3<f64>) -> Result<Self, MatrixError> {
        check_finite(matrix)?;
        check_last_row(matrix)?;
        let rotation = So2::try_from_matrix(&matrix.fixed_view::<2, 2>(0, 0).clone_owned())?;
        Ok(Self::new(rotation, matrix.fixed_view::<2, 1>(0, 2).clone_owned()))
    }
}

impl Se3 {
    /// Creates the pose from the homogeneous matrix [R t; 0 1].
    ///
    /// # Errors
    /// If R is not a rotation, or if the last row is not (0, 0, 0, 1).
    pub fn try_from_matrix(matrix: &Matrix4<f64>) -> Result<Self, MatrixError> {
        check_finite(matrix)?;
        check_last_row(matrix)?;
        let rotation = So3::try_from_matrix(&matrix.fixed_view::<3, 3>(0, 0).clone_owned())?;
        Ok(Self::new(rotation, matrix.fixed_view::<3, 1>(0, 3).clone_owned()))
    }
}

impl Sim3 {
    /// Creates the similarity from the homogeneous matrix [sR t; 0 1]. The scale s is the cube root of the
    /// determinant.
    ///
    /// # Errors
    /// If sR is not a rotation times a positive number, or if the last row is not (0, 0, 0, 1).
    pub fn try_from_matrix(matrix: &Matrix4<f64>) -> Result<Self, MatrixError> {
        check_finite(matrix)?;
        check_last_row(matrix)?;
        let scaled = matrix.fixed_view::<3, 3>(0, 0).clone_owned();
        let determinant = scaled.determinant();
        if determinant <= 0.0 {
            return Err(MatrixError::NotSimilar { determinant });
        }
        let scale = determinant.cbrt();
        let rotation = So3::try_from_matrix(&(scaled / scale))?;
        Ok(Self::new(rotation, matrix.fixed_view::<3, 1>(0, 3).clone_owned(), scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se2, any_se3, any_sim3};
    use manifactor_graph::Manifold;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_matrix_gives_its_similarity_back(x in any_sim3()) {
            prop_assert!(x.local(&Sim3::try_from_matrix(&x.matrix()).unwrap()).norm() < 1e-9);
        }

        #[test]
        fn a_matrix_gives_its_pose_back(x in any_se3(), y in any_se2()) {
            let again = Se3::try_from_matrix(&x.matrix()).unwrap();
            prop_assert!(x.local(&again).norm() < 1e-9);
            let again = Se2::try_from_matrix(&y.matrix()).unwrap();
            prop_assert!(y.local(&again).norm() < 1e-9);
        }
    }

    #[test]
    fn a_matrix_that_is_no_pose_is_refused() {
        let mut scaled = Matrix3::identity();
        scaled[(0, 0)] = 2.0;
        let found = So3::try_from_matrix(&scaled);
        assert_eq!(found, Err(MatrixError::NotOrthonormal { deviation: 3.0 }));
        let mirrored = Matrix2::new(1.0, 0.0, 0.0, -1.0);
        assert_eq!(So2::try_from_matrix(&mirrored), Err(MatrixError::Reflection { determinant: -1.0 }));
        let mut transposed = Matrix4::identity();
        transposed[(3, 1)] = 0.5;
        let found = Se3::try_from_matrix(&transposed);
        assert_eq!(found, Err(MatrixError::LastRow { column: 1, value: 0.5 }));
        transposed[(2, 1)] = f64::INFINITY;
        let found = Se3::try_from_matrix(&transposed);
        assert_eq!(found, Err(MatrixError::NotFinite { row: 2, column: 1, value: f64::INFINITY }));
    }
}
