//! Analysis of an estimate: covariances, conditioning, undetermined directions and the factors with the
//! largest costs.
mod condition;
mod covariance;
mod diagnosis;
mod factorized;
mod leverage;
mod moving;
pub(crate) mod null_space;
mod start_diagnosis;
mod unconstrained;

pub use covariance::{CovarianceError, Marginal};
pub use diagnosis::{Diagnosis, FactorCost};
pub use factorized::Factorized;
pub use start_diagnosis::{StartDiagnosis, WeakDirection};
