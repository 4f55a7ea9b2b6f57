//! What formulas know of quadrics.
use crate::DualQuadric;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{register_functions, register_quantity};
use nalgebra::Vector3;

register_quantity!(DualQuadric);

register_functions! {
    /// The direction of the longest semi-axis, the first of equals; its sign means nothing.
    fn major_axis(q: DualQuadric) -> Vector3<f64> { q.major_axis() }

    /// The centre of an object.
    fn centroid(q: DualQuadric) -> Vector3<f64> { q.centroid() }

    /// Half the extents of an object along its own axes.
    fn semi_axes(q: DualQuadric) -> Vector3<f64> { q.semi_axes }

    /// Which way an object is turned.
    fn rotation(q: DualQuadric) -> So3 { q.pose.rotation }

    /// The pose of an object, from its own frame to the outer one.
    fn pose(q: DualQuadric) -> Se3 { q.pose }

    /// Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)²: so far above its lowest point is its centre.
    fn extent(q: DualQuadric, u: Vector3<f64>) -> f64 {
        q.pose.rotation.inverse().act(&u).component_mul(&q.semi_axes).norm_squared().sqrt()
    }
}
