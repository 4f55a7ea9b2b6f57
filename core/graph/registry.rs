//! What can be chosen by name, and how it is read out of a document.
pub mod catalogue;
pub mod checked;
mod registered;
