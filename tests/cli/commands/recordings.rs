//! Commands on recordings and trajectories.
mod doctor;
mod evaluate;
mod vio;
