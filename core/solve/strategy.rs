//! Solvers, one per file, and their common parts.
mod auto;
mod descent;
mod dogleg;
mod gauss_newton;
mod gnc;
mod levenberg_marquardt;
pub(crate) mod multipliers;
mod optimizer;
mod start;

pub use auto::Auto;
pub use descent::{Descent, TrialResult, TrialStep};
pub use dogleg::Dogleg;
pub use gauss_newton::GaussNewton;
pub use gnc::{Candidates, Gnc, Growth, Probability, Truncation};
pub use levenberg_marquardt::{DiagonalLimits, LevenbergMarquardt, NotLimits};
pub use optimizer::{Optimizer, Stopping};
pub use start::{GivenStart, Start, StartError};
