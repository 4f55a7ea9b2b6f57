//! Figures that explain an idea, compare several results, or move.
//!
//! The pictures of a run show one estimate. These figures are the building blocks of a book or of a talk: the
//! example `figures` of this crate makes those of the project's book with them.
mod association;
mod diagrams;
mod movie;
mod plots;
mod stage;

pub use association::association;
pub use diagrams::{ellipsoid_and_box, factor_graph};
pub use movie::Movie;
pub use plots::{Plot, beside, costs, pose_graph};
pub use stage::objects;
