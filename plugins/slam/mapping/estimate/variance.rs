//! Variance components: how large the noise is, estimated from the data that it is in. No ground truth takes part, and what a
//! document says of the noise does not either.
//!
//! The noise of *boxes* is that of their residuals: one of standard deviation σ has variance σ²(1 - h) at the estimate, h its leverage
//! (Helmert; Förstner, *Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten*, 1979). The noise of *odometry* is the one
//! that leads to the trajectory which suits objects best that had no part in it.
//!
//! The errors of consecutive boxes are correlated. Boxes have a standard deviation that is larger for it.
mod boxes;
mod components;
mod correlation;
mod cross_validation;
mod motion;

pub use crate::settings::{BoxGroups, VarianceSettings};
pub use boxes::BoxComponent;
pub use components::{Components, VarianceError};
pub use cross_validation::Score;
pub use motion::{MotionChoice, MotionComponent};
