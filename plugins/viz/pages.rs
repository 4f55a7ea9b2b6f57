//! Reports for a browser.
mod experiment_page;
mod graph_page;
mod live;
mod live_page;
mod page;
mod run_page;
mod run_tables;
mod verdict;
mod viewer;

pub use experiment_page::{experiment_page, experiment_pictures};
pub use graph_page::{SolveSummary, graph_page};
pub use live::{LiveMap, Phase};
pub use live_page::live_page;
pub use run_page::run_page;
