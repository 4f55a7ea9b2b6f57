//! Trials of rejected factors: all of them count for a while, with weights that separate the consistent ones.
//!
//! Shares follow the scale-invariant graduated kernel of riSAM (McGann, Rogers and Kaess, *Robust Incremental
//! Smoothing and Mapping*, ICRA 2023): ρ = ½c²r² / (c² + r^2μ). μ grows from 0, a quadratic, to 1, the kernel
//! of Geman and McClure. The outcome is accepted if it lowers the truncated cost ½ Σ min(‖r‖², c²). Otherwise
//! everything is restored.
use super::super::Smoother;
use super::super::changes::{Change, Touched};
use super::fit::Innovation;
use super::{Candidate, Failed};
use crate::factor_id::FactorId;
use crate::report::UpdateReport;
use manifactor_graph::Values;
use std::collections::BTreeSet;

/// Number of factors, rejected most recently, that may confirm a new one.
const MAX_CONFIRMING: usize = 8;
/// Two factors that agree may cost this share more than the costlier one alone, because a prior on tangent
/// vectors is only approximate.
const NONLINEAR_COST_SHARE: f64 = 0.02;
/// Two factors that agree have similar costs: the smaller is at least this share of the larger.
const MIN_COST_RATIO: f64 = 0.5;
/// A factor is tried without confirmation if its cost is at most this multiple of its bound.
const MAX_UNCONFIRMED_EXCESS: f64 = 3.0;
/// Rounds after the last μ, until no factor is rejected or readmitted.
const MAX_FINAL_ROUNDS: usize = 4;
/// Largest number of steps after each change, until all variables are within the region of their
/// linearization.
const MAX_STEPS: usize = 6;
/// Shares that differ by less count as equal.
const SHARE_TOLERANCE: f64 = 0.02;

/// A trial: the rejected factors under test, the changes that undo it, and the factors with a reduced share.
struct Trial<'a> {
    factors: &'a [u32],
    undo: Vec<Change>,
    attenuated: BTreeSet<u32>,
}

impl Smoother {
    /// Tries the newly rejected factor that a second rejected factor confirms best, together with that one. A
    /// factor that fails by little is tried alone.
    pub(super) fn try_rejected(&mut self, failing: &[(u32, Innovation)], report: &mut UpdateReport) {
        let mut best: Option<(f64, Vec<u32>)> = None;
        for (f, innovation) in failing {
            let Some(Candidate { bound, gain, .. }) = self.candidates.get(*f) else { continue };
            let excess = innovation.square / bound;
            let found = match self.confirming_factor(*f, innovation) {
                Some((other, more)) => Some((more, vec![other, *f])),
                None => {
                    (excess <= MAX_UNCONFIRMED_EXCESS && innovation.gain <= gain).then(|| (excess, vec![*f]))
                }
            };
            if let Some(found) = found
                && best.as_ref().is_none_or(|(least, _)| found.0 < *least)
            {
                best = Some(found);
            }
        }
        if let Some((.., factors)) = best {
            self.try_factors(&factors, report);
        }
    }

    /// Returns the recently rejected factor that confirms `factor` best, with its additional cost as a share
    /// of its bound. It must fit and add little information if `factor` is taken to be right.
    fn confirming_factor(&mut self, factor: u32, innovation: &Innovation) -> Option<(u32, f64)> {
        let others = self.model.rejected().iter().filter(|f| **f != factor);
        let mut recent: Vec<(usize, u32)> =
            others.filter_map(|f| Some((self.candidates.get(*f)?.since, *f))).collect();
        recent.sort_unstable();
        recent.drain(..recent.len().saturating_sub(MAX_CONFIRMING));
        let mut best: Option<(u32, f64)> = None;
        for (_, other) in recent {
            let Some(Candidate { bound, gain, .. }) = self.candidates.get(other) else { continue };
            let Some(alone) = self.fit().innovation(&[other]) else { continue };
            let (less, most) = (alone.square.min(innovation.square), alone.square.max(innovation.square));
            // one error of the map costs both of them a similar amount
            if less < MIN_COST_RATIO * most && most > bound {
                continue;
            }
            let Some(both) = self.fit().innovation(&[factor, other]) else { continue };
            // below -bound, the fit has not found a minimum
            let more = both.square - most;
            let fits = (-bound..=bound + NONLINEAR_COST_SHARE * most).contains(&more)
                && both.gain - innovation.gain <= gain;
            if fits && best.is_none_or(|(_, least)| more / bound < least) {
                best = Some((other, more / bound));
            }
        }
        best
    }

    /// Lets factors count, and decides again between them and the factors that they contradict. If the cost
    /// does not fall enough, everything is restored.
    fn try_factors(&mut self, factors: &[u32], report: &mut UpdateReport) {
        report.trials += 1;
        let (before, old) = (self.truncated_cost(), self.estimates());
        let is_out = |f| self.model.is_rejected(f);
        let sides = self.candidates.iter().map(|(f, candidate)| (f, is_out(f).then_some(candidate.since)));
        let sides: Vec<(u32, Option<usize>)> = sides.collect();
        let mut trial = Trial { factors, undo: vec![], attenuated: BTreeSet::new() };
        let moved = self.candidates.drain_moved();
        let least = factors.iter().map(|f| self.candidates.bound(*f)).fold(f64::INFINITY, f64::min);
        let is_better =
            self.run_trial(&mut trial, report).is_ok() && self.truncated_cost() < before - 0.5 * least;
        let (mut rejected, mut readmitted) = (vec![], vec![]);
        if is_better {
            for (f, since) in sides {
                match (since.is_some(), self.model.is_rejected(f)) {
                    (true, false) => readmitted.push(FactorId(f)),
                    (false, true) => rejected.push(FactorId(f)),
                    _ => {}
                }
            }
            // factors that this update both rejected and readmitted are not reported
            let told = std::mem::take(&mut report.rejected);
            let (back, out): (Vec<_>, Vec<_>) = told.into_iter().partition(|f| readmitted.contains(f));
            readmitted.retain(|f| !back.contains(f));
            rejected.extend(out);
        } else {
            self.undo_trial(trial, &old, report);
            for (f, since) in sides {
                self.candidates.record_rejection(f, since.unwrap_or(self.schedule.updates()));
            }
            self.candidates.drain_moved();
        }
        report.rejected.append(&mut rejected);
        report.readmitted.append(&mut readmitted);
        self.candidates.restore_moved(moved);
    }

    /// Returns the truncated cost ½ Σ min(‖r‖², c²). A rejected factor contributes its bound c².
    fn truncated_cost(&mut self) -> f64 {
        let bounds: f64 = self.model.rejected().iter().map(|f| self.candidates.bound(*f)).sum();
        self.cost() + 0.5 * bounds
    }

    fn run_trial(&mut self, trial: &mut Trial<'_>, report: &mut UpdateReport) -> Result<(), Failed> {
        let all = trial.factors.iter().map(|f| Change::Readmit { number: *f }).collect();
        self.apply_and_step(trial, all, &[], report)?;
        let mut mu = Some(0.0);
        while let Some(now) = mu {
            let around = self.around(trial);
            let shares: Vec<(u32, f64)> = around.into_iter().map(|f| (f, self.share(f, now))).collect();
            self.apply_and_step(trial, vec![], &shares, report)?;
            mu = (now < 1.0).then(|| f64::min(1.0, now + 1.2 * (now + 0.1)));
        }
        for _ in 0..MAX_FINAL_ROUNDS {
            let (mut changes, mut shares) = (vec![], vec![]);
            for f in self.around(trial) {
                if self.full_square(f) > self.candidates.bound(f) {
                    changes.push(Change::Reject { number: f });
                }
                shares.push((f, 1.0));
            }
            for f in trial.factors {
                let bound = self.candidates.bound(*f);
                if self.model.is_rejected(*f) && self.fit().square(*f).is_some_and(|square| square <= bound) {
                    changes.push(Change::Readmit { number: *f });
                }
            }
            let is_last = changes.is_empty();
            self.apply_and_step(trial, changes, &shares, report)?;
            if is_last {
                break;
            }
        }
        Ok(())
    }

    /// Returns the candidates that count and belong to the trial or have a moved variable.
    fn around(&self, trial: &Trial<'_>) -> Vec<u32> {
        let mut around = self.model.factors_of(&self.candidates.moved().iter().copied().collect::<Vec<_>>());
        around.extend(trial.factors.iter().chain(&trial.attenuated));
        around.sort_unstable();
        around.dedup();
        around.retain(|f| self.candidates.counts(&self.model, *f));
        around
    }

    /// Returns ‖r‖² of a factor that counts, without its share.
    fn full_square(&mut self, factor: u32) -> f64 {
        let share = self.model.factor(factor).map_or(1.0, |factor| factor.share);
        2.0 * self.steps.cost_of(&mut self.model, &[factor]).cost / share
    }

    /// Returns the share of a factor, which is the derivative of ρ with respect to ½r².
    fn share(&mut self, factor: u32, mu: f64) -> f64 {
        let (square, c2) = (self.full_square(factor), self.candidates.bound(factor));
        let power = square.powf(mu);
        // above zero, because the full cost is computed from the share of it
        f64::max(1e-12, c2 * (c2 + (1.0 - mu) * power) / (c2 + power).powi(2))
    }

    /// Applies changes and shares, and takes steps from there.
    fn apply_and_step(
        &mut self,
        trial: &mut Trial<'_>,
        changes: Vec<Change>,
        shares: &[(u32, f64)],
        report: &mut UpdateReport,
    ) -> Result<(), Failed> {
        let mut touched = Touched::default();
        for (f, share) in shares {
            let before = self.model.factor(*f).map_or(1.0, |factor| factor.share);
            if (before - share).abs() > SHARE_TOLERANCE || (*share == 1.0 && before != 1.0) {
                self.model.attenuate(*f, *share);
                touched.change(&self.model, *f);
                trial.attenuated.insert(*f);
            }
        }
        for change in &changes {
            if let Change::Reject { number } = change {
                self.candidates.record_rejection(*number, self.schedule.updates());
            }
        }
        trial.undo.extend(self.apply_and_solve(changes, touched, true, report)?);
        for _ in 0..MAX_STEPS {
            if !self.shorten_long_steps(report) && !self.solve_batch(report) {
                return Err(Failed);
            }
            // as long as variables are outside of their regions, costs do not show which factors are right
            if !self.queue.waiting().iter().any(|v| self.is_out(*v)) {
                break;
            }
            self.apply_and_solve(vec![], Touched::default(), true, report)?;
        }
        Ok(())
    }

    /// Undoes a trial: restores the factors that counted, and the estimate.
    fn undo_trial(&mut self, trial: Trial<'_>, old: &Values, report: &mut UpdateReport) {
        let mut touched = Touched::default();
        for f in &trial.attenuated {
            self.model.attenuate(*f, 1.0);
            touched.change(&self.model, *f);
        }
        for v in self.candidates.drain_moved() {
            let (key, point) = (&self.model.record(v).key, self.model.point(v));
            let step = point.zip(old.variable(key.as_str())).and_then(|(p, x)| p.erased().local(x));
            let Some(step) = step.filter(|_| self.factorization.contains(v)) else { continue };
            self.steps.set(&self.model, v, &step);
            if self.model.record(v).prior_count == 0 {
                touched.held.push(v);
                touched.variables.push(v);
            }
        }
        let undo = trial.undo.into_iter().rev().collect();
        let _ = self.apply_and_solve(undo, touched, false, report);
    }
}
