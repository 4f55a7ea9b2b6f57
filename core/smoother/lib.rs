//! An incremental smoother: a factor graph that grows while it is solved.
//!
//! A [`Session`] accepts new variables and factors, removes factors, and keeps the estimate up to date. Each
//! [`update`](Session::update) recomputes only the part of the factorization that has changed, and
//! relinearizes only variables that have moved. [`finish`](Session::finish) solves the whole graph as one
//! batch.
//!
//! ```
//! # use manifactor_smoother::{Session, Settings};
//! # use manifactor_graph::{Graph, Values};
//! # fn example(frames: Vec<(Graph, Values)>) -> Result<(), Box<dyn std::error::Error>> {
//! let mut session = Session::new(Settings::default());
//! for (factors, values) in frames {
//!     session.push(&factors, &values)?;
//!     let report = session.update()?;
//!     println!("{} variables redone", report.redone);
//! }
//! let pose = session.estimate("x7");
//! # Ok(())
//! # }
//! ```
mod elimination_tree;
mod error;
mod factor_id;
mod fronts;
mod gone;
mod model;
mod report;
mod saved;
mod session;
mod settings;

pub use error::{ChangeError, UpdateError};
pub use factor_id::FactorId;
pub use report::{Rejection, Report, Shared};
pub use saved::{LoadError, SaveError};
pub use session::{CovarianceError, Finished, Session};
pub use settings::{NotOneSpan, Outliers, Settings, Span, Window};
