//! One variable seen from another, as odometry or a loop closure measures it: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).
//!
//! The logarithm jumps where measurement and estimate differ by a rotation of π.
use crate::lie_group::LieGroup;
use crate::{Point1, Point2, Point3, Se2, Se3, So2, So3};
use manifactor_graph::{
    Block, Dimension, Jacobians, Lifted, Matrix, Refs, Residual, Scalar, Tangent, Vector, register_factor,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The second variable is at `relative`, seen from the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(bound = "G: LieGroup + JsonSchema", description = description::<G>())]
pub struct Between<G> {
    /// The second variable in the frame of the first.
    pub relative: G,
}

fn description<G: LieGroup>() -> String {
    format!(
        "The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).\n\nOne row for \
         each tangent direction ({}). Two rotations that are half a turn apart have two shortest ways \
         between them: there the residual jumps.\n\n```toml\n[[factors]]\nkeys = [\"x0\", \"x1\"]\n\
         factor = {{ type = \"between_{}\", relative = {} }}\nnoise = {{ sigma = 0.1 }}\n```",
        G::TANGENT.join(", "),
        G::NAME,
        G::EXAMPLE
    )
}

impl<G: LieGroup> Residual for Between<G> {
    type Variables = (G, G);
    type Dim = G::Dim;

    #[inline]
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector<G::Dim, T> {
        G::log(&G::between(&self.relative.lift(), &G::between(&a, &b)))
    }
    fn linearize(
        &self,
        (a, b): Refs<'_, Self::Variables>,
        free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Tangent<G> {
        let b_in_a = G::between(&a.lift::<f64>(), &b.lift());
        let r = G::log(&G::between(&self.relative.lift(), &b_in_a));
        // Log(Z⁻¹ (A Exp δ)⁻¹ B) = Log(Z⁻¹ A⁻¹B · Exp(-Ad((A⁻¹B)⁻¹) δ))
        jacobians.1 = G::inverse_right_jacobian(&r);
        if free[0] {
            jacobians.0 = minus_product::<G::Dim>(&jacobians.1, &G::adjoint_of_inverse(&b_in_a));
        }
        r
    }
}

/// -A B, without what nalgebra would ask of a generic dimension.
#[inline(always)]
fn minus_product<D: Dimension>(a: &Matrix<D, D>, b: &Matrix<D, D>) -> Matrix<D, D> {
    let mut product = <Matrix<D, D> as Block>::zeros();
    let (a, b, to) = (a.as_slice(), b.as_slice(), product.as_mut_slice());
    for c in 0..D::N {
        for k in 0..D::N {
            for r in 0..D::N {
                to[r + c * D::N] -= a[r + k * D::N] * b[k + c * D::N];
            }
        }
    }
    product
}

register_factor!("between_so2", Between<So2>);
register_factor!("between_so3", Between<So3>);
register_factor!("between_se2", Between<Se2>);
register_factor!("between_se3", Between<Se3>);
register_factor!("between_point1", Between<Point1>);
register_factor!("between_point2", Between<Point2>);
register_factor!("between_point3", Between<Point3>);
