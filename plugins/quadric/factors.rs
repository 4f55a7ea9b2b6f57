//! What is known of an ellipsoid: its box in an image, its orientation, its size.
mod bounding_box;
mod horizontal_orientation;
mod quadric_prior;
mod size_prior;
mod vertical_orientation;

pub use bounding_box::{BoundingBoxFactor, BoxModel};
pub use horizontal_orientation::{HorizontalOrientation, HorizontalOrientationSmooth};
pub use quadric_prior::QuadricPrior;
pub use size_prior::{AxisOrder, ShapePrior, SizePrior};
pub use vertical_orientation::{VerticalOrientation, VerticalOrientationSmooth};
