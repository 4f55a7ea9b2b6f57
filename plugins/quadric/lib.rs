//! Objects as constrained dual quadrics, and factors that measure and orient them.
mod factors;
mod functions;
pub mod initialise;
mod shapes;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use factors::{BoundingBoxFactor, BoxModel, CentroidDepth, QuadricPrior, ShapePrior, SizePrior};
pub use factors::{
    HorizontalOrientation, HorizontalOrientationSmooth, VerticalOrientation, VerticalOrientationSmooth,
};
pub use manifactor_geometry::{Camera, NotACamera};
pub use shapes::{
    AxisOrder, BoundingBox, Box3, DualConic, DualQuadric, Ellipse, Ellipsoid, LONGEST, LandmarkError,
    NotABox, NotABox3, NotAnEllipsoid, NotSemiAxes, OnHyperboloid, SHORTEST, SIDES, SemiAxes,
};
