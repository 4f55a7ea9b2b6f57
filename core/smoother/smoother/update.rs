//! One update: changes, the part of the tree that they affect, and new steps.
use super::Smoother;
use super::changes::{Change, NewVariable, Touched};
use super::relinearization::Choice;
use super::undetermined::Moves;
use crate::elimination_tree::{Affected, Couplings, RebuiltFronts};
use crate::error::UpdateError;
use crate::factor_id::FactorId;
use crate::model::{NewNumber, Overflow};
use crate::report::UpdateReport;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The inverse changes of an update, to undo it.
#[derive(Default)]
pub(super) struct Undo {
    pub(super) variables: Vec<NewNumber>,
    pub(super) changes: Vec<Change>,
    pub(super) moves: Moves,
    /// Steps of moved variables before the update.
    pub(super) steps: Vec<(u32, Vec<f64>)>,
}

/// Largest number of touched variables that are eliminated last. If there are more, only the `NEWEST_LAST`
/// are: a new object with all its poses would fill the root (measured on fr2/desk, see
/// `docs/decisions/online.md`).
const MAX_LAST: usize = 32;
const NEWEST_LAST: usize = 8;

impl Smoother {
    /// Applies the changes since the last update and updates the estimate. Then variables are marginalized.
    /// Variables whose linear prior overflows stay, and [`not_marginalized`](UpdateReport::not_marginalized)
    /// names them.
    ///
    /// An update is *idle* if it and the previous one have no changes. Its limits are 1e-8 of
    /// the relinearization and wildfire thresholds, so that repeated
    /// updates converge to the minimum.
    ///
    /// # Errors
    /// If a factor that was pushed or changed is not finite, or the linear system overflows. All changes
    /// since the last update are undone then, and the ids of the pushed factors are void.
    pub fn update(&mut self) -> Result<UpdateReport, UpdateError> {
        let pending = std::mem::take(&mut self.pending);
        let is_quiet = pending.is_empty();
        self.schedule.begin(is_quiet);
        let mut report = UpdateReport::default();
        let mut touched = Touched { steps: true, ..Touched::default() };
        let mut undo = Undo::default();
        let mut came = vec![];
        for (key, NewVariable { value, held, at, time }) in pending.variables {
            self.model.push_variable(key, &*value, held, at);
            came.push((at.number, time));
            undo.variables.push(at);
            touched.doubtful.push(at.number);
        }
        touched.doubtful.extend(self.undetermined.doubtful());
        self.resize();
        let mut candidates = BTreeMap::new();
        let best = self.best_between(&pending.changes);
        for mut change in pending.changes {
            if let Change::Insert { number, entry, resolved, rejected, .. } = &mut change {
                // a replacement has the number of the replaced factor
                candidates.remove(number);
                if let Some(candidate) = self.new_candidate(entry, resolved, *number, &best) {
                    *rejected = true;
                    candidates.insert(*number, candidate);
                }
            }
            undo.changes.extend(change.apply(&mut self.model, &mut touched));
        }
        self.sort_factors(&mut touched.factors);
        let evaluation = self.model.linearize(&touched.factors);
        if let Some(factor) = evaluation.not_finite {
            let entry = self.model.factor(factor as u32).and_then(|factor| factor.entry.as_ref());
            let keys = entry.map_or(vec![], |entry| entry.keys.clone());
            self.undo(undo);
            return Err(UpdateError::NonFinite { factor: FactorId(factor as u32), keys });
        }
        self.undetermined.doubt_inactive(&self.model, &mut touched);
        let moves = Moves::of(&mut self.model, &self.factorization, &mut touched);
        for (key, value) in &pending.moved {
            let Some(variable) = self.model.variable(key.as_str()) else { continue };
            let step = self.model.point(variable).and_then(|point| point.erased().local(&**value));
            if let Some(step) = step {
                undo.steps.push((variable, self.steps.of(&self.model, variable).to_vec()));
                self.steps.set(&self.model, variable, &step);
                touched.held.push(variable);
            }
        }
        let is_turn = self.queue.postponed() > 0 || self.schedule.is_turn();
        if let Err(overflow) = self.run_pass(&touched, &moves, is_turn, &mut report) {
            let key = self.key(overflow.0);
            undo.moves = moves;
            self.undo(undo);
            return Err(UpdateError::Overflow { key });
        }
        self.schedule.complete(is_quiet);
        self.run_follow_up_passes(&mut report);
        let new = self.insert_candidates(candidates, &touched.removed);
        self.test_outliers(&new, &mut report);
        self.schedule.set_time(pending.time);
        came.into_iter()
            .for_each(|(variable, time)| self.schedule.add_to_window(&self.model, variable, time));
        let window = self.schedule.window().clone();
        let leaving = self.schedule.leaving(&self.model, &pending.leaving);
        if self.marginalize_now(&leaving, &mut report).is_err() {
            self.schedule.restore_window(window);
            report.not_marginalized = leaving.iter().map(|v| self.key(*v)).collect();
        }
        self.fill_report(&mut report);
        Ok(report)
    }

    /// Shortens steps that are too long, and takes the passes that cannot wait. The changes are already
    /// applied; a pass that fails does not undo them.
    pub(super) fn run_follow_up_passes(&mut self, report: &mut UpdateReport) {
        self.control_step(report);
        for _ in 0..self.schedule.settings().passes {
            if !self.is_urgent()
                || self.run_pass(&Touched::default(), &Moves::default(), true, report).is_err()
            {
                return;
            }
            self.control_step(report);
        }
    }

    /// Makes room for all variables of the model.
    pub(super) fn resize(&mut self) {
        let n = self.model.variables();
        self.factorization.resize(n);
        self.steps.resize(&self.model, n);
        self.queue.resize(n);
    }

    /// Sorts a list of factors. Removes duplicates and factors that do not exist.
    pub(super) fn sort_factors(&self, factors: &mut Vec<u32>) {
        factors.retain(|f| self.model.factor(*f).is_some());
        factors.sort_unstable();
        factors.dedup();
    }

    /// Undoes changes, the last one first.
    pub(super) fn undo(&mut self, undo: Undo) {
        undo.moves.undo(&mut self.model);
        for (variable, step) in undo.steps {
            self.steps.set(&self.model, variable, &step);
        }
        let mut touched = Touched::default();
        for change in undo.changes.into_iter().rev() {
            change.apply(&mut self.model, &mut touched);
        }
        self.sort_factors(&mut touched.factors);
        self.model.linearize(&touched.factors);
        for f in touched.factors {
            self.model.count(f, self.model.is_whole(f));
            self.undetermined.record_activity(&self.model, f);
        }
        self.undetermined.forget_inactive(&self.model, &touched.removed);
        self.model.sum_up();
        undo.variables.into_iter().rev().for_each(|at| self.model.undo_push(at));
        self.resize();
    }

    /// Recomputes the touched and the relinearized part of the tree, and solves for the steps.
    pub(super) fn run_pass(
        &mut self,
        touched: &Touched,
        moves: &Moves,
        is_turn: bool,
        report: &mut UpdateReport,
    ) -> Result<(), Overflow> {
        report.passes += 1;
        let mut affected = Affected::default();
        touched.variables.iter().for_each(|v| self.factorization.touch(*v, &mut affected));
        for v in &moves.leaving {
            self.factorization.touch_around(&self.model, *v, &mut affected);
        }
        let last = self.eliminated_last(touched, &moves.entering);
        let postponed = self.queue.postponed();
        let mut due = touched.held.clone();
        if touched.steps && self.schedule.settings().budget.is_none() {
            due.extend(self.damped_now());
        }
        let Choice { chosen, waiting } =
            self.choose_variables(due, is_turn, &mut affected, report.operations);
        let relinearized = self.relinearize(chosen, &touched.held);
        for v in &relinearized.variables {
            self.factorization.touch_around(&self.model, *v, &mut affected);
        }
        let damping = if touched.steps || is_turn {
            self.steps.relax(&mut self.model, &relinearized.variables)
        } else {
            vec![]
        };
        self.model.sum_up();
        let rebuilt = match self.factorization.rebuild(&self.model, &affected, moves, &last) {
            Ok(rebuilt) => rebuilt,
            Err(overflow) => {
                self.restore_points(&relinearized);
                for (v, damping) in damping {
                    self.model.blocks.damp(v, damping);
                    self.steps.mark_damped(v);
                }
                self.queue.set_postponed(postponed);
                self.model.sum_up();
                return Err(overflow);
            }
        };
        self.undetermined.remove_checked(&moves.judged);
        self.undetermined.doubt_undetermined(&self.model, &relinearized.factors);
        report.relinearized += relinearized.variables.len();
        self.accept_points(&relinearized, waiting.as_deref());
        for f in &rebuilt.new {
            report.operations += self.factorization.operations(&[*f]);
            report.refactorized += self.factorization.width(*f);
        }
        report.solved += self.solve(&rebuilt);
        Ok(())
    }

    /// Returns the variables to eliminate last.
    ///
    /// These are the touched variables, because they will be touched again. If there are new variables, only
    /// they and their touched neighbours count: an old pose whose factor was removed or replaced will not be
    /// touched again. If more than `MAX_LAST` remain, such as an object with all its poses, only the newest
    /// are returned, because all of them would fill the root.
    fn eliminated_last(&self, touched: &Touched, new: &[u32]) -> Vec<u32> {
        let mut last = touched.variables.clone();
        last.sort_unstable();
        last.dedup();
        if !new.is_empty() {
            let mut near: Vec<u32> = new.iter().flat_map(|v| self.model.coupled(*v)).collect();
            near.extend(new);
            near.sort_unstable();
            last.retain(|v| near.binary_search(v).is_ok());
        }
        if last.len() > MAX_LAST {
            last.sort_unstable_by_key(|v| Reverse(self.model.record(*v).rank));
            last.truncate(NEWEST_LAST);
            last.sort_unstable();
        }
        last
    }

    /// Solves for the steps, and records the variables that have moved. An idle update solves for all
    /// variables. Returns the number of solved variables.
    fn solve(&mut self, rebuilt: &RebuiltFronts) -> usize {
        let rebuilt = (!self.schedule.is_idle()).then_some(rebuilt);
        let Self { steps, model, factorization, .. } = self;
        let solved = steps.solve(model, factorization, rebuilt, self.schedule.wildfire_threshold());
        self.candidates.record_moved(self.steps.moved());
        for v in self.steps.moved().collect::<Vec<_>>() {
            self.record_excess(v);
        }
        solved
    }
}
