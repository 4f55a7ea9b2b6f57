//! Pages and pictures.
mod browser;
mod reports;
