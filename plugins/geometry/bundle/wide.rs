//! Cameras with wide lenses.
mod double_sphere;
mod extended_unified;
mod kannala_brandt;

pub use double_sphere::DoubleSphere;
pub use extended_unified::ExtendedUnified;
pub use kannala_brandt::KannalaBrandt;
