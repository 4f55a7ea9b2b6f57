//! Pages and pictures.
mod browser;
mod live;
mod reports;
