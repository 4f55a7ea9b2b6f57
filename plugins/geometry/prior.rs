//! What is known of a variable beforehand: r = Log(Z⁻¹X).
//!
//! The logarithm jumps where X differs from Z by a rotation of π.
use crate::lie_group::LieGroup;
use crate::{Point1, Point2, Point3, Se2, Se3, So2, So3};
use manifactor_graph::{Jacobians, Lifted, Refs, Residual, Scalar, Tangent, Vector, register_factor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The variable is close to `value`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(bound = "G: LieGroup + JsonSchema", description = description::<G>())]
pub struct Prior<G> {
    /// Where the variable is expected.
    pub value: G,
}

fn description<G: LieGroup>() -> String {
    format!(
        "The variable is close to `value`: r = Log(Z⁻¹X).\n\nOne row for each tangent direction ({}). \
         Two rotations that are half a turn apart have two shortest ways between them: there the \
         residual jumps.\n\n```toml\n[[factors]]\nkeys = [\"x0\"]\nfactor = {{ type = \"prior_{}\", \
         value = {} }}\nnoise = {{ sigma = 0.1 }}\n```",
        G::TANGENT.join(", "),
        G::NAME,
        G::EXAMPLE
    )
}

impl<G: LieGroup> Residual for Prior<G> {
    type Variables = (G,);
    type Dim = G::Dim;

    #[inline]
    fn residual<T: Scalar>(&self, (x,): Lifted<Self::Variables, T>) -> Vector<G::Dim, T> {
        G::log(&G::between(&self.value.lift(), &x))
    }
    fn linearize(
        &self,
        (x,): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Tangent<G> {
        let r = self.residual((x.lift(),));
        jacobians.0 = G::inverse_right_jacobian(&r);
        r
    }
}

register_factor!("prior_so2", Prior<So2>);
register_factor!("prior_so3", Prior<So3>);
register_factor!("prior_se2", Prior<Se2>);
register_factor!("prior_se3", Prior<Se3>);
register_factor!("prior_point1", Prior<Point1>);
register_factor!("prior_point2", Prior<Point2>);
register_factor!("prior_point3", Prior<Point3>);
