//! Arrangement of objects relative to planes, points and each other.
mod beside;
mod collinear;
mod on_object;
mod plane;
mod point_inside;
mod supporting_plane;

pub use beside::Beside;
pub use collinear::Collinear;
pub use on_object::OnObject;
pub use plane::{Plane, PlaneOf, PlanePrior};
pub use point_inside::PointInside;
pub use supporting_plane::SupportingPlane;
