//! An incremental smoother: a factor graph that grows while it is solved.
//!
//! A [`Smoother`] accepts new variables and factors, removes factors, and keeps the estimate up to date. Each
//! [`update`](Smoother::update) recomputes only the part of the factorization that has changed, and
//! relinearizes only variables that have moved. [`finish`](Smoother::finish) solves the whole graph as one
//! batch.
//!
//! ```
//! # use manifactor_smoother::{Smoother, SmootherSettings};
//! # use manifactor_graph::{Graph, Values};
//! # fn example(frames: Vec<(Graph, Values)>) -> Result<(), Box<dyn std::error::Error>> {
//! let mut smoother = Smoother::new(SmootherSettings::default());
//! for (factors, values) in frames {
//!     smoother.push(&factors, &values)?;
//!     let report = smoother.update()?;
//!     println!("{} variables refactorized", report.refactorized);
//! }
//! let pose = smoother.estimate("x7");
//! # Ok(())
//! # }
//! ```
mod elimination_tree;
mod error;
mod factor_id;
mod fronts;
mod model;
mod removed;
mod report;
mod saved;
mod settings;
mod smoother;

pub use error::{ChangeError, UpdateError};
pub use factor_id::FactorId;
pub use report::{FactorRejection, SharedList, UpdateReport};
pub use saved::{LoadError, SaveError};
pub use settings::{NotOneSpan, Outliers, SmootherSettings, Span, Window};
pub use smoother::{Finished, Smoother, SmootherCovarianceError};
