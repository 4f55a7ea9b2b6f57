//! Other residuals of a detected box than its sides.
mod conic_distance;
mod tangent_planes;

pub use conic_distance::ConicDistance;
pub use tangent_planes::TangentPlanes;
