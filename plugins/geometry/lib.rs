//! Rotations, poses and points, and the factors between them.
//!
//! Conventions: x ⊞ δ = x·Exp(δ) with the full exponential, y ⊟ x = Log(x⁻¹y). In space the tangent
//! is rotation first, (ω, v); in the plane it is (x, y, θ). A pose takes points from its own frame to
//! the outer one.
mod bal_camera;
mod bearing_range;
mod bearing_range_3d;
mod between;
mod camera;
mod certificate;
mod chordal_between;
mod coordinates;
mod functions;
mod initialise;
mod landmark;
mod lie_group;
mod located;
mod position;
mod prior;
mod projection;
mod projection_bal;
mod range;
mod rn;
mod se2;
mod se3;
mod small_angle;
mod so2;
mod so3;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use bal_camera::BalCamera;
pub use bearing_range::BearingRange2;
pub use bearing_range_3d::BearingRange3;
pub use between::Between;
pub use camera::{Camera, NotACamera};
pub use certificate::{Certificate, CertificateError, certify};
pub use chordal_between::ChordalBetween;
pub use coordinates::{Coordinates, NoCoordinates};
pub use initialise::{Chordal, SpanningTree, Tree, spanning_tree};
pub use landmark::Landmark;
pub use lie_group::LieGroup;
pub use located::Located;
pub use position::Position;
pub use prior::Prior;
pub use projection::Projection;
pub use projection_bal::ProjectionBal;
pub use range::Range;
pub use rn::{Point1, Point2, Point3, Rn};
pub use se2::Se2;
pub use se3::Se3;
pub use so2::{NotAnAngle, So2, atan2, wrap};
pub use so3::{NotARotation, So3};
