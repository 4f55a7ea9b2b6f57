//! Reports to be opened in a browser.
mod experiment_page;
mod page;
mod run_page;

pub use experiment_page::{experiment_page, experiment_pictures};
pub use page::Page;
pub use run_page::{RunPage, run_pictures};
