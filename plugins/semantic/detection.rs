//! Further residuals of detections in an image.
mod conic_distance;
mod tangent_planes;

pub use conic_distance::ConicDistance;
pub use tangent_planes::TangentPlanes;
