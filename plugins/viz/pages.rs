//! Reports to be opened in a browser.
mod experiment_page;
mod page;
mod run_page;
mod run_tables;
mod viewer;

pub use experiment_page::{experiment_page, experiment_pictures};
pub use run_page::run_page;
