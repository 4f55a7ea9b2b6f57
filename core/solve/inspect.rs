//! Analysis of an estimate: covariances, conditioning, undetermined directions and the factors with the
//! largest costs.
mod at_start;
mod condition;
mod covariance;
mod diagnosis;
mod factorized;
mod leverage;
mod moving;
pub(crate) mod null_space;
mod untouched;

pub use at_start::{AtStart, Weak};
pub use covariance::{CovarianceError, Marginal};
pub use diagnosis::{Diagnosis, FactorCost};
pub use factorized::Factorized;
