//! Strategies and laws that every manifold and factor is tested by.
//!
//! The laws work on trait objects, so they need nothing but a registered type: tests of plugins use
//! them through [`jacobian_laws!`] and [`manifold_laws!`], the command line on whatever is linked
//! (see [`catalogue`]).
//!
//! A plugin's test is a line. The strategy yields a factor and its variables:
//! ```text
//! jacobian_laws! { agrees_with_differences: (any_factor(), any_se3(), any_se3()) }
//! ```
pub mod catalogue;
mod check;
mod differences;
mod error;
mod invariance;
mod jacobian;
mod manifold;
pub mod strategies;

pub use check::{Case, Each, check, check_jacobians, check_manifolds};
pub use differences::{Derivative, differentiate};
pub use error::LawError;
pub use invariance::invariance_law;
pub use jacobian::{JacobianLaw, jacobian_law};
pub use manifold::manifold_laws;
