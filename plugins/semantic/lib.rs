//! Semantic factors of objects: support, arrangement, orientation and mixtures.
//!
//! They add to the orientation and size factors of `manifactor-quadric`, with planes and directions as
//! additional variables. One file per factor.
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
