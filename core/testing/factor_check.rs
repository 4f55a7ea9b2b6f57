//! Check of a factor before it is used in a solver.
mod report;
mod scan;
mod subject;

pub use report::{Broken, FactorReport, FreeDirections, NamedEntry, NamedKink, Unchanged};
pub use subject::Subject;

use crate::error::LawError;
use crate::freedom::freedom;
use crate::invariance::unchanged;
use crate::jacobian::{Examined, JacobianLaw};
use crate::points::{Drawn, any_point};
use manifactor_graph::invariance::{Invariance, invariances};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use report::Gathered;

/// Number of Jacobians for the rank.
const RANK_JACOBIANS: usize = 32;
/// Largest number of attempts to simplify a point with a broken law.
const MAX_SIMPLIFICATIONS: usize = 512;

/// Settings of a factor check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorCheck {
    /// Number of points.
    pub points: usize,
    /// Seed of the random numbers. Equal seeds give equal points.
    pub seed: u64,
    /// Tolerances.
    pub law: JacobianLaw,
}

impl Default for FactorCheck {
    fn default() -> Self {
        Self { points: 256, seed: 0, law: JacobianLaw { kinks: true, ..JacobianLaw::default() } }
    }
}

impl FactorCheck {
    /// Checks a factor at random points: around its example, at points of the registered strategies of its
    /// manifolds, and at and near their singular points.
    ///
    /// The residual has to be finite. The analytic, automatic and numeric Jacobian have to agree, except at
    /// kinks and jumps, which are reported with their size. Stated invariances have to hold. The report also
    /// has the free directions, and jumps along a line through each point. The first point with a broken law
    /// is simplified as far as possible.
    pub fn run(&self, subject: &Subject) -> FactorReport {
        let mut gathered = Gathered::new(subject, self.seed);
        let stated = invariances(subject.factor.erased().as_any().type_id());
        let mut at_start = Drawn { variables: subject.around.clone(), singular: false };
        if let Some(broken) = self.check_point(subject, &stated, &at_start, 0, &mut gathered) {
            return gathered.broken(subject, &broken, &at_start);
        }
        let mut runner = TestRunner::new_with_rng(Config::default(), self.rng(0));
        let points = any_point(&subject.around);
        for round in 1..self.points {
            // nothing is filtered, so no case is rejected
            let Ok(mut tree) = points.new_tree(&mut runner) else { continue };
            let drawn = tree.current();
            if let Some(mut broken) = self.check_point(subject, &stated, &drawn, round, &mut gathered) {
                at_start = drawn;
                let mut failing = true;
                for _ in 0..MAX_SIMPLIFICATIONS {
                    let moved = if failing { tree.simplify() } else { tree.complicate() };
                    if !moved {
                        break;
                    }
                    let simpler = tree.current();
                    let mut aside = Gathered::new(subject, 0);
                    let still = self.check_point(subject, &stated, &simpler, round, &mut aside);
                    failing = still.is_some();
                    if let Some(still) = still {
                        (broken, at_start) = (still, simpler);
                    }
                }
                return gathered.broken(subject, &broken, &at_start);
            }
        }
        gathered.finish(subject)
    }

    /// Checks one point. Returns the broken law, if any.
    fn check_point(
        &self,
        subject: &Subject,
        stated: &[&'static Invariance],
        drawn: &Drawn,
        round: usize,
        gathered: &mut Gathered,
    ) -> Option<LawError> {
        gathered.drawn += 1;
        let point = drawn.refs();
        let factor = &*subject.factor;
        let examined = match self.law.examine(factor, &point) {
            Err(LawError::NotDefined { .. }) => return None,
            Err(broken) => return Some(broken),
            Ok(examined) => examined,
        };
        // each round has a different motion, but all simplified points of a round have an equal one
        let mut rng = self.rng(1 + round as u64);
        for (i, invariance) in stated.iter().enumerate() {
            let mut random = |size: f64| rng.random_range(-1.0..1.0) * size;
            let moved = (invariance.moved)(factor.erased().as_any(), &point, &mut random);
            let Some(moved) = moved else { continue };
            let moved: Vec<_> = moved.iter().map(|x| &**x).collect();
            match unchanged(invariance.motion, factor, &point, &moved) {
                Err(LawError::NotDefined { .. }) => {}
                Err(broken) => return Some(broken),
                Ok(()) => gathered.unchanged[i].points += 1,
            }
        }
        gathered.defined += 1;
        gathered.singular += usize::from(drawn.singular);
        self.gather(subject, drawn, examined, gathered);
        if let Some((variable, column)) = subject.column(round) {
            for (kink, at) in scan::jumps(factor, &point, variable, column) {
                let at = Drawn { variables: at, singular: false };
                gathered.kinks(subject, &[kink], &at);
            }
        }
        None
    }

    fn gather(&self, subject: &Subject, drawn: &Drawn, examined: Examined, gathered: &mut Gathered) {
        gathered.entry(subject, examined.worst, drawn);
        let smooth = examined.kinks.is_empty() && !drawn.singular;
        gathered.kinks(subject, &examined.kinks, drawn);
        if smooth && gathered.linearizations.len() < RANK_JACOBIANS {
            gathered.linearizations.push(examined.linearization);
            gathered.freedom = freedom(&gathered.linearizations);
        }
    }

    fn rng(&self, stream: u64) -> TestRng {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&self.seed.to_le_bytes());
        seed[8..16].copy_from_slice(&stream.to_le_bytes());
        TestRng::from_seed(RngAlgorithm::ChaCha, &seed)
    }
}
