//! Everything that can be said of a factor before a solver meets it.
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

/// How many Jacobians the rank is taken from.
const FOR_RANK: usize = 32;
/// How often a point where a law is broken is made simpler.
const SIMPLER: usize = 512;

/// How a factor is checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorCheck {
    /// How many points are drawn.
    pub points: usize,
    /// Where the random numbers begin: the same seed draws the same points.
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
    /// Checks a factor at random points: around the ones that it came with, anywhere that its manifolds' registered
    /// strategies draw, at their singular points and near them.
    ///
    /// Its residual has to be finite, analytic, automatic and numeric Jacobian to agree, up to kinks and jumps, which
    /// are reported with their size; and what its author says leaves it unchanged has to. What directions it leaves
    /// free is reported, and jumps along a line through each point. The first point where something is broken is made as simple as it gets.
    pub fn run(&self, subject: &Subject) -> FactorReport {
        let mut gathered = Gathered::new(subject, self.seed);
        let stated = invariances(subject.factor.erased().as_any().type_id());
        let mut at_start = Drawn { variables: subject.around.clone(), singular: false };
        if let Some(broken) = self.look(subject, &stated, &at_start, 0, &mut gathered) {
            return gathered.broken(subject, &broken, &at_start);
        }
        let mut runner = TestRunner::new_with_rng(Config::default(), self.rng(0));
        let points = any_point(&subject.around);
        for round in 1..self.points {
            // nothing is filtered, so nothing is refused
            let Ok(mut tree) = points.new_tree(&mut runner) else { continue };
            let drawn = tree.current();
            if let Some(mut broken) = self.look(subject, &stated, &drawn, round, &mut gathered) {
                at_start = drawn;
                let mut failing = true;
                for _ in 0..SIMPLER {
                    let moved = if failing { tree.simplify() } else { tree.complicate() };
                    if !moved {
                        break;
                    }
                    let simpler = tree.current();
                    let mut aside = Gathered::new(subject, 0);
                    let still = self.look(subject, &stated, &simpler, round, &mut aside);
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

    /// Looks at one point; what is broken there, if anything is.
    fn look(
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
        // a motion of its own for each round, and the same for all simpler points of it
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
        if smooth && gathered.linearizations.len() < FOR_RANK {
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
