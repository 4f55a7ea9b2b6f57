//! Changes of the graph: checked when they are requested, applied by the next update, and undone if that
//! fails.
mod change;

pub(super) use change::{Change, Touched};

use super::Smoother;
use crate::error::ChangeError;
use crate::factor_id::FactorId;
use crate::model::{NewNumber, Reserved};
use indexmap::IndexMap;
use manifactor_graph::{
    FactorEntry, Fixed, Graph, GraphError, Key, Resolved, Values, Variable, manifold_name,
};
use std::any::TypeId;

/// A variable that the next update adds.
pub(super) struct NewVariable {
    pub(super) value: Box<dyn Variable>,
    pub(super) held: u32,
    pub(super) at: NewNumber,
    /// Time of its insertion, by the clock of the caller.
    pub(super) time: f64,
}

/// Changes that the next update applies.
#[derive(Default)]
pub(super) struct Pending {
    pub(super) variables: IndexMap<Key, NewVariable>,
    reserved: Reserved,
    /// The time that was set since the last update.
    pub(super) time: Option<f64>,
    /// New estimates of variables.
    pub(super) moved: IndexMap<Key, Box<dyn Variable>>,
    /// Variables to marginalize.
    pub(super) leaving: Vec<Key>,
    pub(super) changes: Vec<Change>,
    /// The next factor number, and the changed factors after these changes; `None` for a removed factor.
    numbers: Option<u32>,
    is_present: IndexMap<u32, Option<FactorEntry>>,
}

impl Pending {
    pub(super) fn is_empty(&self) -> bool {
        self.variables.is_empty()
            && self.changes.is_empty()
            && self.moved.is_empty()
            && self.leaving.is_empty()
            && self.time.is_none()
    }
}

impl Smoother {
    /// Adds variables with their initial values, and factors between new or existing variables. Variables
    /// that `factors` fixes are held. Takes effect at the next [`update`](Self::update). Returns the ids of
    /// the factors, in order.
    ///
    /// A variable that its factors do not determine yet is *undetermined*, for example a point that was
    /// observed once. It waits with its factors, and the report names it.
    ///
    /// # Errors
    /// If a variable exists already or has bounds, if a factor is a constraint, if the factors do not fit (all errors are listed), or if the
    /// window is in seconds and no time is set. Nothing is added then.
    pub fn push(&mut self, factors: &Graph, values: &Values) -> Result<Vec<FactorId>, ChangeError> {
        let time = self.schedule.time_of_new(self.pending.time)?;
        if let Some(key) = factors.bounds().keys().next() {
            return Err(ChangeError::Bounded { key: key.clone() });
        }
        if let Some(factor) = factors.factors().iter().position(FactorEntry::is_constraint) {
            return Err(ChangeError::Constraint { factor });
        }
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
            return Err(ChangeError::Marginalized { key: key.clone() });
        }
        let is_sealed = |key: &&Key| {
            self.model.variable(key.as_str()).is_some_and(|v| self.model.record(v).prior_count > 0)
        };
        if let Some(key) = factors.fixed().keys().find(is_sealed) {
            return Err(ChangeError::FixedLinearization { key: key.clone() });
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
                Some(tangent) => errors.extend(GraphError::unknown_directions(key, fixed, tangent)),
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
            // in addition to what is fixed
            let tangent = self.tangent(key.as_str()).unwrap_or_default();
            self.hold(key, self.held(key) | fixed.bits(tangent));
        }
        let ids = factors.factors().iter().zip(resolved).map(|(entry, resolved)| {
            let number = self.pending.numbers.unwrap_or(self.model.next_factor());
            self.pending.numbers = Some(number + 1);
            self.insert(number, entry.clone(), resolved, 1.0)
        });
        Ok(ids.collect())
    }

    /// Sets the time of variables that are pushed from now on. The unit is a second, and the origin is free.
    /// A window in seconds needs it before the first [`push`](Self::push). Takes effect at the next
    /// [`update`](Self::update), and is undone if that fails.
    ///
    /// # Errors
    /// If `time` is not finite or lies before the last one.
    pub fn set_time(&mut self, time: f64) -> Result<(), ChangeError> {
        self.schedule.check_time(self.pending.time, time)?;
        self.pending.time = Some(time);
        Ok(())
    }

    fn insert(&mut self, number: u32, entry: FactorEntry, resolved: Resolved, weight: f64) -> FactorId {
        self.pending.is_present.insert(number, Some(entry.clone()));
        let entry = Box::new(entry);
        self.pending.changes.push(Change::Insert { number, entry, resolved, weight, rejected: false });
        FactorId(number)
    }

    /// Removes factors. Takes effect at the next [`update`](Self::update). Variables that become undetermined
    /// are excluded until more factors determine them.
    ///
    /// # Errors
    /// If one of them does not exist. None is removed then.
    pub fn remove(&mut self, factors: &[FactorId]) -> Result<(), ChangeError> {
        let mut seen = std::collections::HashSet::new();
        if let Some(factor) = factors.iter().find(|f| self.entry(**f).is_none() || !seen.insert(**f)) {
            return Err(self.no_factor(*factor));
        }
        for FactorId(number) in factors {
            self.pending.is_present.insert(*number, None);
            self.pending.changes.push(Change::Remove { number: *number });
        }
        Ok(())
    }

    /// Replaces a factor by one with a different measurement, noise or loss. It keeps the id and the
    /// variables; its weight becomes 1. Takes effect at the next [`update`](Self::update).
    ///
    /// # Errors
    /// If there is no such factor, or `entry` does not fit or has different variables.
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

    /// Sets the weight of a factor, which multiplies its loss. 0 leaves the factor out. Takes effect at the
    /// next [`update`](Self::update).
    ///
    /// # Errors
    /// If there is no such factor, or the weight is negative or not finite.
    pub fn set_weight(&mut self, factor: FactorId, weight: f64) -> Result<(), ChangeError> {
        self.entry(factor).ok_or_else(|| self.no_factor(factor))?;
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(ChangeError::Weight { factor, weight });
        }
        self.pending.changes.push(Change::SetWeight { number: factor.0, weight });
        Ok(())
    }

    /// Holds a variable, or some directions of its tangent space, at the estimate. `Fixed::Whole(false)`
    /// frees it. Takes effect at the next [`update`](Self::update).
    ///
    /// # Errors
    /// If there is no such variable, or its tangent space has no such direction.
    pub fn fix(&mut self, key: &Key, fixed: &Fixed) -> Result<(), ChangeError> {
        let tangent = self.tangent(key.as_str()).ok_or_else(|| self.no_variable(key))?;
        let variable = self.model.variable(key.as_str());
        if variable.is_some_and(|v| self.model.record(v).prior_count > 0) {
            return Err(ChangeError::FixedLinearization { key: key.clone() });
        }
        let errors: Vec<_> = GraphError::unknown_directions(key, fixed, tangent).collect();
        if !errors.is_empty() {
            return Err(ChangeError::Graph(errors));
        }
        self.hold(key, fixed.bits(tangent));
        Ok(())
    }

    /// Returns the directions of a variable that are fixed as of the next update, as bits.
    fn held(&self, key: &Key) -> u32 {
        if let Some(new) = self.pending.variables.get(key) {
            return new.held;
        }
        let Some(known) = self.model.variable(key.as_str()) else { return 0 };
        let changed = self.pending.changes.iter().rev().find_map(|change| match change {
            Change::SetHeld { variable, held } if *variable == known => Some(*held),
            _ => None,
        });
        changed.unwrap_or(self.model.record(known).held)
    }

    fn hold(&mut self, key: &Key, held: u32) {
        if let Some(new) = self.pending.variables.get_mut(key) {
            new.held = held;
        } else if let Some(variable) = self.model.variable(key.as_str()) {
            self.pending.changes.push(Change::SetHeld { variable, held });
        }
    }

    /// Moves the estimate of a variable, so that its factors are linearized there. The next
    /// [`update`](Self::update) starts from it: use it if a change of the factors moves variables far, and the
    /// caller knows where to.
    ///
    /// # Errors
    /// If there is no such variable, if it has a different type or is not finite, or if a linear prior keeps its
    /// linearization point.
    pub fn move_to(&mut self, key: &str, value: &dyn Variable) -> Result<(), ChangeError> {
        let key = Key::from(key);
        let (_, expected) = self.find(key.as_str()).ok_or_else(|| self.no_variable(&key))?;
        if value.erased().type_id() != expected {
            let (expected, found) = (manifold_name(expected), value.typetag_name());
            return Err(ChangeError::Type { key, expected, found });
        }
        if !value.erased().is_finite() {
            return Err(ChangeError::Graph(vec![GraphError::NotFinite { key }]));
        }
        if self.model.variable(key.as_str()).is_some_and(|v| self.model.record(v).prior_count > 0) {
            return Err(ChangeError::FixedLinearization { key });
        }
        let value = value.erased().clone_box();
        match self.pending.variables.get_mut(&key) {
            Some(new) => new.value = value,
            None => _ = self.pending.moved.insert(key, value),
        }
        Ok(())
    }

    /// Returns a factor as of the next update; `None` if there is no such factor.
    pub fn entry(&self, factor: FactorId) -> Option<&FactorEntry> {
        match self.pending.is_present.get(&factor.0) {
            Some(pending) => pending.as_ref(),
            None => self.model.factor(factor.0)?.entry.as_ref(),
        }
    }

    /// Returns the weight of a factor, as of the last update; `None` if there is no such factor.
    pub fn weight(&self, factor: FactorId) -> Option<f64> {
        self.model.factor(factor.0).filter(|factor| factor.entry.is_some()).map(|factor| factor.weight)
    }

    /// Returns the number and the type of a variable. It may be pending.
    pub(crate) fn find(&self, key: &str) -> Option<(usize, TypeId)> {
        if let Some(variable) = self.model.variable(key) {
            return Some((variable as usize, self.model.type_of(variable)?));
        }
        let new = self.pending.variables.get(key)?;
        Some((new.at.number as usize, new.value.erased().type_id()))
    }

    fn tangent(&self, key: &str) -> Option<&'static [&'static str]> {
        match self.model.variable(key) {
            Some(variable) => Some(self.model.record(variable).tangent),
            None => self.pending.variables.get(key).map(|new| new.value.erased().tangent()),
        }
    }
}
