//! Semantic factors of a growing map: the factors from rules, each with its object.
//!
//! A stream applies the rules repeatedly while objects are added and removed. A batch applies them once to
//! all objects.
use super::measurements::{Measurements, ObjectMeasurements};
use super::{ObjectDecision, Rejection, as_candidate, object_key};
use crate::semantics::{
    AppliedRule, ConnectedKeys, RuleCandidate, RuleError, RuleEvaluator, RuleVerdict, SkippedRule,
};
use crate::settings::RunSettings;
use manifactor_graph::{Direction, FactorEntry, Key};
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use manifactor_smoother::FactorId;
use std::collections::{BTreeMap, HashMap};

/// All active semantic factors.
#[derive(Debug, Clone, Default)]
pub struct SemanticFactors {
    factors: Vec<RuledFactor>,
    connected: ConnectedKeys,
    left_out: BTreeMap<ObjectId, Vec<SkippedRule>>,
}

/// A factor from a semantic rule.
#[derive(Debug, Clone)]
pub struct RuledFactor {
    /// Object that the rule was applied to.
    owner: ObjectId,
    applied: AppliedRule,
    /// The factor itself.
    pub entry: FactorEntry,
    /// Its id in the smoother, once it is added.
    id: Option<FactorId>,
}

impl SemanticFactors {
    /// Applies the rules to some of all objects, and returns the new factors.
    ///
    /// # Errors
    /// If a rule cannot be applied.
    pub fn apply_rules(
        &mut self,
        about: &[ObjectId],
        all: &[RuleCandidate],
        settings: &RunSettings,
        up: Option<Direction>,
    ) -> Result<&mut [RuledFactor], RuleError> {
        let before = self.factors.len();
        let connected = std::mem::take(&mut self.connected);
        let mut judge =
            RuleEvaluator::new(&settings.semantics, &settings.aliases, up, all.to_vec(), connected);
        let by_key: HashMap<&Key, &RuleCandidate> =
            all.iter().map(|candidate| (&candidate.key, candidate)).collect();
        for owner in about {
            let Some(candidate) = by_key.get(&object_key(*owner)) else { continue };
            let RuleVerdict { entries, applied, left_out } = judge.evaluate_object(candidate)?;
            // an object that is new to the rules has no earlier factors
            let first = if self.left_out.contains_key(owner) { 0 } else { self.factors.len() };
            self.left_out.insert(*owner, left_out);
            for (entry, applied) in entries.into_iter().zip(applied) {
                let mut of_owner = self.factors[first..].iter().filter(|factor| factor.owner == *owner);
                if !of_owner.any(|f| f.applied.rule == applied.rule && f.applied.keys == applied.keys) {
                    self.factors.push(RuledFactor { owner: *owner, applied, entry, id: None });
                }
            }
        }
        self.connected = judge.into_connected();
        Ok(&mut self.factors[before..])
    }

    /// Sets the smoother ids of factors without one, in their order.
    pub fn assign_ids(&mut self, ids: Vec<FactorId>) {
        for (factor, id) in self.factors.iter_mut().filter(|factor| factor.id.is_none()).zip(ids) {
            factor.id = Some(id);
        }
    }

    /// Removes the factors of some objects. Returns their smoother ids, and the objects that the rules were
    /// applied to.
    pub fn remove_factors(&mut self, of: impl Fn(&Key) -> bool) -> (Vec<FactorId>, Vec<ObjectId>) {
        let (mut ids, mut owners) = (vec![], vec![]);
        let connected = &mut self.connected;
        self.factors.retain(|factor| {
            let AppliedRule { rule, keys, .. } = &factor.applied;
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
    pub fn forget_object(&mut self, object: ObjectId) {
        self.left_out.remove(&object);
    }

    /// Returns the result of the rules for each object.
    fn verdicts(self) -> BTreeMap<ObjectId, RuleVerdict> {
        let mut verdicts: BTreeMap<ObjectId, RuleVerdict> = BTreeMap::new();
        for (owner, left_out) in self.left_out {
            verdicts.entry(owner).or_default().left_out = left_out;
        }
        for RuledFactor { owner, entry, applied, .. } in self.factors {
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
    pub fn complete_decisions(
        mut self,
        measurements: &Measurements,
        starts: Vec<Result<DualQuadric, Rejection>>,
        settings: &RunSettings,
        up: Option<Direction>,
    ) -> Result<Vec<ObjectDecision>, RuleError> {
        let all = measurements.objects.iter().zip(&starts);
        let candidates =
            all.clone().filter_map(|(measured, start)| Some(as_candidate(measured, *start.as_ref().ok()?)));
        let new = all.filter(|(measured, start)| start.is_ok() && !self.left_out.contains_key(&measured.id));
        let new: Vec<ObjectId> = new.map(|(measured, _)| measured.id).collect();
        self.apply_rules(&new, &candidates.collect::<Vec<_>>(), settings, up)?;
        let mut verdicts = self.verdicts();
        let decide = |(measured, start): (&ObjectMeasurements, _)| {
            let verdict = verdicts.remove(&measured.id).unwrap_or_default();
            ObjectDecision { start, verdict }
        };
        Ok(measurements.objects.iter().zip(starts).map(decide).collect())
    }
}
