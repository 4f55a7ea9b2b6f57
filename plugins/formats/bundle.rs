//! Problems of bundle adjustment: files of BAL, and models of COLMAP.
pub mod bal;
pub mod colmap;
mod gauge;
