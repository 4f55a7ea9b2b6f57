//! What prior and between need of a manifold: that it is a Lie group with x ⊞ δ = x·Exp(δ).
use manifactor_graph::{Block, Dimension, Manifold, Matrix, Scalar, Tangent, Vector};

/// A manifold that is a group, with the chart x ⊞ δ = x·Exp(δ), y ⊟ x = Log(x⁻¹y).
pub trait LieGroup: Manifold {
    /// Its name in documents.
    const NAME: &'static str;
    /// A point, as TOML writes it inside of a factor; for the catalogue.
    const EXAMPLE: &'static str;
    /// The first so many rows of its Jacobians depend on as many directions only, as rotations do not on translations: the
    /// block beside is zero. None, where nothing is known.
    const LEADING: usize = 0;

    /// The element that changes nothing.
    fn identity() -> Self;
    /// x·y, normalised, so that long products stay in the group.
    fn compose(x: &Self, y: &Self) -> Self;
    /// x⁻¹
    fn inverse(x: &Self) -> Self;
    /// x⁻¹y: the second in the frame of the first.
    fn between<T: Scalar>(x: &Self::Of<T>, y: &Self::Of<T>) -> Self::Of<T>;
    /// The tangent vector at the identity that leads to `x`.
    fn log<T: Scalar>(x: &Self::Of<T>) -> Vector<Self::Dim, T>;
    /// Jᵣ⁻¹(ξ): the derivative of Log(Exp(ξ)·Exp(δ)) by δ at zero.
    fn inverse_right_jacobian(xi: &Tangent<Self>) -> Matrix<Self::Dim, Self::Dim>;
    /// Ad(x⁻¹): x⁻¹·Exp(δ)·x = Exp(Ad(x⁻¹)δ).
    fn adjoint_of_inverse(x: &Self::Of<f64>) -> Matrix<Self::Dim, Self::Dim>;

    /// -AB of two Jacobians of this group, without what nalgebra would ask of a generic dimension.
    #[inline(always)]
    fn minus_product(
        a: &Matrix<Self::Dim, Self::Dim>,
        b: &Matrix<Self::Dim, Self::Dim>,
    ) -> Matrix<Self::Dim, Self::Dim> {
        let n = <Self::Dim as Dimension>::N;
        let mut product = <Matrix<Self::Dim, Self::Dim> as Block>::zeros();
        let (a, b, sum) = (a.as_slice(), b.as_slice(), product.as_mut_slice());
        // the first row that is not zero in a column
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
