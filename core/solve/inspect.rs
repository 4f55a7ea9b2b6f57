//! Questions about an estimate: how certain it is, what holds it, and what fits badly.
mod condition;
mod covariance;
mod diagnosis;
mod leverage;
pub(crate) mod null_space;

pub use covariance::{CovarianceError, Marginal};
pub use diagnosis::{Diagnosis, FactorCost};
