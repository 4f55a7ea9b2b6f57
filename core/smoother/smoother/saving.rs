//! Saving a smoother, and continuing after a restart.
use super::Smoother;
use super::factorization::Factorization;
use super::queue::RelinearizationQueue;
use crate::elimination_tree::Couplings;
use crate::model::{Model, NewNumber, Prior};
use crate::removed::Removed;
use crate::saved::{LoadError, SaveError, Saved, SavedFactor, SavedPrior, SavedVariable};

impl Smoother {
    /// Returns the smoother as text. [`load`](Self::load) restores it with equal bits on a processor of this
    /// kind. On a different processor, estimates are equal until the next update, and afterwards up to
    /// rounding.
    ///
    /// # Errors
    /// If there are changes that no update has made yet, or a factor or value cannot be written as text.
    pub fn save(&self) -> Result<String, SaveError> {
        if !self.pending.is_empty() {
            return Err(SaveError::Pending);
        }
        let mut variables = vec![];
        for v in 0..self.model.variables() as u32 {
            let Some(point) = self.model.point(v) else { continue };
            let step = self.steps.of(&self.model, v).iter().map(|d| d.to_bits()).collect();
            let place = self.model.record(v);
            let key = place.key.clone();
            let ranks = place.is_present.then_some([place.rank, place.ordinal]);
            let held = place.held;
            let is_undetermined = self.model.is_undetermined(v) || !place.is_present;
            let damping = (self.model.blocks.damping(v).to_bits(), self.steps.is_damped(v));
            variables.push(SavedVariable { key, ranks, point, step, damping, held, is_undetermined });
        }
        let factors = self.model.all_factors().map(|(number, factor, entry)| {
            let entry = entry.clone();
            SavedFactor {
                number,
                weight: factor.weight,
                entry,
                candidate: self.candidates.saved(&self.model, number),
            }
        });
        let saved = Saved {
            settings: self.schedule.settings().clone(),
            updates: self.schedule.updates(),
            is_quiet: self.schedule.is_quiet(),
            postponed: self.queue.postponed(),
            next_factor: self.model.next_factor(),
            variables,
            factors: factors.collect(),
            fronts: self.factorization.save(),
            added: self.model.added(),
            ordinals: self.model.ordinals(),
            unused: self.model.unused(),
            priors: self.model.priors().filter_map(|f| self.save_prior(f)).collect(),
            removed_keys: self.model.removed.keys.clone(),
            removed_factors: self.model.removed.factors.clone(),
            waiting: sorted(self.queue.waiting()),
            urgent: sorted(self.queue.urgent()),
            doubtful: self.undetermined.doubtful().to_vec(),
            time: self.schedule.window().time().map(f64::to_bits),
            times: self.schedule.times(),
            moved: self.candidates.moved().clone(),
        };
        saved.write()
    }

    /// Restores a [saved](Self::save) smoother.
    ///
    /// # Errors
    /// If the text is not a saved smoother, is damaged, has a different version, has a type that this program
    /// does not have, or contradicts itself.
    pub fn load(text: &str) -> Result<Self, LoadError> {
        let saved = Saved::read(text)?;
        let mut smoother = Smoother::new(saved.settings);
        smoother.schedule.restore(saved.updates, saved.is_quiet);
        for variable in &saved.variables {
            insert(&mut smoother.model, variable)?;
        }
        let removed = saved.variables.iter().filter(|variable| variable.ranks.is_none()).count();
        let fits = smoother.model.restore(saved.added, &saved.ordinals, &saved.unused)
            && saved.unused.len() == removed;
        fits.then_some(()).ok_or(LoadError::Inconsistent("removed variables"))?;
        smoother.resize();
        let steps = saved.variables.iter().flat_map(|variable| &variable.step);
        smoother.steps.restore(steps.map(|step| f64::from_bits(*step)).collect());
        for (v, variable) in saved.variables.iter().enumerate() {
            let (damping, takes_steps) = (f64::from_bits(variable.damping.0), variable.damping.1);
            if !(damping >= 0.0 && damping.is_finite()) {
                return Err(LoadError::Inconsistent("what steps are damped by"));
            }
            let estimate = smoother
                .model
                .point(v as u32)
                .and_then(|point| point.erased().retract(smoother.steps.of(&smoother.model, v as u32)));
            // a finite point and a finite step may have an infinite sum
            if !estimate.is_some_and(|estimate| estimate.erased().is_finite()) {
                return Err(LoadError::Inconsistent("a variable's key, point or step"));
            }
            smoother.model.blocks.damp(v as u32, damping);
            if takes_steps {
                smoother.steps.mark_damped(v as u32);
            }
        }
        // counters that continue from here must not wrap around
        let is_young = saved.ordinals.iter().chain([&saved.added]).all(|count| *count < 1 << 62)
            && saved.updates < 1 << 62
            && saved.next_factor < 1 << 31;
        is_young.then_some(()).ok_or(LoadError::Inconsistent("its counters"))?;
        smoother.insert_priors(&saved.priors, saved.next_factor)?;
        smoother.insert_factors(&saved.factors, saved.next_factor)?;
        smoother.factorization = Factorization::load(saved.fronts, &smoother.model)
            .map_err(|_| LoadError::Inconsistent("the linear system overflows"))?
            .ok_or(LoadError::Inconsistent("its fronts do not fit its factors"))?;
        smoother.undetermined.list_undetermined(&mut smoother.model);
        let n = smoother.model.variables() as u32;
        let lists = [&saved.waiting, &saved.urgent, &saved.doubtful].into_iter().flatten();
        if lists.chain(&saved.moved).any(|v| *v >= n) {
            return Err(LoadError::Inconsistent("a number that no variable has"));
        }
        smoother.queue = RelinearizationQueue::load(saved.waiting, saved.urgent, saved.postponed, n as usize);
        smoother.undetermined.doubt(saved.doubtful);
        smoother.candidates.restore_moved(saved.moved);
        smoother.model.removed = Removed { keys: saved.removed_keys, factors: saved.removed_factors };
        let fits = smoother.schedule.load_times(&smoother.model, saved.time, &saved.times);
        fits.then_some(()).ok_or(LoadError::Inconsistent("times"))?;
        Ok(smoother)
    }

    fn save_prior(&self, number: u32) -> Option<SavedPrior> {
        let Prior { variables, h, g, constant } = self.model.prior(number)?;
        let bits = |list: Vec<f64>| list.into_iter().map(f64::to_bits).collect();
        Some(SavedPrior { number, variables, h: bits(h), g: bits(g), constant: constant.to_bits() })
    }

    /// Inserts the linear priors of marginalized variables.
    fn insert_priors(&mut self, priors: &[SavedPrior], next: u32) -> Result<(), LoadError> {
        let n = self.model.variables() as u32;
        for SavedPrior { number, variables, h, g, constant } in priors {
            let ascend = variables.windows(2).all(|pair| pair[0] < pair[1]);
            let are_there = variables.iter().all(|v| *v < n && self.model.record(*v).is_present);
            let dim: usize = if are_there { variables.iter().map(|v| self.dim(*v)).sum() } else { 0 };
            let numbers =
                |bits: &[u64]| -> Vec<f64> { bits.iter().map(|bits| f64::from_bits(*bits)).collect() };
            let prior = Prior {
                variables: variables.clone(),
                h: numbers(h),
                g: numbers(g),
                constant: f64::from_bits(*constant),
            };
            let is_finite = prior.h.iter().chain(&prior.g).chain([&prior.constant]).all(|x| x.is_finite());
            let fits = h.len() == dim * (dim + 1) / 2 && g.len() == dim && *number < next;
            if !(ascend && are_there && is_finite && fits) || self.model.factor(*number).is_some() {
                return Err(LoadError::Inconsistent("what variables have left behind"));
            }
            self.model.insert_prior(*number, &prior);
        }
        Ok(())
    }

    /// Inserts factors and linearizes them at the saved points.
    fn insert_factors(&mut self, factors: &[SavedFactor], next: u32) -> Result<(), LoadError> {
        let mut errors = vec![];
        for (i, SavedFactor { number, weight, entry, candidate }) in factors.iter().enumerate() {
            let is_next = i == 0 || factors[i - 1].number < *number;
            let is_taken = self.model.factor(*number).is_some();
            if !is_next || is_taken || *number >= next || !(*weight >= 0.0 && weight.is_finite()) {
                return Err(LoadError::Inconsistent("a factor's number or weight"));
            }
            if let Some(resolved) = entry.resolve(i, |key| self.find(key), &mut errors) {
                self.model.insert(*number, entry, &resolved, *weight);
            }
            if let Some(candidate) = candidate {
                self.candidates.restore(*number, *candidate);
                if candidate.since.is_some() {
                    self.model.reject(*number);
                }
            }
        }
        if !errors.is_empty() {
            return Err(LoadError::Graph(errors));
        }
        self.model.skip_to(next);
        let numbers: Vec<u32> = factors.iter().map(|factor| factor.number).collect();
        if self.model.linearize(&numbers).not_finite.is_some() {
            return Err(LoadError::Inconsistent("a factor that is not finite"));
        }
        for f in &numbers {
            self.model.count(*f, self.model.is_whole(*f));
        }
        self.undetermined.record_activities(&self.model, &numbers);
        self.model.sum_up();
        Ok(())
    }
}

fn insert(model: &mut Model, saved: &SavedVariable) -> Result<(), LoadError> {
    let SavedVariable { key, ranks, point, step, held, is_undetermined, .. } = saved;
    let value = point.erased();
    let dim = value.dim();
    // a free number may hold the key of a variable that exists
    let is_known =
        ranks.is_some() && model.variable(key.as_str()).is_some_and(|v| model.record(v).is_present);
    if is_known || step.len() != dim || !value.is_finite() {
        return Err(LoadError::Inconsistent("a variable's key, point or step"));
    }
    if dim < 32 && held >> dim != 0 {
        return Err(LoadError::Inconsistent("directions that are held"));
    }
    let v = model.variables() as u32;
    model.push_variable(key.clone(), &**point, *held, NewNumber { number: v, is_reused: false });
    let place = model.record_mut(v);
    place.is_present = ranks.is_some();
    [place.rank, place.ordinal] = ranks.unwrap_or_default();
    model.set_undetermined(v, *is_undetermined && ranks.is_some());
    Ok(())
}

fn sorted(list: &[u32]) -> Vec<u32> {
    let mut list = list.to_vec();
    list.sort_unstable();
    list
}
