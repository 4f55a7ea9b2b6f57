//! Trials of rejected factors: all of them count for a while, with weights that separate the consistent ones.
//!
//! Shares follow the scale-invariant graduated kernel of riSAM (McGann, Rogers and Kaess, *Robust Incremental Smoothing and
//! Mapping*, ICRA 2023): ρ = ½c²r² / (c² + r^2μ), with μ from 0, where it is a quadratic, to 1, where it is Geman and
//! McClure's. The outcome stays where it lowers the truncated cost ½ Σ min(‖r‖², c²); otherwise all goes back.
use super::super::Session;
use super::super::changes::{Change, Touched};
use super::fit::Surprise;
use super::{Candidate, Failed};
use crate::factor_id::FactorId;
use crate::report::Report;
use manifactor_graph::Values;
use std::collections::BTreeSet;

/// Factors that were rejected last, which may bear out a new one.
const RECENT: usize = 8;
/// Two that fit each other may cost together by this share more than one of them: a prior on tangent vectors bends.
const BENT: f64 = 0.02;
/// Such factors cost alike: the one at least this share of the other.
const ALIKE: f64 = 0.5;
/// A factor that costs no more than this times its bound is tried though no other bears it out.
const NEAR: f64 = 3.0;
/// Rounds after the last μ, until no factor changes sides.
const ROUNDS: usize = 4;
/// Steps at most after each change of sides, until nothing has left the region of its linearization.
const STEPS: usize = 6;
/// Shares that differ by less are the same.
const SAME: f64 = 0.02;

/// A trial: the rejected factors that are tried, what takes the changes back, and the factors that count by a share.
struct Trial<'a> {
    factors: &'a [u32],
    undo: Vec<Change>,
    attenuated: BTreeSet<u32>,
}

impl Session {
    /// Tries the one of the factors just rejected that another bears out best, together with that.
    pub(super) fn try_rejected(&mut self, failing: &[(u32, Surprise)], report: &mut Report) {
        let mut best: Option<(f64, Vec<u32>)> = None;
        for (f, surprise) in failing {
            let Some(Candidate { bound, gain, .. }) = self.candidates.get(*f) else { continue };
            let excess = surprise.square / bound;
            let found = match self.bearing_out(*f, surprise) {
                Some((other, more)) => Some((more, vec![other, *f])),
                None => (excess <= NEAR && surprise.gain <= gain).then(|| (excess, vec![*f])),
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

    /// Of the factors that were rejected last, the one that fits best where a factor is taken to be right, if any does and that
    /// narrows it down; and what it costs then, by its bound.
    fn bearing_out(&mut self, factor: u32, surprise: &Surprise) -> Option<(u32, f64)> {
        let others = self.model.rejected().iter().filter(|f| **f != factor);
        let mut recent: Vec<(usize, u32)> =
            others.filter_map(|f| Some((self.candidates.get(*f)?.since, *f))).collect();
        recent.sort_unstable();
        recent.drain(..recent.len().saturating_sub(RECENT));
        let mut best: Option<(u32, f64)> = None;
        for (_, other) in recent {
            let Some(Candidate { bound, gain, .. }) = self.candidates.get(other) else { continue };
            let Some(alone) = self.fit().surprise(&[other]) else { continue };
            let (less, most) = (alone.square.min(surprise.square), alone.square.max(surprise.square));
            // the same fault of the map costs them about as much
            if less < ALIKE * most && most > bound {
                continue;
            }
            let Some(both) = self.fit().surprise(&[factor, other]) else { continue };
            // less than nothing: a fit that has found no minimum
            let more = both.square - most;
            let fits = (-bound..=bound + BENT * most).contains(&more) && both.gain - surprise.gain <= gain;
            if fits && best.is_none_or(|(_, least)| more / bound < least) {
                best = Some((other, more / bound));
            }
        }
        best
    }

    /// Lets factors count, and decides anew between them and those that they contradict. Where that is no better, all goes
    /// back.
    fn try_factors(&mut self, factors: &[u32], report: &mut Report) {
        report.trials += 1;
        let (before, old) = (self.truncated_cost(), self.estimates());
        let is_out = |f| self.model.is_rejected(f);
        let sides = self.candidates.iter().map(|(f, candidate)| (f, is_out(f).then_some(candidate.since)));
        let sides: Vec<(u32, Option<usize>)> = sides.collect();
        let mut trial = Trial { factors, undo: vec![], attenuated: BTreeSet::new() };
        let shaken = self.candidates.drain_shaken();
        let least = factors.iter().map(|f| self.candidates.bound(*f)).fold(f64::INFINITY, f64::min);
        let is_better =
            self.decide(&mut trial, report).is_ok() && self.truncated_cost() < before - 0.5 * least;
        let (mut rejected, mut readmitted) = (vec![], vec![]);
        if is_better {
            for (f, since) in sides {
                match (since.is_some(), self.model.is_rejected(f)) {
                    (true, false) => readmitted.push(FactorId(f)),
                    (false, true) => rejected.push(FactorId(f)),
                    _ => {}
                }
            }
            // what this update has rejected was never out for those who read its report
            let told = std::mem::take(&mut report.rejected);
            let (back, out): (Vec<_>, Vec<_>) = told.into_iter().partition(|f| readmitted.contains(f));
            readmitted.retain(|f| !back.contains(f));
            rejected.extend(out);
        } else {
            self.go_back(trial, &old, report);
            for (f, since) in sides {
                self.candidates.note_rejection(f, since.unwrap_or(self.schedule.updates()));
            }
            self.candidates.drain_shaken();
        }
        report.rejected.append(&mut rejected);
        report.readmitted.append(&mut readmitted);
        self.candidates.restore_shaken(shaken);
    }

    /// ½ Σ min(‖r‖², c²), c² being the bound of a factor that is rejected.
    fn truncated_cost(&mut self) -> f64 {
        let bounds: f64 = self.model.rejected().iter().map(|f| self.candidates.bound(*f)).sum();
        self.cost() + 0.5 * bounds
    }

    fn decide(&mut self, trial: &mut Trial<'_>, report: &mut Report) -> Result<(), Failed> {
        let all = trial.factors.iter().map(|f| Change::Readmit { number: *f }).collect();
        self.change_sides(trial, all, &[], report)?;
        let mut mu = Some(0.0);
        while let Some(now) = mu {
            let around = self.around(trial);
            let shares: Vec<(u32, f64)> = around.into_iter().map(|f| (f, self.share(f, now))).collect();
            self.change_sides(trial, vec![], &shares, report)?;
            mu = (now < 1.0).then(|| f64::min(1.0, now + 1.2 * (now + 0.1)));
        }
        for _ in 0..ROUNDS {
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
            self.change_sides(trial, changes, &shares, report)?;
            if is_last {
                break;
            }
        }
        Ok(())
    }

    /// The factors that may be wrong, count, and lie where something has moved.
    fn around(&self, trial: &Trial<'_>) -> Vec<u32> {
        let mut around = self.model.factors_of(&self.candidates.shaken().iter().copied().collect::<Vec<_>>());
        around.extend(trial.factors.iter().chain(&trial.attenuated));
        around.sort_unstable();
        around.dedup();
        around.retain(|f| self.candidates.counts(&self.model, *f));
        around
    }

    /// ‖r‖² of a factor that counts, whatever its share.
    fn full_square(&mut self, factor: u32) -> f64 {
        let share = self.model.factor(factor).map_or(1.0, |factor| factor.share);
        2.0 * self.steps.cost_of(&mut self.model, &[factor]).cost / share
    }

    /// The derivative of ρ by ½r².
    fn share(&mut self, factor: u32, mu: f64) -> f64 {
        let (square, c2) = (self.full_square(factor), self.candidates.bound(factor));
        let power = square.powf(mu);
        // above zero, so that the cost can be told from the share of it
        f64::max(1e-12, c2 * (c2 + (1.0 - mu) * power) / (c2 + power).powi(2))
    }

    /// Makes changes of what counts and by what share, and takes a step from there.
    fn change_sides(
        &mut self,
        trial: &mut Trial<'_>,
        changes: Vec<Change>,
        shares: &[(u32, f64)],
        report: &mut Report,
    ) -> Result<(), Failed> {
        let mut touched = Touched::default();
        for (f, share) in shares {
            let before = self.model.factor(*f).map_or(1.0, |factor| factor.share);
            if (before - share).abs() > SAME || (*share == 1.0 && before != 1.0) {
                self.model.attenuate(*f, *share);
                touched.change(&self.model, *f);
                trial.attenuated.insert(*f);
            }
        }
        for change in &changes {
            if let Change::Reject { number } = change {
                self.candidates.note_rejection(*number, self.schedule.updates());
            }
        }
        trial.undo.extend(self.turn_over(changes, touched, true, report)?);
        for _ in 0..STEPS {
            if !self.steady(report) && !self.settle(report) {
                return Err(Failed);
            }
            // what is far out says nothing of who is right
            if !self.queue.waiting().iter().any(|v| self.is_out(*v)) {
                break;
            }
            self.turn_over(vec![], Touched::default(), true, report)?;
        }
        Ok(())
    }

    /// Takes a trial back: what counted counts again, and the estimate is what it was.
    fn go_back(&mut self, trial: Trial<'_>, old: &Values, report: &mut Report) {
        let mut touched = Touched::default();
        for f in &trial.attenuated {
            self.model.attenuate(*f, 1.0);
            touched.change(&self.model, *f);
        }
        for v in self.candidates.drain_shaken() {
            let (key, point) = (&self.model.place(v).key, self.model.point(v));
            let step = point.zip(old.variable(key.as_str())).and_then(|(p, x)| p.erased().local(x));
            let Some(step) = step.filter(|_| self.factorization.contains(v)) else { continue };
            self.steps.set(&self.model, v, &step);
            if self.model.place(v).sealed == 0 {
                touched.held.push(v);
                touched.variables.push(v);
            }
        }
        let undo = trial.undo.into_iter().rev().collect();
        let _ = self.turn_over(undo, touched, false, report);
    }
}
