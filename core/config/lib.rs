//! Documents in TOML, JSON and YAML, and errors that point at the line.
mod diagnostic;
mod document;
mod format;
mod json;
mod merge;
mod message;
mod node;
mod overrides;
mod parse;
mod problem;
mod section;
mod source;
mod suggest;
mod toml;
mod write;
mod yaml;

pub use diagnostic::{Diagnostic, Diagnostics, Errors};
pub use document::Document;
pub use format::{Format, MAX_BYTES};
pub use merge::merge;
pub use node::{Field, Found, MAX_DEPTH, Node, Table, Value};
pub use problem::{Problem, quoted_list};
pub use section::Section;
pub use source::{Place, Source};
pub use suggest::nearest;
pub use write::{WriteError, to_json, to_toml, to_yaml};
