//! Prior on the proportions of objects of a class.
use crate::DualQuadric;
use crate::shapes::{AxisOrder, SemiAxes};
use manifactor_graph::prelude::*;

/// An object has the proportions of its class, at any size: r = log(s/s₀) minus its mean.
///
/// Three rows that sum to zero, so they constrain two directions and leave the size free. The order of the
/// axes is as in `size_prior`, including its kinks and the effects of equal lengths. Defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "shape_prior", semi_axes = [1.0, 1.0, 3.0] }
/// noise  = { sigma = 0.3 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapePrior {
    /// Proportions of the class: semi-axes at any scale.
    pub semi_axes: SemiAxes,
    /// Order of the semi-axes in the comparison.
    #[serde(default)]
    pub order: AxisOrder,
}

impl Residual for ShapePrior {
    type Variables = (DualQuadric,);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector3<T> {
        let r = self.order.log_ratio(&quadric.semi_axes, &self.semi_axes);
        let mean = r.sum() / 3.0;
        r.map(|r| r - mean)
    }
}
register_factor!("shape_prior", ShapePrior);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_quadric, typical_quadric, unequal_quadric};
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    jacobian_laws! {
        the_jacobian_is_right: (typical_quadric(), unequal_quadric())
            .prop_map(|((semi_axes, order), q)| (ShapePrior { semi_axes, order }, q));
    }

    #[test]
    fn the_shape_is_free_of_the_size() {
        check((typical_quadric(), any_quadric(), 0.1..10.0), |((semi_axes, order), quadric, size)| {
            let other = DualQuadric { semi_axes: quadric.semi_axes * size, ..quadric };
            invariance_law(&ShapePrior { semi_axes, order }, &[&quadric], &[&other])
        });
    }
}
