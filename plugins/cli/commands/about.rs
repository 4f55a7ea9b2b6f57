//! What the program knows and how it is called: commands that read no data.
mod completions;
mod explain;
mod list;
mod schema;

pub(crate) use completions::{Completions, Man};
pub(crate) use explain::Explain;
pub(crate) use list::List;
pub(crate) use schema::Schema;
