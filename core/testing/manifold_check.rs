//! Check of a manifold before it is used in factors.
use crate::error::LawError;
use crate::example::example;
use crate::manifold::{manifold_laws, seed_law};
use crate::points::points_of;
use manifactor_graph::Variable;
use manifactor_graph::catalogue::Entry;
use proptest::prelude::*;
use proptest::strategy::{Union, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// Distances of drawn points from the example, in each direction.
const NEAR_DISTANCE: f64 = 1.0;
const FAR_DISTANCE: f64 = 10.0;
const TINY_DISTANCE: f64 = 1e-6;

/// Settings of a manifold check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManifoldCheck {
    /// Number of pairs of points.
    pub points: usize,
    /// Seed of the random numbers. Equal seeds give equal points.
    pub seed: u64,
}

impl Default for ManifoldCheck {
    fn default() -> Self {
        Self { points: 256, seed: 0 }
    }
}

/// Report of a manifold check.
#[derive(Debug, Clone, Serialize)]
pub struct ManifoldReport {
    /// Registered name of the manifold.
    pub manifold: &'static str,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of examined pairs of points.
    pub drawn: usize,
    /// Names of its tangent directions.
    pub tangent: &'static [&'static str],
    /// Largest difference between the derivatives of `seed` and of `retract`, relative to the largest
    /// derivative or to 1. `None` if it cannot be checked, see [`seed_law`].
    pub seed_error: Option<f64>,
    /// The law that does not hold, with its point.
    pub broken: Option<String>,
}

impl ManifoldReport {
    /// Returns whether every law holds.
    pub fn holds(&self) -> bool {
        self.broken.is_none()
    }
}

impl ManifoldCheck {
    /// Checks [`manifold_laws`] of a registered manifold at random points: near and far from the example in
    /// its docs, at points of its registered strategy, and at its singular points.
    ///
    /// # Errors
    /// If the catalogue entry is incomplete.
    pub fn run(&self, entry: &'static Entry) -> Result<ManifoldReport, LawError> {
        let origin = example::<dyn Variable>(entry)?;
        let (tangent, dim) = (origin.erased().tangent(), origin.erased().dim());
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&self.seed.to_le_bytes());
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
        let mut runner = TestRunner::new_with_rng(Config::default(), rng);
        let cases = (any_of(&*origin), any_of(&*origin), steps(dim, NEAR_DISTANCE));
        let mut report = ManifoldReport {
            manifold: entry.name,
            seed: self.seed,
            drawn: 0,
            tangent,
            seed_error: seed_law(&*origin).unwrap_or_default(),
            broken: None,
        };
        for _ in 0..self.points {
            let Ok(tree) = cases.new_tree(&mut runner) else { continue };
            let (x, y, delta) = tree.current();
            report.drawn += 1;
            let held = manifold_laws(&*x, &*y, &delta).and_then(|()| seed_law(&*x));
            match held {
                Ok(error) => report.seed_error = report.seed_error.into_iter().chain(error).reduce(f64::max),
                Err(broken) => {
                    report.broken = Some(broken.to_string());
                    break;
                }
            }
        }
        Ok(report)
    }
}

/// Returns a strategy for points of the manifold of `origin`.
fn any_of(origin: &dyn Variable) -> BoxedStrategy<Box<dyn Variable>> {
    let around = |reach: f64| {
        let (origin, dim) = (origin.erased().clone_box(), origin.erased().dim());
        let moved = move |delta: Vec<f64>| origin.erased().retract(&delta).unwrap_or_else(|| origin.clone());
        steps(dim, reach).prop_map(moved).boxed()
    };
    let mut sources = vec![(8, around(NEAR_DISTANCE)), (2, around(FAR_DISTANCE)), (1, around(TINY_DISTANCE))];
    if let Some(points) = points_of(origin.erased().type_id()) {
        sources.push((8, (points.anywhere)()));
        sources.extend((points.singular)().into_iter().map(|point| (1, Just(point).boxed())));
    }
    Union::new_weighted(sources).boxed()
}

/// Returns a strategy for tangent vectors with entries of this size.
fn steps(dim: usize, reach: f64) -> impl Strategy<Value = Vec<f64>> + Clone {
    proptest::collection::vec(-reach..reach, dim)
}

impl Display for ManifoldReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { manifold, seed, drawn, tangent, .. } = self;
        if let Some(broken) = &self.broken {
            return writeln!(f, "{manifold} is broken (seed {seed}): {broken}");
        }
        writeln!(f, "{manifold}: the laws hold at {drawn} pairs of points (seed {seed})")?;
        writeln!(f, "Tangent: {} ({})", tangent.len(), tangent.join(", "))?;
        match self.seed_error {
            Some(error) => writeln!(f, "Seed: right; its derivatives are off by at most {error:.0e}"),
            None => writeln!(
                f,
                "Seed: not checked, as nothing says what its numbers are. `register_quantity!(…);` does, \
                 and lets formulas compute with it"
            ),
        }
    }
}
