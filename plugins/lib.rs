//! Manifactor: nonlinear least squares on factor graphs, and object-level SLAM on top of it.
//!
//! This crate is the front door: [`graph`], [`solve`] and [`config`] are the core; each plugin is a module and a cargo
//! feature, all of them on by default. Linking a plugin is all that it takes to use its types by name.
//!
//! ```
//! use manifactor::prelude::*;
//! use manifactor::geometry::{Between, Prior, Se2};
//!
//! let mut graph = Graph::new();
//! graph.add(["x0"], Prior { value: Se2::identity() });
//! let relative = Se2::exp(&Vector3::new(1.0, 0.0, 0.1));
//! graph.add(["x0", "x1"], Between { relative }).noise(Noise::sigma(0.1)?);
//!
//! let mut values = Values::new();
//! values.insert("x0", Se2::identity());
//! values.insert("x1", Se2::identity());
//!
//! let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent)?;
//! assert!(solution.outcome.termination.is_converged());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Where to read on: the author's guide (`docs/authors-guide.md`) writes a factor from an empty file to a config that
//! uses it; [`graph::Residual`] is the trait that it implements.
pub use manifactor_config as config;
pub use manifactor_graph as graph;
pub use manifactor_solve as solve;
pub use nalgebra;

#[cfg(feature = "expression")]
pub use manifactor_expression as expression;
#[cfg(feature = "formats")]
pub use manifactor_formats as formats;
#[cfg(feature = "geometry")]
pub use manifactor_geometry as geometry;
#[cfg(feature = "quadric")]
pub use manifactor_quadric as quadric;
#[cfg(feature = "semantic")]
pub use manifactor_semantic as semantic;
#[cfg(feature = "slam")]
pub use manifactor_slam as slam;
#[cfg(feature = "testing")]
pub use manifactor_testing as testing;
#[cfg(feature = "viz")]
pub use manifactor_viz as viz;

pub use manifactor_graph::{
    register, register_factor, register_functions, register_invariance, register_loss, register_manifold,
    register_quantity,
};

/// For traits that [`register!`] enters: `use manifactor::typetag;`, then `#[typetag::serialize(name = "…")]` on the `impl`.
pub use manifactor_graph::__private::typetag;

/// The names that most programs and most plugins need.
pub mod prelude {
    pub use manifactor_graph::__private::typetag;
    pub use manifactor_graph::checked::Positive;
    pub use manifactor_graph::loss::{Loss, RobustLoss};
    pub use manifactor_graph::quantity::Quantity;
    pub use manifactor_graph::{
        Dimension, Direction, Factor, Graph, Jacobians, Jet, JetOf, Key, Lift, Lifted, Manifold, Many, Noise,
        Refs, Residual, Scalar, Tangent, Values, Variable, Variables, Vector,
    };
    pub use manifactor_graph::{
        register, register_factor, register_functions, register_invariance, register_loss, register_manifold,
        register_quantity,
    };
    pub use manifactor_solve::{
        Auto, Descent, Dogleg, GaussNewton, Gnc, Interrupt, LevenbergMarquardt, Observer, Optimizer, Outcome,
        Problem, Silent, Solution, Start, StartError, Step, Stopping, Termination, Tried, solve,
    };
    pub use nalgebra::{
        Matrix2, Matrix3, Matrix4, U1, U2, U3, U4, U5, U6, U7, U8, U9, Vector1, Vector2, Vector3, Vector4,
        Vector5, Vector6,
    };
}

// a crate that nothing names is not linked, and its registrations are gone
#[cfg(feature = "expression")]
use manifactor_expression as _;
#[cfg(feature = "formats")]
use manifactor_formats as _;
#[cfg(feature = "geometry")]
use manifactor_geometry as _;
#[cfg(feature = "quadric")]
use manifactor_quadric as _;
#[cfg(feature = "semantic")]
use manifactor_semantic as _;
#[cfg(feature = "slam")]
use manifactor_slam as _;
#[cfg(feature = "viz")]
use manifactor_viz as _;

/// The blocks of Rust in the book are tests.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../docs/concepts.md")]
    mod concepts {}
    #[doc = include_str!("../docs/first-factor.md")]
    mod first_factor {}
    #[doc = include_str!("../docs/authors-guide.md")]
    mod authors_guide {}
    #[doc = include_str!("../docs/coming-from.md")]
    mod coming_from {}
}
