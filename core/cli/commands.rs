//! The commands, a file each: what it takes, and what it does.
mod explain;
mod list;
mod schema;
mod solve;

pub(crate) use explain::Explain;
pub(crate) use list::List;
pub(crate) use schema::Schema;
pub(crate) use solve::Solve;
