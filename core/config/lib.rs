//! Documents in TOML, JSON and YAML, and errors that point at the line.
mod diagnostic;
mod format;
mod json;
mod node;
mod problem;
mod source;
mod suggest;
mod toml;
mod yaml;

pub use diagnostic::{Diagnostic, Diagnostics, Errors};
pub use format::{Format, MAX_BYTES};
pub use node::{Field, Found, MAX_DEPTH, Node, Table, Value};
pub use problem::{Problem, quoted_list};
pub use source::{Place, Source};
pub use suggest::nearest;
