//! Saving a smoother, and continuing after a restart.
use super::Session;
use super::factorization::Factorization;
use super::queue::RelinearizationQueue;
use crate::elimination_tree::Couplings;
use crate::gone::Removed;
use crate::model::{Model, NewNumber, Prior};
use crate::saved::{LoadError, SaveError, Saved, SavedFactor, SavedPrior, SavedVariable};

impl Session {
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
            let place = self.model.place(v);
            let (key, born) = (place.key.clone(), place.is_there.then_some([place.born, place.ordinal]));
            let held = place.held;
            let parked = self.model.is_parked(v) || !place.is_there;
            let damping = (self.model.blocks.damping(v).to_bits(), self.steps.is_damped(v));
            variables.push(SavedVariable { key, born, point, step, damping, held, parked });
        }
        let factors = self.model.all_factors().map(|(number, factor, entry)| {
            let entry = entry.clone();
            SavedFactor {
                number,
                weight: factor.weight,
                entry,
                suspect: self.candidates.saved(&self.model, number),
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
            born: self.model.born(),
            ordinals: self.model.ordinals(),
            unused: self.model.unused(),
            priors: self.model.priors().filter_map(|f| self.save_prior(f)).collect(),
            gone: self.model.removed.keys.clone(),
            gone_factors: self.model.removed.factors.clone(),
            waiting: sorted(self.queue.waiting()),
            urgent: sorted(self.queue.urgent()),
            doubtful: self.undetermined.doubtful().to_vec(),
            time: self.schedule.window().time().map(f64::to_bits),
            times: self.schedule.times(),
            shaken: self.candidates.shaken().clone(),
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
        let mut session = Session::new(saved.settings);
        session.schedule.restore(saved.updates, saved.is_quiet);
        for variable in &saved.variables {
            insert(&mut session.model, variable)?;
        }
        let is_gone = saved.variables.iter().filter(|variable| variable.born.is_none()).count();
        let fits = session.model.restore(saved.born, &saved.ordinals, &saved.unused)
            && saved.unused.len() == is_gone;
        fits.then_some(()).ok_or(LoadError::Inconsistent("variables that are gone"))?;
        session.resize();
        let steps = saved.variables.iter().flat_map(|variable| &variable.step);
        session.steps.restore(steps.map(|step| f64::from_bits(*step)).collect());
        for (v, variable) in saved.variables.iter().enumerate() {
            let (damping, takes_steps) = (f64::from_bits(variable.damping.0), variable.damping.1);
            if !(damping >= 0.0 && damping.is_finite()) {
                return Err(LoadError::Inconsistent("what steps are damped by"));
            }
            let estimate = session
                .model
                .point(v as u32)
                .and_then(|point| point.erased().retract(session.steps.of(&session.model, v as u32)));
            // a finite point and a finite step may have an infinite sum
            if !estimate.is_some_and(|estimate| estimate.erased().is_finite()) {
                return Err(LoadError::Inconsistent("a variable's key, point or step"));
            }
            session.model.blocks.damp(v as u32, damping);
            if takes_steps {
                session.steps.note_damped(v as u32);
            }
        }
        // counters that continue from here must not wrap around
        let is_young = saved.ordinals.iter().chain([&saved.born]).all(|count| *count < 1 << 62)
            && saved.updates < 1 << 62
            && saved.next_factor < 1 << 31;
        is_young.then_some(()).ok_or(LoadError::Inconsistent("its counters"))?;
        session.put_priors(&saved.priors, saved.next_factor)?;
        session.put_factors(&saved.factors, saved.next_factor)?;
        session.factorization = Factorization::load(saved.fronts, &session.model)
            .map_err(|_| LoadError::Inconsistent("the linear system overflows"))?
            .ok_or(LoadError::Inconsistent("its fronts do not fit its factors"))?;
        session.undetermined.list_parked(&mut session.model);
        let n = session.model.variables() as u32;
        let lists = [&saved.waiting, &saved.urgent, &saved.doubtful].into_iter().flatten();
        if lists.chain(&saved.shaken).any(|v| *v >= n) {
            return Err(LoadError::Inconsistent("a number that no variable has"));
        }
        session.queue = RelinearizationQueue::load(saved.waiting, saved.urgent, saved.postponed, n as usize);
        session.undetermined.doubt(saved.doubtful);
        session.candidates.restore_shaken(saved.shaken);
        session.model.removed = Removed { keys: saved.gone, factors: saved.gone_factors };
        let fits = session.schedule.load_times(&session.model, saved.time, &saved.times);
        fits.then_some(()).ok_or(LoadError::Inconsistent("times"))?;
        Ok(session)
    }

    fn save_prior(&self, number: u32) -> Option<SavedPrior> {
        let Prior { variables, h, g, constant } = self.model.prior(number)?;
        let bits = |list: Vec<f64>| list.into_iter().map(f64::to_bits).collect();
        Some(SavedPrior { number, variables, h: bits(h), g: bits(g), constant: constant.to_bits() })
    }

    /// Inserts the linear priors of marginalized variables.
    fn put_priors(&mut self, priors: &[SavedPrior], next: u32) -> Result<(), LoadError> {
        let n = self.model.variables() as u32;
        for SavedPrior { number, variables, h, g, constant } in priors {
            let ascend = variables.windows(2).all(|pair| pair[0] < pair[1]);
            let are_there = variables.iter().all(|v| *v < n && self.model.place(*v).is_there);
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
    fn put_factors(&mut self, factors: &[SavedFactor], next: u32) -> Result<(), LoadError> {
        let mut errors = vec![];
        for (i, SavedFactor { number, weight, entry, suspect }) in factors.iter().enumerate() {
            let is_next = i == 0 || factors[i - 1].number < *number;
            let is_taken = self.model.factor(*number).is_some();
            if !is_next || is_taken || *number >= next || !(*weight >= 0.0 && weight.is_finite()) {
                return Err(LoadError::Inconsistent("a factor's number or weight"));
            }
            if let Some(resolved) = entry.resolve(i, |key| self.find(key), &mut errors) {
                self.model.insert(*number, entry, &resolved, *weight);
            }
            if let Some(suspect) = suspect {
                self.candidates.restore(*number, *suspect);
                if suspect.since.is_some() {
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
        self.undetermined.note_activities(&self.model, &numbers);
        self.model.sum_up();
        Ok(())
    }
}

fn insert(model: &mut Model, saved: &SavedVariable) -> Result<(), LoadError> {
    let SavedVariable { key, born, point, step, held, parked, .. } = saved;
    let value = point.erased();
    let dim = value.dim();
    // a free number may hold the key of a variable that exists
    let is_known = born.is_some() && model.variable(key.as_str()).is_some_and(|v| model.place(v).is_there);
    if is_known || step.len() != dim || !value.is_finite() {
        return Err(LoadError::Inconsistent("a variable's key, point or step"));
    }
    if dim < 32 && held >> dim != 0 {
        return Err(LoadError::Inconsistent("directions that are held"));
    }
    let v = model.variables() as u32;
    model.push_variable(key.clone(), &**point, *held, NewNumber { number: v, is_reused: false });
    let place = model.place_mut(v);
    place.is_there = born.is_some();
    [place.born, place.ordinal] = born.unwrap_or_default();
    model.set_parked(v, *parked && born.is_some());
    Ok(())
}

fn sorted(list: &[u32]) -> Vec<u32> {
    let mut list = list.to_vec();
    list.sort_unstable();
    list
}
