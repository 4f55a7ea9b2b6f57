//! Measurements of poses and points; one file per factor.
mod bearing_range;
mod bearing_range_3d;
mod between;
mod chordal_between;
mod constant_velocity;
mod heading;
mod landmark;
mod located;
mod on_body;
mod position;
mod prior;
mod range;
mod scaled_between;

pub use bearing_range::BearingRange2;
pub use bearing_range_3d::BearingRange3;
pub use between::Between;
pub use chordal_between::ChordalBetween;
pub use constant_velocity::ConstantVelocity;
pub use heading::Heading;
pub use landmark::Landmark;
pub use located::Located;
pub use on_body::{OnBody, OnBodyError};
pub use position::Position;
pub use prior::Prior;
pub use range::Range;
pub use scaled_between::ScaledBetween;
