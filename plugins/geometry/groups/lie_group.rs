//! Lie groups with the chart x ⊞ δ = x·Exp(δ), as priors and between factors need them.
use manifactor_graph::{Block, Dimension, Manifold, Matrix, Scalar, Tangent, Vector};

/// A manifold that is a group, with the chart x ⊞ δ = x·Exp(δ), y ⊟ x = Log(x⁻¹y).
pub trait LieGroup: Manifold {
    /// Name in documents.
    const NAME: &'static str;
    /// A point in the inline TOML form used inside a factor; an example for the catalogue.
    const EXAMPLE: &'static str;
    /// Number of leading rows of the Jacobians that depend only on as many leading directions, so that the
    /// block next to them is zero. For example, rotations do not depend on translations. Zero if there is no
    /// such structure.
    const LEADING: usize = 0;

    /// Returns the identity element.
    fn identity() -> Self;
    /// Returns x·y, normalized so that long products stay in the group.
    fn compose(x: &Self, y: &Self) -> Self;
    /// Returns x⁻¹.
    fn inverse(x: &Self) -> Self;
    /// Returns x⁻¹y, the second element in the frame of the first.
    fn between<T: Scalar>(x: &Self::Of<T>, y: &Self::Of<T>) -> Self::Of<T>;
    /// Returns the tangent vector at the identity that leads to `x`.
    fn log<T: Scalar>(x: &Self::Of<T>) -> Vector<Self::Dim, T>;
    /// Returns Jᵣ⁻¹(ξ), the derivative of Log(Exp(ξ)·Exp(δ)) with respect to δ at zero.
    fn inverse_right_jacobian(xi: &Tangent<Self>) -> Matrix<Self::Dim, Self::Dim>;
    /// Returns Ad(x⁻¹), with x⁻¹·Exp(δ)·x = Exp(Ad(x⁻¹)δ).
    fn adjoint_of_inverse(x: &Self::Of<f64>) -> Matrix<Self::Dim, Self::Dim>;

    /// Returns -AB for two Jacobians of this group, without nalgebra's trait bounds on generic dimensions.
    #[inline(always)]
    fn minus_product(
        a: &Matrix<Self::Dim, Self::Dim>,
        b: &Matrix<Self::Dim, Self::Dim>,
    ) -> Matrix<Self::Dim, Self::Dim> {
        let n = <Self::Dim as Dimension>::N;
        let mut product = <Matrix<Self::Dim, Self::Dim> as Block>::zeros();
        let (a, b, sum) = (a.as_slice(), b.as_slice(), product.as_mut_slice());
        // Index of the first nonzero row in a column.
        let first = |column: usize| if column < Self::LEADING { 0 } else { Self::LEADING };
        for c in 0..n {
            for k in first(c)..n {
                for r in first(k)..n {
                    sum[r + c * n] -= a[r + k * n] * b[k + c * n];
                }
            }
        }
        product
    }
}

/// Implements [`LieGroup`] for a newtype of a vector, with addition as the group operation.
macro_rules! additive_group {
    ($type:ty, $n:literal, $name:literal, $example:literal) => {
        impl $crate::groups::LieGroup for $type {
            const NAME: &'static str = $name;
            const EXAMPLE: &'static str = $example;

            fn identity() -> Self {
                Self(nalgebra::SVector::zeros())
            }
            fn compose(x: &Self, y: &Self) -> Self {
                Self(x.0 + y.0)
            }
            fn inverse(x: &Self) -> Self {
                Self(-x.0)
            }
            fn between<T: manifactor_graph::Scalar>(
                x: &nalgebra::SVector<T, $n>,
                y: &nalgebra::SVector<T, $n>,
            ) -> nalgebra::SVector<T, $n> {
                y - x
            }
            fn log<T: manifactor_graph::Scalar>(x: &nalgebra::SVector<T, $n>) -> nalgebra::SVector<T, $n> {
                *x
            }
            fn inverse_right_jacobian(_: &nalgebra::SVector<f64, $n>) -> nalgebra::SMatrix<f64, $n, $n> {
                nalgebra::SMatrix::identity()
            }
            fn adjoint_of_inverse(_: &nalgebra::SVector<f64, $n>) -> nalgebra::SMatrix<f64, $n, $n> {
                nalgebra::SMatrix::identity()
            }
        }
    };
}
pub(crate) use additive_group;
