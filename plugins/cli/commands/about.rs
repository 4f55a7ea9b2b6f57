//! Commands about the program itself, which read no data.
mod completions;
mod explain;
mod list;
mod schema;

pub(crate) use completions::{Completions, Man};
pub(crate) use explain::Explain;
pub(crate) use list::List;
pub(crate) use schema::Schema;
