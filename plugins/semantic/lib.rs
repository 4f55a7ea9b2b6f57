//! What is known of objects, as factors: what they rest on, how they stand to one another, what they may be.
//!
//! Beyond the orientations and sizes of `manifactor-quadric`, and with planes and directions as variables of their own. A
//! factor is a file.
mod accelerometer;
mod axis;
mod beside;
mod collinear;
mod conic_distance;
mod functions;
mod max_mixture;
mod on_object;
mod parallel;
mod plane;
mod point_inside;
mod s2;
mod supporting_plane;
mod tangent_planes;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod upright;

pub use accelerometer::Accelerometer;
pub use axis::Axis;
pub use beside::Beside;
pub use collinear::Collinear;
pub use conic_distance::ConicDistance;
pub use max_mixture::{Component, MaxMixture, MixtureError};
pub use on_object::OnObject;
pub use parallel::Parallel;
pub use plane::{Plane, PlaneOf, PlanePrior};
pub use point_inside::PointInside;
pub use s2::S2;
pub use supporting_plane::SupportingPlane;
pub use tangent_planes::TangentPlanes;
pub use upright::{Upright, UprightAlong};
