//! Relinearization of variables that have left the region of their linearization.
//!
//! The error of a linearization grows with the square of the step. The limit of a step is therefore |δᵢ| ≤
//! √(threshold · σᵢ), with σᵢ = 1/√Hᵢᵢ, the precision of the surrounding factors. Thresholds in radians and
//! metres would be too coarse for precise data and too fine for coarse data, and would need one number for
//! each type of variable.
//!
//! A robust loss adds a second error: its weights are taken at the linearization points. New weights change
//! the gradient by Δg = Σ (w/w₀ − 1) w₀Jᵀr. They could gain about ½ (Δgᵢ σᵢ)² nats. The limit leaves at most
//! ½ nat, however short the step is.
use super::Smoother;
use crate::elimination_tree::{Affected, Couplings};
use smallvec::SmallVec;

/// Relinearized variables, and their factors.
#[derive(Debug, Default)]
pub(super) struct Relinearized {
    pub(super) variables: Vec<u32>,
    pub(super) factors: Vec<u32>,
}

/// The variables to relinearize, and at a turn all variables outside of their regions. Both lists ascend.
#[derive(Debug)]
pub(super) struct Choice {
    pub(super) chosen: Vec<u32>,
    pub(super) waiting: Option<Vec<u32>>,
}

/// Largest number of halvings of a step that leaves the domain of a factor. After them, the variable keeps
/// its point.
const MAX_HALVINGS: u32 = 4;
/// Rounds of such halvings, each for some variables, before all variables keep their points.
const MAX_HALVING_ROUNDS: usize = 16;

impl Smoother {
    /// Returns the linearization error of a variable due to the length of its step, as a share of its limit.
    pub(super) fn excess(&self, variable: u32) -> f64 {
        self.steps.excess(&self.model, variable, *self.schedule.settings().relinearization_threshold)
    }

    /// Returns whether a variable cannot wait for the next turn. After a large loop closure, the steps are
    /// not a useful estimate.
    pub(super) fn is_urgent(&mut self) -> bool {
        let most = self.schedule.urgent_excess();
        let mut queue = std::mem::take(&mut self.queue);
        let is_urgent = queue.retain_urgent(|v| self.excess(v) > most && self.may_relinearize(v));
        self.queue = queue;
        is_urgent
    }

    /// Chooses the variables to relinearize: `chosen`, and at a turn the ones outside of their regions,
    /// within the budget. `spent` is the number of operations of the update so far.
    pub(super) fn choose_variables(
        &mut self,
        mut chosen: Vec<u32>,
        is_turn: bool,
        affected: &mut Affected,
        spent: f64,
    ) -> Choice {
        let mut out = vec![];
        if is_turn {
            out = self.variables_out();
            if let Some(budget) = self.schedule.settings().budget {
                let mut wanted = out.clone();
                wanted.extend(self.damped_now().map(|v| (self.excess(v), v)));
                wanted.sort_unstable_by(|(a, v), (b, u)| v.cmp(u).then(b.total_cmp(a)));
                wanted.dedup_by_key(|(_, v)| *v);
                let count = wanted.len();
                let taken =
                    self.within_budget(wanted, *budget - spent, spent == 0.0 && chosen.is_empty(), affected);
                self.queue.set_postponed(count - taken.len());
                chosen.extend(taken);
            } else {
                chosen.extend(out.iter().map(|(_, v)| *v));
            }
        }
        chosen.retain(|v| self.model.record(*v).prior_count == 0);
        chosen.sort_unstable();
        chosen.dedup();
        Choice { chosen, waiting: is_turn.then(|| out.into_iter().map(|(_, v)| v).collect()) }
    }

    /// Returns the variables outside of the regions of their linearizations, ascending, each with its excess
    /// due to the length of its step or to new weights of losses.
    fn variables_out(&mut self) -> Vec<(f64, u32)> {
        let mut moved: Vec<u32> = match self.schedule.is_idle() {
            true => {
                (0..self.model.variables() as u32).filter(|v| self.steps.has_step(&self.model, *v)).collect()
            }
            false => self.queue.waiting().to_vec(),
        };
        moved.retain(|v| self.may_relinearize(*v));
        moved.sort_unstable();
        moved.dedup();
        let mut out: Vec<(f64, u32)> = moved.iter().map(|v| (self.excess(*v), *v)).collect();
        if self.model.has_losses() {
            for ((excess, _), by_weight) in out.iter_mut().zip(self.excesses_by_weight(&moved)) {
                *excess = excess.max(by_weight);
            }
        }
        out.retain(|(excess, _)| *excess > self.schedule.largest_excess());
        out
    }

    /// Returns the gain in cost that new robust weights promise at each variable, as a share of ½ nat. Even a
    /// short step can change robust weights much.
    fn excesses_by_weight(&mut self, variables: &[u32]) -> Vec<f64> {
        let around = self.model.factors_of(variables);
        let changes = self
            .steps
            .at_estimate(&mut self.model, &around, |model, delta| model.reweighed(variables, delta));
        let share = |(v, change): (&u32, SmallVec<[f64; 9]>)| {
            let precision = self.model.blocks.precision(*v);
            let shares = change.iter().zip(precision).map(|(g, p)| (g / p).powi(2));
            shares.fold(0.0, f64::max)
        };
        variables.iter().zip(changes).map(share).collect()
    }

    /// Returns the variables that the budget allows, the largest excess first. The budget pays for the fronts
    /// that are already `affected` first. A relinearization costs as much as the current fronts above its
    /// variable.
    fn within_budget(
        &mut self,
        mut by_excess: Vec<(f64, u32)>,
        budget: f64,
        is_alone: bool,
        affected: &mut Affected,
    ) -> Vec<u32> {
        let mut variables = vec![];
        by_excess.sort_unstable_by(|(a, v), (b, u)| b.total_cmp(a).then(v.cmp(u)));
        let first = affected.0.len();
        let mut left = budget - self.factorization.operations(&affected.0);
        let mut must_take = is_alone && first == 0;
        for (_, v) in by_excess {
            let before = affected.0.len();
            self.factorization.touch_around(&self.model, v, affected);
            let needed = self.factorization.operations(&affected.0[before..]);
            if needed <= left || must_take {
                left -= needed;
                must_take = false;
                variables.push(v);
            } else {
                self.factorization.untouch(affected, before);
            }
        }
        self.factorization.untouch(affected, first);
        variables
    }

    /// Returns whether a variable is outside of the region of its linearization, and solved for.
    pub(super) fn is_out(&self, variable: u32) -> bool {
        self.excess(variable) > self.schedule.largest_excess() && self.may_relinearize(variable)
    }

    /// Returns the damped variables. A damped step does not reach the minimum, however short it is, so it is
    /// followed by more.
    pub(super) fn damped_now(&self) -> impl Iterator<Item = u32> {
        self.steps.damped().filter(|v| self.may_relinearize(*v))
    }

    /// Returns whether a variable may be relinearized: it is solved for, and no linear prior fixes its point.
    fn may_relinearize(&self, variable: u32) -> bool {
        self.factorization.contains(variable) && self.model.record(variable).prior_count == 0
    }

    /// Linearizes the factors of these variables, which ascend, at the estimate. The steps are not changed.
    ///
    /// If a factor is not defined or not finite there, its variables take half of the step, then half of
    /// that. In the end they keep their points. Variables of `held` are linearized in every case.
    pub(super) fn relinearize(&mut self, mut variables: Vec<u32>, held: &[u32]) -> Relinearized {
        let factors = self.model.factors_of(&variables);
        let took_part: Vec<bool> = factors.iter().map(|f| self.model.takes_part(*f)).collect();
        let mut halved = vec![0; variables.len()];
        let (mut moving, mut around) = (variables.clone(), factors.clone());
        for _ in 0..MAX_HALVING_ROUNDS {
            for v in &moving {
                let times = variables.binary_search(v).map_or(MAX_HALVINGS, |place| halved[place]);
                self.try_shortened_step(*v, times);
            }
            let out = self.linearize_within(&around, &factors, &took_part);
            if out.is_empty() {
                self.undetermined.record_activities(&self.model, &factors);
                let mut times = halved.iter();
                variables.retain(|v| times.next().is_some_and(|t| *t < MAX_HALVINGS) || held.contains(v));
                return Relinearized { variables, factors };
            }
            let of_these = out.iter().filter_map(|f| self.model.factor(*f)).flat_map(|f| f.variables());
            moving = of_these.filter(|v| variables.binary_search(v).is_ok()).collect();
            moving.sort_unstable();
            moving.dedup();
            for v in &moving {
                if let Ok(place) = variables.binary_search(v) {
                    halved[place] += 1;
                }
            }
            around = self.model.factors_of(&moving);
        }
        self.restore_points(&Relinearized { variables, factors });
        Relinearized::default()
    }

    /// Moves the trial point of a variable by its step, halved `halvings` times.
    fn try_shortened_step(&mut self, variable: u32, halvings: u32) {
        if halvings >= MAX_HALVINGS {
            self.model.reset_trial(variable);
            return;
        }
        let share = 0.5_f64.powi(halvings as i32);
        let step = self.steps.of(&self.model, variable).iter().map(|d| d * share);
        let step: SmallVec<[f64; 9]> = step.collect();
        self.model.try_point(variable, &step);
    }

    /// Linearizes `some` of the `factors`. Returns the ones that fail: they are not finite, or took part
    /// before and no longer do.
    fn linearize_within(&mut self, some: &[u32], factors: &[u32], took_part: &[bool]) -> Vec<u32> {
        let evaluation = self.model.linearize(some);
        let has_left = |f: &u32| {
            let took_part = factors.binary_search(f).is_ok_and(|place| took_part[place]);
            (took_part && !self.model.takes_part(*f)) || !self.model.is_finite(*f)
        };
        let mut out: Vec<u32> = some.iter().copied().filter(has_left).collect();
        out.extend(evaluation.not_finite.map(|f| f as u32));
        out
    }

    /// Restores the old linearization points.
    pub(super) fn restore_points(&mut self, relinearized: &Relinearized) {
        relinearized.variables.iter().for_each(|v| self.model.reset_trial(*v));
        // equal points give equal bits
        self.model.linearize(&relinearized.factors);
        self.undetermined.record_activities(&self.model, &relinearized.factors);
    }

    /// Accepts the new points. After a turn, the variables of `waiting` that keep their points still wait.
    pub(super) fn accept_points(&mut self, relinearized: &Relinearized, waiting: Option<&[u32]>) {
        for v in &relinearized.variables {
            self.model.accept(*v);
            self.steps.clear(&self.model, *v);
        }
        self.queue.relinearized(&relinearized.variables, waiting);
    }

    /// Queues a variable for the next turn if its step is too long for its linearization, or may have changed
    /// robust weights.
    pub(super) fn record_excess(&mut self, variable: u32) {
        let excess = self.excess(variable);
        let is_out = excess > self.schedule.largest_excess() || self.model.has_losses();
        if is_out {
            self.queue.push(variable);
        }
        if excess > self.schedule.urgent_excess() {
            self.queue.push_urgent(variable);
        }
    }
}
