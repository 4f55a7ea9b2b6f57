//! Functions of quadrics for formulas.
use crate::DualQuadric;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{register_functions, register_quantity};
use nalgebra::Vector3;

register_quantity!(DualQuadric);

register_functions! {
    /// The unit direction of the longest semi-axis, the first of equal ones. Its sign is arbitrary.
    fn major_axis(q: DualQuadric) -> Vector3<f64> { q.major_axis() }

    /// The centre of an object.
    fn centroid(q: DualQuadric) -> Vector3<f64> { q.centroid() }

    /// Half the extents of an object along its principal axes.
    fn semi_axes(q: DualQuadric) -> Vector3<f64> { q.semi_axes }

    /// The rotation of an object.
    fn rotation(q: DualQuadric) -> So3 { q.pose.rotation }

    /// The pose of an object, from its local frame to the outer one.
    fn pose(q: DualQuadric) -> Se3 { q.pose }

    /// Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)². The centre is this far above the
    /// lowest point.
    fn extent(q: DualQuadric, u: Vector3<f64>) -> f64 {
        q.pose.rotation.inverse().act(&u).component_mul(&q.semi_axes).norm_squared().sqrt()
    }
}
