//! A session that goes on after a restart.
use super::Session;
use crate::model::Model;
use crate::saved::{LoadError, SaveError, Saved, SavedFactor, SavedVariable};
use crate::tree::{Couplings, Tree};

impl Session {
    /// The session as text. [`load`](Self::load) makes a session of it that goes on with the same bits, on a processor of the
    /// same kind; on another, estimates are the same until the next update, and then up to rounding.
    ///
    /// # Errors
    /// Where there are changes that no update has made yet, or a factor or value has no text.
    pub fn save(&self) -> Result<String, SaveError> {
        if !self.pending.is_empty() {
            return Err(SaveError::Pending);
        }
        let mut variables = vec![];
        for (v, key) in self.model.keys().enumerate() {
            let (v, key) = (v as u32, key.clone());
            let Some(point) = self.model.point(v) else { continue };
            let step = self.delta[self.model.blocks.range(v)].iter().map(|d| d.to_bits()).collect();
            let place = self.model.place(v);
            variables.push(SavedVariable { key, point, step, held: place.held, parked: place.parked });
        }
        let factors = self.model.all_factors().map(|(number, factor)| {
            let entry = factor.entry.clone();
            SavedFactor { number, weight: factor.weight, entry }
        });
        let saved = Saved {
            settings: self.settings.clone(),
            updates: self.updates,
            postponed: self.postponed,
            next_factor: self.model.next_factor(),
            variables,
            factors: factors.collect(),
            fronts: self.tree.save(),
            waiting: sorted(&self.waiting),
            urgent: sorted(&self.urgent),
            doubtful: self.doubtful.clone(),
        };
        saved.write()
    }

    /// A session as it was [saved](Self::save).
    ///
    /// # Errors
    /// Where the text is none, is damaged, or is of another version; where this program does not have a type of its variables
    /// or factors; where it contradicts itself.
    pub fn load(text: &str) -> Result<Self, LoadError> {
        let saved = Saved::read(text)?;
        let mut session = Session::new(saved.settings).map_err(|e| LoadError::Read(e.to_string()))?;
        (session.updates, session.postponed) = (saved.updates, saved.postponed);
        for variable in &saved.variables {
            insert(&mut session.model, variable)?;
        }
        session.resize();
        let steps = saved.variables.iter().flat_map(|variable| &variable.step);
        session.delta.iter_mut().zip(steps).for_each(|(to, step)| *to = f64::from_bits(*step));
        session.put_factors(&saved.factors, saved.next_factor)?;
        session.tree = Tree::load(saved.fronts, &session.model, |v| session.model.place(v).is_in_tree())
            .ok_or(LoadError::Inconsistent("its fronts do not fit its factors"))?;
        session.put_fronts()?;
        let n = session.model.variables() as u32;
        for list in [&saved.waiting, &saved.urgent, &saved.doubtful] {
            if list.iter().any(|v| *v >= n) {
                return Err(LoadError::Inconsistent("a number that no variable has"));
            }
        }
        saved.waiting.iter().for_each(|v| session.is_waiting[*v as usize] = true);
        (session.waiting, session.urgent, session.doubtful) = (saved.waiting, saved.urgent, saved.doubtful);
        session.waiting.dedup();
        Ok(session)
    }

    /// Factors, linearized where they were.
    fn put_factors(&mut self, factors: &[SavedFactor], next: u32) -> Result<(), LoadError> {
        let mut errors = vec![];
        for (i, SavedFactor { number, weight, entry }) in factors.iter().enumerate() {
            let is_next = i == 0 || factors[i - 1].number < *number;
            if !is_next || *number >= next || !(*weight >= 0.0 && weight.is_finite()) {
                return Err(LoadError::Inconsistent("a factor's number or weight"));
            }
            if let Some(resolved) = entry.resolve(i, |key| self.find(key), &mut errors) {
                self.model.insert(*number, entry, &resolved, *weight);
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
        self.note_activities(&numbers);
        self.model.sum_up();
        Ok(())
    }

    /// The numbers of all fronts, and what hangs on them.
    fn put_fronts(&mut self) -> Result<(), LoadError> {
        let all: Vec<u32> = (0..self.tree.fronts.len() as u32).collect();
        self.fronts
            .build(&self.tree, &self.model.blocks, &all)
            .map_err(|_| LoadError::Inconsistent("the linear system overflows"))?;
        for f in &all {
            self.open.extend(self.fronts.open(*f));
        }
        let parked = |v: &u32| self.model.place(*v).parked;
        self.parked = (0..self.model.variables() as u32).filter(parked).collect();
        self.waiting_keys = self.parked.iter().map(|v| self.key(*v)).collect();
        Ok(())
    }
}

fn insert(model: &mut Model, saved: &SavedVariable) -> Result<(), LoadError> {
    let SavedVariable { key, point, step, held, parked } = saved;
    let value = point.erased();
    let dim = value.dim();
    if model.variable(key.as_str()).is_some() || step.len() != dim || !value.is_finite() {
        return Err(LoadError::Inconsistent("a variable's key, point or step"));
    }
    if dim < 32 && held >> dim != 0 {
        return Err(LoadError::Inconsistent("directions that are held"));
    }
    let v = model.variables() as u32;
    model.push_variable(key.clone(), &**point, *held);
    model.place_mut(v).parked = *parked;
    Ok(())
}

fn sorted(list: &[u32]) -> Vec<u32> {
    let mut list = list.to_vec();
    list.sort_unstable();
    list
}
