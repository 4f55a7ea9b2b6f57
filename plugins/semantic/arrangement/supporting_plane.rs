//! An object on a plane.
use crate::Plane;
use crate::directions::axis::extent;
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// The lowest point of an object is on a plane that is estimated too: r = n · c - offset - e, in metres.
///
/// Variables: the object, with centroid c, and the plane, with normal n. e = √Σ (sₖ Rₖ · n)² is half the
/// object's extent along n, for semi-axes s with directions R. r is the gap; it is negative if the object
/// sinks into the plane. Invariant to sliding along the plane and to rotating about its normal. Smooth and
/// defined everywhere. Three or more objects that are not in a line determine the plane; with fewer, add a
/// `prior_plane`. For supporting planes of quadrics see Hosseinzadeh et al., *Structure Aware SLAM using
/// Quadrics and Planes* (2018).
///
/// ```toml
/// [[factors]]
/// keys   = ["q0", "table"]
/// factor = { type = "supporting_plane" }
/// noise  = { sigma = 0.01 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupportingPlane {}

impl Residual for SupportingPlane {
    type Variables = (DualQuadric, Plane);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric, plane): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(plane.height(&quadric.centroid()) - extent(&quadric, &plane.normal))
    }
}
register_factor!("supporting_plane", SupportingPlane);
register_invariance!(
    SupportingPlane,
    "sliding along the plane and turning about its normal",
    |_, (quadric, plane), random| {
        let along = crate::S2::new(plane.normal).basis() * nalgebra::Vector2::new(random(5.0), random(5.0));
        let turn = manifactor_geometry::So3::exp(&(*plane.normal * random(3.0)));
        let mut moved = *quadric;
        moved.pose.translation += along;
        moved.pose.rotation = turn.compose(&quadric.pose.rotation);
        (moved, *plane)
    }
);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Se3, So3};
    use manifactor_graph::Direction;
    use manifactor_testing::factor_laws;
    use nalgebra::Vector3;

    factor_laws! { supporting_plane }

    #[test]
    fn the_error_is_the_gap_below_the_object() {
        let turned = So3::exp(&(Vector3::x() * std::f64::consts::FRAC_PI_2));
        let pose = Se3::new(turned, Vector3::new(0.3, 0.1, 1.0));
        let quadric = DualQuadric { pose, semi_axes: Vector3::new(0.1, 0.2, 0.3) };
        let plane = Plane { normal: Direction::Z, offset: 0.7 };
        // The object lies on its side: half its height is its y semi-axis.
        let r = SupportingPlane {}.residual::<f64>((quadric, manifactor_graph::Manifold::lift(&plane)));
        assert!((r.x - 0.1).abs() < 1e-12);
    }
}
