//! Commands on recordings and trajectories.
mod evaluate;
mod vio;
