//! Manifactor: nonlinear least squares on factor graphs, and object-level SLAM on top of it.
//!
//! # Imports
//! - [`prelude`]: the names that most programs and all plugins need, as used on this page.
//! - [`geometry`], [`quadric`], [`semantic`], [`inertial`]: variables and factors. [`expression`] creates factors from
//!   formulas.
//! - [`config`]: graphs as documents. [`solve`] and [`graph`]: the complete core, for solvers and tools.
//! - `formats`, `slam` and `viz`, enabled by the cargo feature of that name or `full`: files, runs and pictures.
//!
//! A document can use the types of every linked plugin by name, without further setup.
//!
//! # Solving a graph
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
//! let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
//! assert!(solution.outcome.termination.is_converged());
//! let uncertainty = &solution.marginals(&graph, &["x1"])?[0];
//! assert!(uncertainty.covariance[(0, 0)] > 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Defining a factor
//! The residual is written once, generic over a scalar that is a number or a dual number. The Jacobian is
//! derived from it.
//! ```
//! use manifactor::prelude::*;
//! use manifactor::geometry::Point2;
//!
//! /// A point is on a circle about the origin: r = ‖p‖ - radius.
//! #[derive(Debug, Clone)]
//! struct OnCircle {
//!     radius: f64,
//! }
//!
//! impl Residual for OnCircle {
//!     type Variables = (Point2,);
//!     type Dim = U1;
//!     fn residual<T: Scalar>(&self, (point,): Lifted<Self::Variables, T>) -> Vector1<T> {
//!         Vector1::new(point.norm() - self.radius)
//!     }
//! }
//!
//! let (mut graph, mut values) = (Graph::new(), Values::new());
//! graph.add(["p"], Unnamed(OnCircle { radius: 2.0 }));
//! values.insert("p", Point2::new([1.0, 1.0]));
//! let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
//! assert!((solution.values.get::<Point2>("p")?.0.norm() - 2.0).abs() < 1e-9);
//! # assert!(manifactor::config::Format::Toml.write(&graph).is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//! With serde's derives and one line, [`register_factor!`], it needs no [`Unnamed`](prelude::Unnamed), and a
//! document can use it by name. `docs/authors-guide.md` continues with its documentation and its laws.
//!
//! # Changing measurements in a loop
//! A graph is compiled once. Measurements, noise and weights of the compiled [`Problem`](solve::Problem) can
//! be changed.
//! ```
//! use manifactor::prelude::*;
//! use manifactor::geometry::{Point1, Prior};
//!
//! let (mut graph, mut values) = (Graph::new(), Values::new());
//! values.insert("x", Point1::new([0.0]));
//! graph.add(["x"], Prior { value: Point1::new([0.0]) });
//! let mut problem = Problem::compile(&graph, &values)?;
//! for seen in [1.0, 2.0, 3.0] {
//!     problem.factor_mut::<Prior<Point1>>(0)?.value = Point1::new([seen]);
//!     GaussNewton::default().descend(&mut problem, &mut Silent);
//!     assert!((problem.values().get::<Point1>("x")?.0[0] - seen).abs() < 1e-12);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Incremental smoothing
//! A [`Smoother`](smoother::Smoother) updates the estimate while variables and factors are added and removed.
//! ```
//! use manifactor::geometry::{Between, LieGroup, Se2};
//! use manifactor::smoother::{Smoother, SmootherSettings};
//! use manifactor::prelude::*;
//!
//! let mut smoother = Smoother::new(SmootherSettings::default());
//! // the first pose is held
//! let (mut factors, mut values) = (Graph::new(), Values::new());
//! values.insert("x0", Se2::identity());
//! factors.fix("x0");
//! smoother.push(&factors, &values)?;
//! smoother.update()?;
//! // a frame: a new pose, where odometry leads, and a factor to it
//! let (mut factors, mut values) = (Graph::new(), Values::new());
//! let relative = Se2::exp(&Vector3::new(1.0, 0.0, 0.1));
//! values.insert("x1", Se2::compose(&smoother.get("x0")?, &relative));
//! factors.add(["x0", "x1"], Between { relative }).noise(Noise::sigma(0.1)?);
//! let ids = smoother.push(&factors, &values)?;
//! let report = smoother.update()?;
//! let pose: Se2 = smoother.get("x1")?;
//! assert_eq!((ids.len(), report.undetermined_variables.len()), (1, 0));
//! assert!((pose.translation.x - 1.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Groups of three traits
//! Each kind of type that can be selected by name has three traits. Authors implement the first, a macro
//! implements the second, and the core implements the third.
//!
//! | implemented by authors | selected by name, in graphs and values | used internally, without the type |
//! | --- | --- | --- |
//! | [`Residual`](graph::Residual) | [`Factor`](graph::Factor), by [`register_factor!`] | [`ErasedResidual`](graph::ErasedResidual) |
//! | [`Manifold`](graph::Manifold) | [`Variable`](graph::Variable), by [`register_manifold!`] | [`ErasedManifold`](graph::ErasedManifold) |
//! | [`RobustLoss`](graph::loss::RobustLoss) | [`Loss`](graph::loss::Loss), by [`register_loss!`] | [`ErasedLoss`](graph::loss::ErasedLoss) |
//!
//! # Further reading
//! The book, `docs/SUMMARY.md`: concepts, the author's guide, graphs from documents, and a comparison with
//! other libraries.
pub use manifactor_config as config;
pub use manifactor_graph as graph;
pub use manifactor_smoother as smoother;
pub use manifactor_solve as solve;
pub use nalgebra;

#[cfg(feature = "expression")]
pub use manifactor_expression as expression;
#[cfg(feature = "formats")]
pub use manifactor_formats as formats;
#[cfg(feature = "geometry")]
pub use manifactor_geometry as geometry;
#[cfg(feature = "inertial")]
pub use manifactor_inertial as inertial;
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

/// For traits registered with [`register!`]: `use manifactor::typetag;`, then `#[typetag::serialize(name = "…")]` on the `impl`.
pub use manifactor_graph::__private::typetag;

/// Names that most programs and plugins need.
pub mod prelude {
    pub use manifactor_graph::prelude::*;
    pub use manifactor_solve::{
        Auto, Descent, Dogleg, GaussNewton, Gnc, Interrupt, LevenbergMarquardt, Observer, Optimizer, Outcome,
        Problem, Silent, Solution, Start, StartError, Stopping, Termination, TrialResult, TrialStep, solve,
    };
}

// The linker drops a crate that no code names, and its registrations are lost.
#[cfg(feature = "expression")]
use manifactor_expression as _;
#[cfg(feature = "formats")]
use manifactor_formats as _;
#[cfg(feature = "geometry")]
use manifactor_geometry as _;
#[cfg(feature = "inertial")]
use manifactor_inertial as _;
#[cfg(feature = "quadric")]
use manifactor_quadric as _;
#[cfg(feature = "semantic")]
use manifactor_semantic as _;
#[cfg(feature = "slam")]
use manifactor_slam as _;
#[cfg(feature = "viz")]
use manifactor_viz as _;

/// Runs the Rust code blocks of the book as tests.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../README.md")]
    mod readme {}
    #[doc = include_str!("../docs/concepts.md")]
    mod concepts {}
    #[doc = include_str!("../docs/first-factor.md")]
    mod first_factor {}
    #[doc = include_str!("../docs/authors-guide.md")]
    mod authors_guide {}
    #[doc = include_str!("../docs/coming-from.md")]
    mod coming_from {}
    #[doc = include_str!("../docs/least-squares.md")]
    mod least_squares {}
}
