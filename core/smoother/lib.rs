//! An incremental smoother: a factor graph that grows while it is solved.
//!
//! A [`Session`] takes new variables and factors as they come, takes factors away, and keeps the estimate up to date: each
//! [`update`](Session::update) redoes the part of the factorization that has changed, and linearizes anew what has moved.
//! [`finish`](Session::finish) solves all of it as one batch.
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
pub use settings::{ManifoldType, NotOneSpan, Outliers, Settings, Span, UnknownManifold, Window};
