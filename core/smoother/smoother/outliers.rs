//! Outlier test of factors that may be wrong, mostly loop closures. They are tested before they count.
//!
//! A candidate is rejected at first. After the remaining factors of the update, its additional cost is
//! computed: min ‖r(x ⊕ δ)‖² + δᵀΣ⁻¹δ over its variables, with their joint covariance Σ. This is the squared
//! Mahalanobis distance of its innovation, and has the χ² distribution if the factor is right. A candidate
//! above the quantile stays out, and counts as soon as it fits the estimate. A candidate that no longer fits
//! is rejected again, the worst first.
//!
//! This rule trusts the factors that came first. If other rejected factors confirm a candidate, or if it
//! fails by little, a [`trial`] decides whether they are right and the factors that count are wrong.
mod candidates;
mod fit;
mod trial;

pub(super) use candidates::{Candidate, OutlierCandidates};

use super::Smoother;
use super::changes::{Change, Touched};
use super::undetermined::Moves;
use super::update::Undo;
use crate::factor_id::FactorId;
use crate::report::{FactorRejection, UpdateReport};
use fit::Fit;
use manifactor_graph::{FactorEntry, Key, Resolved};
use manifactor_solve::odometry::{best_fit, by_variables, is_sequential};
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of factors that one update rejects because they no longer fit.
const MAX_REJECTIONS: usize = 4;

impl Smoother {
    /// Returns the factors that are rejected as outliers, in the order of their ids; see
    /// [`Outliers`](crate::Outliers).
    pub fn rejections(&mut self) -> Vec<FactorRejection> {
        let rejected: Vec<u32> = self.model.rejected().iter().copied().collect();
        let one = |f: u32| {
            let cost = self.fit().square(f).map(|square| 0.5 * square);
            Some(FactorRejection { factor: FactorId(f), since: self.candidates.get(f)?.since, cost })
        };
        rejected.into_iter().filter_map(one).collect()
    }

    /// Returns the factor that fits the current values best, for each set of variables with several factors
    /// in this update. It counts as odometry if the variables are neighbours. The order of the factors does
    /// not matter.
    pub(super) fn best_between(&self, changes: &[Change]) -> BTreeMap<Vec<u32>, u32> {
        if self.schedule.settings().outliers.is_none() {
            return BTreeMap::new();
        }
        let new = changes.iter().filter_map(|change| match change {
            Change::Insert { number, entry, resolved, .. } => {
                Some((resolved.variables.to_vec(), (*number, entry)))
            }
            _ => None,
        });
        let estimate = |key: &Key| self.estimate(key.as_str());
        let misfit = |entry: &FactorEntry| entry.squared(estimate).unwrap_or(f64::INFINITY);
        let parallel = by_variables(new).into_iter().filter(|(_, factors)| factors.len() > 1);
        parallel
            .filter_map(|(variables, factors)| {
                Some((variables, best_fit(factors, |(_, entry)| misfit(entry))?.0))
            })
            .collect()
    }

    /// Returns the bounds of a new factor if it is a candidate.
    pub(super) fn new_candidate(
        &self,
        entry: &FactorEntry,
        resolved: &Resolved,
        number: u32,
        best: &BTreeMap<Vec<u32>, u32>,
    ) -> Option<Candidate> {
        let outliers = self.schedule.settings().outliers.as_ref()?;
        let name = entry.factor.typetag_name();
        let is_named = outliers.types.is_empty() || outliers.types.iter().any(|t| t.as_str() == name);
        let variables = &resolved.variables;
        let couples = variables.len() > 1
            && (best.get(&ascending(variables)).is_some_and(|best| *best != number)
                || !self.is_odometry(variables));
        let rows = entry.factor.erased().signature().rows.filter(|rows| *rows > 0)?;
        let (bound, gain) =
            (outliers.probability.chi_squared(rows), *outliers.max_information_gain * rows as f64);
        (is_named && couples).then_some(Candidate { bound, gain, since: self.schedule.updates() + 1 })
    }

    /// Returns whether a new factor between these variables is odometry: they are neighbours, and no trusted
    /// factor connects them yet.
    fn is_odometry(&self, variables: &[u32]) -> bool {
        let places = variables.iter().map(|v| self.model.record(*v));
        if !is_sequential(places.map(|place| (place.column as usize, place.ordinal))) {
            return false;
        }
        let sorted = ascending(variables);
        let is_trusted = |f: &u32| {
            let factor = self.model.factor(*f).filter(|factor| factor.entry.is_some());
            !self.candidates.contains(*f)
                && !self.model.is_rejected(*f)
                && factor.is_some_and(|f| f.variables().eq(sorted.iter().copied()))
        };
        !self.model.factors_of(variables).iter().any(is_trusted)
    }

    /// Inserts new candidates as rejected, and forgets removed ones. Returns the new candidates that are in
    /// the model.
    pub(super) fn insert_candidates(&mut self, new: BTreeMap<u32, Candidate>, removed: &[u32]) -> Vec<u32> {
        removed.iter().for_each(|f| self.candidates.forget(*f));
        let new = new.into_iter().filter(|(f, _)| self.model.factor(*f).is_some());
        let numbers = new.map(|(f, candidate)| {
            self.candidates.insert(f, candidate);
            f
        });
        numbers.collect()
    }

    /// Tests new candidates, and candidates with variables that have moved.
    pub(super) fn test_outliers(&mut self, new: &[u32], report: &mut UpdateReport) {
        if self.candidates.is_empty() {
            return;
        }
        // a single candidate is trusted more if few were wrong so far: by Bayes' rule, the odds in nats add
        // to the gain
        let rejected = self.model.rejected().len();
        let out = rejected - new.len();
        let counted = self.candidates.len() - rejected;
        let odds = ((counted + 1) as f64 / (out + 1) as f64).ln();
        let (mut fitting, mut failing) = (vec![], vec![]);
        for f in new {
            let Some(Candidate { bound, gain, .. }) = self.candidates.get(*f) else { continue };
            match self.fit().innovation(&[*f]) {
                Some(innovation) if innovation.square > bound || innovation.gain > gain + odds => {
                    failing.push((*f, innovation));
                }
                // an undetermined or undefined candidate contradicts no other factor
                _ => fitting.push(*f),
            }
        }
        if !self.readmit_factors(&fitting, report) {
            report.rejected.extend(fitting.drain(..).map(FactorId));
        }
        report.rejected.extend(failing.iter().map(|(f, _)| FactorId(*f)));
        let moved = self.candidates.drain_moved();
        let returning = self.fitting_rejected(new, &moved);
        if self.readmit_factors(&returning, report) {
            report.readmitted.extend(returning.iter().map(|f| FactorId(*f)));
            fitting.extend(returning);
        }
        self.drop_unfit(&moved, &fitting, report);
        self.try_rejected(&failing, report);
    }

    /// Accepts rejected factors, and returns whether they count. If the linear system overflows with them,
    /// they stay out.
    fn readmit_factors(&mut self, factors: &[u32], report: &mut UpdateReport) -> bool {
        let changes = factors.iter().map(|f| Change::Readmit { number: *f }).collect();
        if factors.is_empty() {
            return true;
        }
        if self.apply_and_solve(changes, Touched::default(), false, report).is_err() {
            return false;
        }
        self.run_follow_up_passes(report);
        true
    }

    /// Returns rejected factors with moved variables that fit the estimate itself. A fit within Σ is not
    /// enough: after many tests a wrong factor would pass one by chance.
    fn fitting_rejected(&mut self, new: &[u32], moved: &BTreeSet<u32>) -> Vec<u32> {
        let old = self.model.rejected().iter().copied().filter(|f| !new.contains(f));
        let has_moved = |f: u32| {
            let mut variables = self.model.factor(f).into_iter().flat_map(|f| f.variables());
            variables.any(|v| moved.contains(&v))
        };
        let mut old: Vec<u32> = old.filter(|f| has_moved(*f)).collect();
        old.retain(|f| {
            let bound = self.candidates.bound(*f);
            self.fit().square(*f).is_some_and(|square| square <= bound)
        });
        old
    }

    /// Rejects candidates that count and no longer fit, the worst first.
    fn drop_unfit(&mut self, moved: &BTreeSet<u32>, admitted: &[u32], report: &mut UpdateReport) {
        let mut around = self.model.factors_of(&moved.iter().copied().collect::<Vec<_>>());
        around.extend(admitted);
        around.retain(|f| self.candidates.counts(&self.model, *f));
        for _ in 0..MAX_REJECTIONS {
            let Some((worst, excess)) = self.worst_factor(&around) else { return };
            let rejected = vec![Change::Reject { number: worst }];
            if excess <= 1.0 || self.apply_and_solve(rejected, Touched::default(), false, report).is_err() {
                return;
            }
            self.candidates.record_rejection(worst, self.schedule.updates());
            report.rejected.push(FactorId(worst));
            around.retain(|f| *f != worst);
            self.run_follow_up_passes(report);
        }
    }

    /// Returns the factor with the largest share of its bound at the estimate, and that share.
    fn worst_factor(&mut self, factors: &[u32]) -> Option<(u32, f64)> {
        let share =
            |f: &u32| (*f, 2.0 * self.steps.cost_of(&mut self.model, &[*f]).cost / self.candidates.bound(*f));
        factors.iter().map(share).max_by(|(f, a), (g, b)| a.total_cmp(b).then(g.cmp(f)))
    }

    /// Returns the fit of rejected factors to the estimate.
    fn fit(&mut self) -> Fit<'_> {
        let Self { model, steps, factorization, .. } = self;
        Fit { model, steps, factorization }
    }

    /// Applies changes, solves again, and returns the changes that undo them. If that fails, everything is as
    /// before.
    fn apply_and_solve(
        &mut self,
        changes: Vec<Change>,
        mut touched: Touched,
        is_turn: bool,
        report: &mut UpdateReport,
    ) -> Result<Vec<Change>, Failed> {
        let changes: Vec<Change> =
            changes.into_iter().filter_map(|change| change.apply(&mut self.model, &mut touched)).collect();
        self.sort_factors(&mut touched.factors);
        let is_finite = self.model.linearize(&touched.factors).not_finite.is_none();
        let mut undo = Undo { changes, ..Undo::default() };
        if is_finite {
            self.undetermined.doubt_inactive(&self.model, &mut touched);
            undo.moves = Moves::of(&mut self.model, &self.factorization, &mut touched);
            if self.run_pass(&touched, &undo.moves, is_turn, report).is_ok() {
                return Ok(undo.changes);
            }
        }
        self.undo(undo);
        Err(Failed)
    }
}

fn ascending(variables: &[u32]) -> Vec<u32> {
    let mut sorted = variables.to_vec();
    sorted.sort_unstable();
    sorted
}

/// A pass that failed.
#[derive(Debug)]
struct Failed;
