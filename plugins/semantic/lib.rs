//! What is known of objects, as factors: what they rest on, how they stand to one another, what they may be.
//!
//! Beyond the orientations and sizes of `manifactor-quadric`, and with planes and directions as variables of their own. A
//! factor is a file.
mod arrangement;
mod detection;
mod directions;
mod functions;
mod max_mixture;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use arrangement::{
    Beside, Collinear, OnObject, Plane, PlaneOf, PlanePrior, PointInside, SupportingPlane,
};
pub use detection::{ConicDistance, TangentPlanes};
pub use directions::{Accelerometer, Axis, Parallel, Resting, RestingAlong, S2, Upright, UprightAlong};
pub use max_mixture::{Component, MaxMixture, MixtureError};
