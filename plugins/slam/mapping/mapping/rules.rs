//! Semantic factors of a growing map: the factors from rules, each with its object.
//!
//! A stream applies the rules repeatedly while objects are added and removed. A batch applies them once to
//! all objects.
use super::measurements::{Measured, Measurements};
use super::{Decision, Rejection, as_candidate, object_key};
use crate::semantics::{Applied, Candidate, Connected, Judge, LeftOut, RuleError, Verdict};
use crate::settings::Settings;
use manifactor_graph::{Direction, FactorEntry, Key};
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use manifactor_smoother::FactorId;
use std::collections::{BTreeMap, HashMap};

/// All active semantic factors.
#[derive(Debug, Clone, Default)]
pub struct Ledger {
    factors: Vec<Ruled>,
    connected: Connected,
    left_out: BTreeMap<ObjectId, Vec<LeftOut>>,
}

/// A factor from a semantic rule.
#[derive(Debug, Clone)]
pub struct Ruled {
    /// Object that the rule was applied to.
    owner: ObjectId,
    applied: Applied,
    /// The factor itself.
    pub entry: FactorEntry,
    /// Its id in the smoother, once it is added.
    id: Option<FactorId>,
}

impl Ledger {
    /// Applies the rules to some of all objects, and returns the new factors.
    ///
    /// # Errors
    /// If a rule cannot be applied.
    pub fn ask(
        &mut self,
        about: &[ObjectId],
        all: &[Candidate],
        settings: &Settings,
        up: Option<Direction>,
    ) -> Result<&mut [Ruled], RuleError> {
        let before = self.factors.len();
        let connected = std::mem::take(&mut self.connected);
        let mut judge = Judge::new(&settings.semantics, &settings.aliases, up, all.to_vec(), connected);
        let by_key: HashMap<&Key, &Candidate> =
            all.iter().map(|candidate| (&candidate.key, candidate)).collect();
        for owner in about {
            let Some(candidate) = by_key.get(&object_key(*owner)) else { continue };
            let Verdict { entries, applied, left_out } = judge.judge(candidate)?;
            // an object that is new to the rules has no earlier factors
            let first = if self.left_out.contains_key(owner) { 0 } else { self.factors.len() };
            self.left_out.insert(*owner, left_out);
            for (entry, applied) in entries.into_iter().zip(applied) {
                let mut of_owner = self.factors[first..].iter().filter(|factor| factor.owner == *owner);
                if !of_owner.any(|f| f.applied.rule == applied.rule && f.applied.keys == applied.keys) {
                    self.factors.push(Ruled { owner: *owner, applied, entry, id: None });
                }
            }
        }
        self.connected = judge.into_connected();
        Ok(&mut self.factors[before..])
    }

    /// Sets the smoother ids of factors without one, in their order.
    pub fn name(&mut self, ids: Vec<FactorId>) {
        for (factor, id) in self.factors.iter_mut().filter(|factor| factor.id.is_none()).zip(ids) {
            factor.id = Some(id);
        }
    }

    /// Removes the factors of some objects. Returns their smoother ids, and the objects that the rules were
    /// applied to.
    pub fn revoke(&mut self, of: impl Fn(&Key) -> bool) -> (Vec<FactorId>, Vec<ObjectId>) {
        let (mut ids, mut owners) = (vec![], vec![]);
        let connected = &mut self.connected;
        self.factors.retain(|factor| {
            let Applied { rule, keys, .. } = &factor.applied;
            if !keys.iter().any(&of) {
                return true;
            }
            connected.retain(|(place, objects)| {
                place + 1 != *rule || !objects.iter().all(|key| keys.contains(key))
            });
            ids.extend(factor.id);
            owners.push(factor.owner);
            false
        });
        owners.sort_unstable();
        owners.dedup();
        (ids, owners)
    }

    /// Makes an object new to the rules again.
    pub fn forget(&mut self, object: ObjectId) {
        self.left_out.remove(&object);
    }

    /// Returns the result of the rules for each object.
    fn verdicts(self) -> BTreeMap<ObjectId, Verdict> {
        let mut verdicts: BTreeMap<ObjectId, Verdict> = BTreeMap::new();
        for (owner, left_out) in self.left_out {
            verdicts.entry(owner).or_default().left_out = left_out;
        }
        for Ruled { owner, entry, applied, .. } in self.factors {
            let verdict = verdicts.entry(owner).or_default();
            verdict.entries.push(entry);
            verdict.applied.push(applied);
        }
        verdicts
    }

    /// Returns the decisions for a batch. Applies the rules to the objects that are new to them.
    ///
    /// # Errors
    /// If a rule cannot be applied.
    pub fn complete(
        mut self,
        measurements: &Measurements,
        starts: Vec<Result<DualQuadric, Rejection>>,
        settings: &Settings,
        up: Option<Direction>,
    ) -> Result<Vec<Decision>, RuleError> {
        let all = measurements.objects.iter().zip(&starts);
        let candidates =
            all.clone().filter_map(|(measured, start)| Some(as_candidate(measured, *start.as_ref().ok()?)));
        let new = all.filter(|(measured, start)| start.is_ok() && !self.left_out.contains_key(&measured.id));
        let new: Vec<ObjectId> = new.map(|(measured, _)| measured.id).collect();
        self.ask(&new, &candidates.collect::<Vec<_>>(), settings, up)?;
        let mut verdicts = self.verdicts();
        let decide = |(measured, start): (&Measured, _)| {
            let verdict = verdicts.remove(&measured.id).unwrap_or_default();
            Decision { start, verdict }
        };
        Ok(measurements.objects.iter().zip(starts).map(decide).collect())
    }
}
