//! Objects as constrained dual quadrics, and the factors that see and orient them.
mod bounding_box;
mod bounding_box_factor;
mod box3;
mod dual_conic;
mod dual_quadric;
mod ellipse;
mod ellipsoid;
mod from_matrix;
mod functions;
mod horizontal_orientation;
pub mod initialise;
mod landmark;
mod outline;
mod quadric_prior;
mod semi_axes;
mod size_prior;
mod tangent_line;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod vertical_orientation;

pub use bounding_box::{BoundingBox, NotABox, SIDES};
pub use bounding_box_factor::{BoundingBoxFactor, BoxModel};
pub use box3::{Box3, NotABox3};
pub use dual_conic::DualConic;
pub use dual_quadric::DualQuadric;
pub use ellipse::Ellipse;
pub use ellipsoid::Ellipsoid;
pub use from_matrix::{NotAnEllipsoid, OnHyperboloid};
pub use horizontal_orientation::{HorizontalOrientation, HorizontalOrientationSmooth};
pub use landmark::LandmarkError;
pub use manifactor_geometry::{Camera, NotACamera};
pub use quadric_prior::QuadricPrior;
pub use semi_axes::{LONGEST, NotSemiAxes, SHORTEST, SemiAxes};
pub use size_prior::{AxisOrder, ShapePrior, SizePrior};
pub use vertical_orientation::{VerticalOrientation, VerticalOrientationSmooth};
