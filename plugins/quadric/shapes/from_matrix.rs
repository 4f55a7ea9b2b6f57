//! Conversion of a dual quadric, given as a matrix, to an ellipsoid.
use crate::shapes::DualQuadric;
use crate::shapes::{SemiAxes, SemiAxesError};
use manifactor_geometry::{Se3, So3};
use nalgebra::{Matrix3, Matrix4, Vector3};

/// The reason why a 4×4 matrix is not the dual quadric of an ellipsoid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EllipsoidError {
    /// An entry is not a number.
    #[error("the matrix has an entry that is not finite")]
    NotFinite,
    /// The corner entry is zero relative to the remaining entries.
    #[error("the centre is at infinity: the corner of the matrix is {corner:e}")]
    AtInfinity {
        /// Corner entry Q*₄₄.
        corner: f64,
    },
    /// The surface is a hyperboloid, or an ellipsoid without real points.
    #[error(
        "the surface is a hyperboloid or has no points: the squares of its semi-axes are {squares:?}, \
         all of them should be positive"
    )]
    NotPositive {
        /// Squares of the semi-axes, in order of size.
        squares: [f64; 3],
    },
    /// The ellipsoid is flat or unbounded.
    #[error("the surface is degenerate: {0}")]
    Degenerate(#[from] SemiAxesError),
}

/// Treatment of a surface that is not an ellipsoid.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum OnHyperboloid {
    /// Return an error.
    #[default]
    Reject,
    /// Use the absolute values of the squared semi-axes, as other implementations do.
    Absolute,
}

impl DualQuadric {
    /// Creates the ellipsoid with the dual quadric Q*, given up to scale; the matrix is symmetrized first.
    /// The semi-axes are sorted, longest first.
    ///
    /// # Errors
    /// If the surface is not an ellipsoid; a hyperboloid is rejected.
    pub fn from_matrix(matrix: &Matrix4<f64>) -> Result<Self, EllipsoidError> {
        Self::from_matrix_or(matrix, OnHyperboloid::Reject)
    }

    /// Works like [`DualQuadric::from_matrix`], with a choice for the treatment of a hyperboloid.
    ///
    /// # Errors
    /// As for [`DualQuadric::from_matrix`].
    pub fn from_matrix_or(matrix: &Matrix4<f64>, policy: OnHyperboloid) -> Result<Self, EllipsoidError> {
        if !matrix.iter().all(|x| x.is_finite()) {
            return Err(EllipsoidError::NotFinite);
        }
        let corner = matrix[(3, 3)];
        let q = (matrix + matrix.transpose()) * (-0.5 / corner);
        let centroid: Vector3<f64> = -q.fixed_view::<3, 1>(0, 3).into_owned();
        // Q* = [A - ttᵀ, -t; -tᵀ, -1]
        let shape: Matrix3<f64> = q.fixed_view::<3, 3>(0, 0) + centroid * centroid.transpose();
        if !shape.iter().all(|x| x.is_finite()) {
            return Err(EllipsoidError::AtInfinity { corner });
        }
        let eigen = shape.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let squares = order.map(|i| eigen.eigenvalues[i]);
        if policy == OnHyperboloid::Reject && !squares.iter().all(|s| *s > 0.0) {
            return Err(EllipsoidError::NotPositive { squares });
        }
        let mut axes = Matrix3::from_columns(&order.map(|i| eigen.eigenvectors.column(i)));
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let semi_axes = SemiAxes::new(Vector3::from(squares).map(|s| s.abs().sqrt()))?.vector();
        Ok(Self { pose: Se3::new(So3::from_matrix(&axes), centroid), semi_axes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_quadric;
    use manifactor_testing::check;

    #[test]
    fn the_matrix_of_an_ellipsoid_gives_it_back() {
        check(any_quadric(), |quadric| {
            let matrix = quadric.matrix();
            let back = DualQuadric::from_matrix(&(matrix * -3.0)).unwrap();
            assert!((back.matrix() - matrix).norm() < 1e-12 * (1.0 + matrix.norm()));
            assert!(back.semi_axes[0] >= back.semi_axes[1] && back.semi_axes[1] >= back.semi_axes[2]);
            Ok(())
        });
    }

    #[test]
    fn what_is_no_ellipsoid_is_rejected_with_the_reason() {
        let diagonal = |a, b, c, d| Matrix4::from_diagonal(&nalgebra::Vector4::new(a, b, c, d));
        let read = |m: Matrix4<f64>| DualQuadric::from_matrix(&m).unwrap_err();
        let hyperboloid = diagonal(1.0, -0.25, 0.5, -1.0);
        assert_eq!(read(hyperboloid), EllipsoidError::NotPositive { squares: [1.0, 0.5, -0.25] });
        assert!(matches!(read(diagonal(1.0, 1.0, 1.0, 1.0)), EllipsoidError::NotPositive { .. }));
        assert!(matches!(read(diagonal(1.0, 1.0, 0.0, -1.0)), EllipsoidError::NotPositive { .. }));
        assert!(matches!(read(diagonal(1.0, 1.0, 1e-30, -1.0)), EllipsoidError::Degenerate(_)));
        assert!(matches!(read(diagonal(1.0, 1.0, 1.0, 0.0)), EllipsoidError::AtInfinity { .. }));
        assert_eq!(read(diagonal(1.0, f64::NAN, 1.0, -1.0)), EllipsoidError::NotFinite);
        let absolute = DualQuadric::from_matrix_or(&hyperboloid, OnHyperboloid::Absolute).unwrap();
        assert!((absolute.semi_axes - Vector3::new(1.0, 0.5f64.sqrt(), 0.5)).norm() < 1e-15);
    }
}
