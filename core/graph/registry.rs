//! The registry of types that documents choose by name, and their parsing.
pub mod catalogue;
pub mod checked;
mod registered;
mod type_name;

pub use type_name::{TypeName, UnknownType};
