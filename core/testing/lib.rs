//! Strategies and laws for tests of manifolds and factors.
//!
//! The laws work on trait objects and only need a registered type. Tests of plugins use them through
//! [`jacobian_laws!`] and [`manifold_laws!`]; the command line applies them to all linked types (see
//! [`catalogue`]).
//!
//! A test of a plugin is one line. It names a factor or a manifold, and uses the example of the catalogue and
//! the registered points. Alternatively, it has a custom strategy that yields a factor and its variables, or
//! two points and a tangent vector:
//! ```text
//! factor_laws! { rests_on }
//! manifold_laws! { heading }
//! jacobian_laws! { agrees_with_differences: (any_factor(), any_se3(), any_se3()) }
//! ```
#[allow(clippy::panic, reason = "laws are assertions: a test fails by them")]
pub mod catalogue;
#[allow(clippy::panic, reason = "laws are assertions: a test fails by them")]
mod check;
mod differences;
mod error;
mod example;
mod factor_check;
mod freedom;
mod invariance;
mod jacobian;
mod manifold;
mod manifold_check;
pub mod points;
pub mod strategies;

pub use check::{Case, Each, check, check_jacobians, check_manifolds};
pub use differences::{Derivative, differentiate, differentiate_from, jumps};
pub use error::LawError;
pub use factor_check::{
    Broken, FactorCheck, FactorReport, FreeDirections, NamedEntry, NamedKink, Subject, Unchanged,
};
pub use freedom::{Free, Freedom, freedom};
pub use invariance::invariance_law;
pub use jacobian::Kink;
pub use jacobian::{Examined, JacobianEntry, JacobianLaw, jacobian_law};
pub use manifold::{manifold_laws, seed_law};
pub use manifold_check::{ManifoldCheck, ManifoldReport};

#[doc(hidden)]
pub mod __private {
    pub use manifactor_graph::__private::inventory;
    pub use manifactor_graph::Variable;
    pub use proptest::strategy::{BoxedStrategy, Strategy};
}
