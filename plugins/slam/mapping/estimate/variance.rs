//! Variance components: standard deviations of the noise, estimated from the measurements. The estimate uses
//! neither ground truth nor the standard deviations of the run document.
//!
//! The noise of *boxes* comes from their residuals. With a standard deviation σ, a residual at the
//! estimate has the variance σ²(1 - h) with its leverage h (Helmert; Förstner, *Ein Verfahren zur
//! Schätzung von Varianz- und Kovarianzkomponenten*, 1979). The noise of *odometry* is chosen by
//! cross-validation: its trajectory has to fit the objects that were left out of the solve.
//!
//! Errors of consecutive boxes are correlated. The standard deviation of boxes is larger to account for it.
mod boxes;
mod components;
mod correlation;
mod cross_validation;
mod motion;
mod prefix;

pub use crate::settings::{BoxGroups, VarianceSettings};
pub use boxes::BoxComponent;
pub use components::{VarianceComponents, VarianceError};
pub use cross_validation::CrossValidationScore;
pub use motion::{MotionChoice, MotionComponent};
pub use prefix::StreamNoise;
