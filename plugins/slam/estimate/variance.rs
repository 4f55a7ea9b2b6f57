//! Variance components: how large the noise is, estimated from the data that it is in.
//!
//! Solve, look at the residuals, scale the noise, solve again (Helmert; Förstner, *Ein Verfahren zur Schätzung von Varianz-
//! und Kovarianzkomponenten*, 1979). A residual r of standard deviation σ has variance σ²(1 - h) at the estimate, h its
//! leverage: what is left of an odometry that next to nothing controls says little, however small it is.
//! No ground truth takes part.
mod components;
mod correlation;

pub use crate::settings::{BoxGroups, VarianceSettings};
pub use components::{Components, VarianceError};
