//! Changes of a session: checked when they are asked for, made by the next update, and taken back where that fails.
mod change;

pub(super) use change::{Change, Touched};

use super::Session;
use crate::error::ChangeError;
use crate::factor_id::FactorId;
use crate::model::{NewNumber, Reserved};
use indexmap::IndexMap;
use manifactor_graph::{FactorEntry, Fixed, Graph, GraphError, Key, Resolved, Values, Variable};
use std::any::TypeId;

/// A variable that comes with the next update.
pub(super) struct NewVariable {
    pub(super) value: Box<dyn Variable>,
    pub(super) held: u32,
    pub(super) at: NewNumber,
    /// When it comes, by the time that is set.
    pub(super) time: f64,
}

/// Changes that the next update makes.
#[derive(Default)]
pub(super) struct Pending {
    pub(super) variables: IndexMap<Key, NewVariable>,
    reserved: Reserved,
    /// The time that was set since the last update.
    pub(super) time: Option<f64>,
    /// Variables that are to leave.
    pub(super) leaving: Vec<Key>,
    pub(super) changes: Vec<Change>,
    /// Numbers of factors: the next one; and whether those with changes are there, after these.
    numbers: Option<u32>,
    is_there: IndexMap<u32, Option<FactorEntry>>,
}

impl Pending {
    pub(super) fn is_empty(&self) -> bool {
        self.variables.is_empty() && self.changes.is_empty() && self.leaving.is_empty() && self.time.is_none()
    }
}

impl Session {
    /// Adds variables with their first values, and factors between any variables, new or not. What `factors` hold fixed is
    /// held. Takes effect at the next [`update`](Self::update). Returns the factors' ids, in order.
    ///
    /// A variable that nothing determines yet, a point that is seen once, say, is *parked*: it waits with its factors,
    /// and the report names it.
    ///
    /// # Errors
    /// If a variable is there already, or factors do not fit: everything that is wrong with them; where the window is by seconds,
    /// and no time is set. Nothing is added then.
    pub fn push(&mut self, factors: &Graph, values: &Values) -> Result<Vec<FactorId>, ChangeError> {
        let time = self.schedule.time_of_new(self.pending.time)?;
        let is_known = |key: &Key| {
            self.model.variable(key.as_str()).is_some() || self.pending.variables.contains_key(key)
        };
        if let Some((key, _)) = values.iter().find(|(key, _)| is_known(key)) {
            return Err(ChangeError::Known { key: key.clone() });
        }
        let of_factors = factors.factors().iter().flat_map(|entry| &entry.keys).chain(factors.fixed().keys());
        let is_gone = |key: &&Key| {
            self.model.removed.keys.contains(key.as_str())
                && values.find(key.as_str()).is_none()
                && !is_known(key)
        };
        let mut taken =
            values.iter().map(|(key, _)| key).filter(|key| self.model.removed.keys.is_taken(key.as_str()));
        if let Some(key) = taken.next().or_else(|| of_factors.into_iter().find(is_gone)) {
            return Err(ChangeError::Gone { key: key.clone() });
        }
        let is_sealed =
            |key: &&Key| self.model.variable(key.as_str()).is_some_and(|v| self.model.place(v).sealed > 0);
        if let Some(key) = factors.fixed().keys().find(is_sealed) {
            return Err(ChangeError::Sealed { key: key.clone() });
        }
        let mut errors = vec![];
        let mut reserved = self.pending.reserved.clone();
        let at = values.iter().map(|(_, value)| self.model.reserve(value.erased().type_id(), &mut reserved));
        let at: Vec<NewNumber> = at.collect();
        let find = |key: &str| {
            let new = values.find(key).map(|(i, value)| (at[i].number as usize, value.erased().type_id()));
            new.or_else(|| self.find(key))
        };
        let mut resolved = Vec::with_capacity(factors.factors().len());
        for (i, entry) in factors.factors().iter().enumerate() {
            resolved.extend(entry.resolve(i, find, &mut errors));
        }
        for (key, fixed) in factors.fixed() {
            let new = values.variable(key.as_str()).map(|value| value.erased().tangent());
            match new.or_else(|| self.tangent(key.as_str())) {
                Some(tangent) => fixed.check(key, tangent, &mut errors),
                None => errors.push(GraphError::MissingFixed { key: key.clone() }),
            }
        }
        let bad = values.iter().filter(|(_, value)| !value.erased().is_finite());
        errors.extend(bad.map(|(key, _)| GraphError::NotFinite { key: key.clone() }));
        if !errors.is_empty() {
            return Err(ChangeError::Graph(errors));
        }
        self.pending.reserved = reserved;
        for ((key, value), at) in values.iter().zip(at) {
            let held = factors.fixed().get(key).map_or(0, |fixed| fixed.bits(value.erased().tangent()));
            let new = NewVariable { value: value.erased().clone_box(), held, at, time };
            self.pending.variables.insert(key.clone(), new);
        }
        for (key, fixed) in factors.fixed().iter().filter(|(key, _)| !values.contains(key.as_str())) {
            self.fix(key, fixed)?;
        }
        let ids = factors.factors().iter().zip(resolved).map(|(entry, resolved)| {
            let number = self.pending.numbers.unwrap_or(self.model.next_factor());
            self.pending.numbers = Some(number + 1);
            self.insert(number, entry.clone(), resolved, 1.0)
        });
        Ok(ids.collect())
    }

    /// Says what time it is: variables that are pushed from now on come at this time. The unit is a second, the origin is free. A
    /// window by seconds needs it before the first [`push`](Self::push). Takes effect at the next [`update`](Self::update), and is taken
    /// back with it where that fails.
    ///
    /// # Errors
    /// If `time` is not finite, or before the one that was set last.
    pub fn set_time(&mut self, time: f64) -> Result<(), ChangeError> {
        self.schedule.check_time(self.pending.time, time)?;
        self.pending.time = Some(time);
        Ok(())
    }

    fn insert(&mut self, number: u32, entry: FactorEntry, resolved: Resolved, weight: f64) -> FactorId {
        self.pending.is_there.insert(number, Some(entry.clone()));
        let entry = Box::new(entry);
        self.pending.changes.push(Change::Insert { number, entry, resolved, weight, rejected: false });
        FactorId(number)
    }

    /// Takes factors away. Takes effect at the next [`update`](Self::update). A variable that nothing determines any more
    /// is parked.
    ///
    /// # Errors
    /// If one of them is not there. None is taken away then.
    pub fn remove(&mut self, factors: &[FactorId]) -> Result<(), ChangeError> {
        let mut seen = std::collections::HashSet::new();
        if let Some(factor) = factors.iter().find(|f| self.entry(**f).is_none() || !seen.insert(**f)) {
            return Err(self.no_factor(*factor));
        }
        for FactorId(number) in factors {
            self.pending.is_there.insert(*number, None);
            self.pending.changes.push(Change::Remove { number: *number });
        }
        Ok(())
    }

    /// Puts another factor in the place of one: another measurement, noise or loss. It keeps the id and the variables, and
    /// counts once. Takes effect at the next [`update`](Self::update).
    ///
    /// # Errors
    /// If there is no such factor, or `entry` does not fit, or is between other variables.
    pub fn replace(&mut self, factor: FactorId, entry: FactorEntry) -> Result<(), ChangeError> {
        let before = self.entry(factor).ok_or_else(|| self.no_factor(factor))?;
        if before.keys != entry.keys {
            return Err(ChangeError::Keys { factor, expected: before.keys.clone() });
        }
        let mut errors = vec![];
        let resolved = entry.resolve(0, |key| self.find(key), &mut errors);
        let resolved = resolved.ok_or(ChangeError::Graph(errors))?;
        self.pending.changes.push(Change::Remove { number: factor.0 });
        self.insert(factor.0, entry, resolved, 1.0);
        Ok(())
    }

    /// Makes a factor count so many times, on top of its loss; 0 leaves it out. Takes effect at the next
    /// [`update`](Self::update).
    ///
    /// # Errors
    /// If there is no such factor, or the weight is negative or not finite.
    pub fn set_weight(&mut self, factor: FactorId, weight: f64) -> Result<(), ChangeError> {
        self.entry(factor).ok_or_else(|| self.no_factor(factor))?;
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(ChangeError::Weight { factor, weight });
        }
        self.pending.changes.push(Change::Weigh { number: factor.0, weight });
        Ok(())
    }

    /// Holds a variable, or some directions of its tangent space, at the estimate; or frees it, by
    /// `Fixed::Whole(false)`. Takes effect at the next [`update`](Self::update).
    ///
    /// # Errors
    /// If there is no such variable, or its tangent space has no such direction.
    pub fn fix(&mut self, key: &Key, fixed: &Fixed) -> Result<(), ChangeError> {
        let tangent = self.tangent(key.as_str()).ok_or_else(|| self.no_variable(key))?;
        let variable = self.model.variable(key.as_str());
        if variable.is_some_and(|v| self.model.place(v).sealed > 0) {
            return Err(ChangeError::Sealed { key: key.clone() });
        }
        let mut errors = vec![];
        fixed.check(key, tangent, &mut errors);
        if !errors.is_empty() {
            return Err(ChangeError::Graph(errors));
        }
        let held = fixed.bits(tangent);
        match self.pending.variables.get_mut(key) {
            Some(new) => new.held = held,
            None => {
                let changes = variable.map(|variable| Change::Hold { variable, held });
                self.pending.changes.extend(changes);
            }
        }
        Ok(())
    }

    /// A factor, as it will be after the next update; `None` where it is not there.
    pub fn entry(&self, factor: FactorId) -> Option<&FactorEntry> {
        match self.pending.is_there.get(&factor.0) {
            Some(pending) => pending.as_ref(),
            None => self.model.factor(factor.0)?.entry.as_ref(),
        }
    }

    /// How often a factor counts, as of the last update; `None` where it is not there.
    pub fn weight(&self, factor: FactorId) -> Option<f64> {
        self.model.factor(factor.0).filter(|factor| factor.entry.is_some()).map(|factor| factor.weight)
    }

    /// The number and the type of a variable, of a pending one too.
    pub(crate) fn find(&self, key: &str) -> Option<(usize, TypeId)> {
        if let Some(variable) = self.model.variable(key) {
            return Some((variable as usize, self.model.type_of(variable)?));
        }
        let new = self.pending.variables.get(key)?;
        Some((new.at.number as usize, new.value.erased().type_id()))
    }

    fn tangent(&self, key: &str) -> Option<&'static [&'static str]> {
        match self.model.variable(key) {
            Some(variable) => Some(self.model.place(variable).tangent),
            None => self.pending.variables.get(key).map(|new| new.value.erased().tangent()),
        }
    }
}
