//! Measured depth of an object.
use crate::DualQuadric;
use manifactor_geometry::Se3;
use manifactor_graph::checked::Positive;
use manifactor_graph::prelude::*;

/// A camera measures the depth of an object's centre: r = (Rᵀ(c - t))ᶻ - depth, c the centroid, R and t the
/// camera's pose.
///
/// The depth is along the optical axis, as in depth images, in metres. It does not constrain the object's
/// size. Defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "q0"]
/// factor = { type = "centroid_depth", depth = 1.8 }
/// noise  = { sigma = 0.05 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CentroidDepth {
    /// Measured depth, in metres.
    pub depth: Positive,
}

impl Residual for CentroidDepth {
    type Variables = (Se3, DualQuadric);
    type Dim = U1;
    const ROWS: &'static [&'static str] = &["depth"];

    fn residual<T: Scalar>(&self, (world_from_camera, quadric): Lifted<Self::Variables, T>) -> Vector1<T> {
        let in_camera = world_from_camera.inverse().act(&quadric.centroid());
        Vector1::new(in_camera.z - self.depth.get())
    }
}
register_factor!("centroid_depth", CentroidDepth);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_quadric;
    use manifactor_geometry::testing::any_se3;
    use manifactor_testing::jacobian_laws;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    jacobian_laws! {
        the_jacobian_is_right: (0.1..50.0f64, any_se3(), any_quadric())
            .prop_map(|(depth, x, q)| (CentroidDepth { depth: Positive::new(depth).unwrap() }, x, q));
    }

    #[test]
    fn the_depth_is_along_the_optical_axis() {
        let pose = Se3 { translation: Vector3::new(3.0, 1.0, 4.5), ..Se3::identity() };
        let quadric = DualQuadric { pose, semi_axes: Vector3::repeat(0.1) };
        let camera = Se3 { translation: Vector3::z(), ..Se3::identity() };
        let depth = Positive::new(3.0).unwrap();
        assert_eq!(CentroidDepth { depth }.residual::<f64>((camera, quadric)).x, 0.5);
    }
}
