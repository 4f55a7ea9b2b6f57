//! Named axes of an object.
use manifactor_graph::Scalar;
use manifactor_quadric::DualQuadric;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A named axis of an object.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// The longest semi-axis at the current estimate, the first of equal ones. It jumps if a different axis
    /// becomes the longest.
    #[default]
    Longest,
    /// The shortest semi-axis, the first of equal ones: the normal of a flat object.
    Shortest,
    /// The local x axis of the object.
    X,
    /// The local y axis of the object.
    Y,
    /// The local z axis of the object.
    Z,
}

impl Axis {
    /// Returns the unit direction of the axis. The sign of the longest and the shortest axis is arbitrary.
    pub fn direction<T: Scalar>(self, quadric: &DualQuadric<T>) -> Vector3<T> {
        let s = &quadric.semi_axes;
        let index = match self {
            Self::Longest => return quadric.major_axis(),
            Self::Shortest => {
                let shorter = if s[1] < s[0] { 1 } else { 0 };
                if s[2] < s[shorter] { 2 } else { shorter }
            }
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        };
        quadric.pose.rotation.act(&Vector3::ith(index, T::one()))
    }
}

/// Returns half the extent of an object along a unit vector u: e = √Σ (sₖ Rₖ · u)².
pub(crate) fn extent<T: Scalar>(quadric: &DualQuadric<T>, u: &Vector3<T>) -> T {
    quadric.pose.rotation.inverse().act(u).component_mul(&quadric.semi_axes).norm_squared().sqrt()
}
