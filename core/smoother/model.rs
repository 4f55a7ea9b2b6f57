//! The variables at their linearization points, and the factors with their terms of H and g.
mod blocks;
mod counting;
mod evaluation;
mod factors;
mod marginal_prior;
mod regions;
mod undetermined;
mod variables;

use crate::elimination_tree::Couplings;
use crate::removed::Removed;
use crate::report::SharedList;
pub(crate) use blocks::Blocks;
pub(crate) use marginal_prior::Prior;
pub(crate) use variables::{NewNumber, Reserved};

use factors::Factors;
use manifactor_graph::batch::{Batches, Member};
use manifactor_graph::column::{Columns, FIXED};
use manifactor_graph::normal_equations::Slot;
use manifactor_graph::{FactorEntry, Key, Resolved, Variable, VariableIndices};
use regions::{Region, Regions};
use smallvec::SmallVec;
use std::any::TypeId;
use std::collections::{BTreeSet, HashMap};
use undetermined::UndeterminedVariables;

/// A sum that is not finite although its terms are. The number is a variable in the sum.
#[derive(Debug)]
pub(crate) struct Overflow(pub u32);

/// A variable of the smoother.
#[derive(Debug, Clone)]
pub(crate) struct VariableRecord {
    pub key: Key,
    /// Rank in the order of insertion, among all variables (`rank`) and within its type (`ordinal`).
    /// `is_present` is false after removal.
    pub rank: u64,
    pub ordinal: u64,
    pub is_present: bool,
    /// Column of its type, and index in that column.
    pub column: u32,
    pub index: u32,
    pub tangent: &'static [&'static str],
    /// One bit per held direction.
    pub held: u32,
    /// Number of linear priors that contain it. If there are any, it keeps its linearization point.
    pub prior_count: u32,
}

impl VariableRecord {
    /// Returns whether all directions are held.
    pub(crate) fn is_held(&self) -> bool {
        self.held.count_ones() as usize == self.tangent.len()
    }
}

/// A factor of the smoother, or a linear prior that replaces the factors of marginalized variables.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    /// `None` for a linear prior. It is in no batch and has only a region.
    pub entry: Option<FactorEntry>,
    /// In the order of its residual's arguments.
    variables: VariableIndices,
    /// Ascending, each with its first scalar among the factor's scalars.
    members: SmallVec<[(u32, u32); 2]>,
    batch: u32,
    index: u32,
    /// Index of its region.
    region: u32,
    pub weight: f64,
    /// Share of the weight that counts during a trial of outliers.
    pub share: f64,
    /// Cost of a prior at the linearization points.
    pub constant: f64,
}

impl Factor {
    fn prior(members: SmallVec<[(u32, u32); 2]>, region: u32, constant: f64) -> Self {
        let variables = VariableIndices::new();
        Self {
            entry: None,
            variables,
            members,
            batch: 0,
            index: 0,
            region,
            weight: 1.0,
            share: 1.0,
            constant,
        }
    }
    /// Returns its resolved variables and noise; `None` if it has no entry, or its noise has no whitener.
    pub(crate) fn resolved(&self) -> Option<Resolved> {
        let entry = self.entry.as_ref()?;
        let rows = entry.factor.erased().signature().rows.unwrap_or(0);
        let whitener = entry.noise.whitener(rows).ok()?;
        Some(Resolved { variables: self.variables.clone(), whitener })
    }
    /// Returns its variables, ascending.
    pub(crate) fn variables(&self) -> impl Iterator<Item = u32> {
        self.members.iter().map(|(v, _)| *v)
    }
}

/// All variables and factors, with insertion and removal.
#[derive(Default)]
pub(crate) struct Model {
    records: Vec<VariableRecord>,
    numbers: HashMap<Key, u32, foldhash::fast::RandomState>,
    /// Numbers of removed variables, by column.
    unused: Vec<Vec<u32>>,
    /// Number of variables ever added.
    added: u64,
    /// Number of variables ever added, by column.
    ordinals: Vec<u64>,
    /// Linearization points, and trial points at which factors are evaluated. Outside of an update both are
    /// equal.
    points: Columns,
    pub trial: Columns,
    factors: Factors,
    regions: Regions,
    batches: Batches,
    pub blocks: Blocks,
    /// Scratch lists of factors to evaluate, by batch.
    listed: Vec<Vec<u32>>,
    /// Number of factors with a robust loss.
    robust: usize,
    /// Factors rejected as outliers. They couple no variables and are in no sum.
    rejected: BTreeSet<u32>,
    undetermined: UndeterminedVariables,
    /// Variables and factors that were removed.
    pub removed: Removed,
}

impl Couplings for Model {
    fn variables(&self) -> usize {
        self.records.len()
    }
    fn dim(&self, variable: u32) -> usize {
        self.blocks.dim(variable)
    }
    fn coupled(&self, variable: u32) -> impl Iterator<Item = u32> {
        self.blocks.coupled(variable).iter().map(|c| c.other)
    }
}

impl Model {
    /// Returns the number of the next new factor.
    pub(crate) fn next_factor(&self) -> u32 {
        self.factors.next
    }
    /// Skips numbers that removed factors had.
    pub(crate) fn skip_to(&mut self, next: u32) {
        self.factors.next = self.factors.next.max(next);
    }
    pub(crate) fn factor(&self, factor: u32) -> Option<&Factor> {
        self.factors.get(factor)
    }
    /// Returns all factors with their numbers, without linear priors.
    pub(crate) fn all_factors(&self) -> impl Iterator<Item = (u32, &Factor, &FactorEntry)> {
        self.factors.iter().filter_map(|(f, factor)| Some((f, factor, factor.entry.as_ref()?)))
    }
    pub(crate) fn variable(&self, key: &str) -> Option<u32> {
        self.numbers.get(key).copied()
    }
    pub(crate) fn record(&self, variable: u32) -> &VariableRecord {
        &self.records[variable as usize]
    }
    pub(crate) fn record_mut(&mut self, variable: u32) -> &mut VariableRecord {
        &mut self.records[variable as usize]
    }
    /// Returns whether a variable is undetermined: outside of the tree until factors determine it.
    pub(crate) fn is_undetermined(&self, variable: u32) -> bool {
        self.undetermined.contains(variable)
    }
    /// Marks a variable as undetermined or determined. Returns whether it was undetermined.
    pub(crate) fn set_undetermined(&mut self, variable: u32, is_undetermined: bool) -> bool {
        self.undetermined.set(variable, is_undetermined)
    }
    /// Returns the keys of all undetermined variables; `None` if they are unchanged since the last call.
    pub(crate) fn changed_undetermined_keys(&mut self) -> Option<SharedList<Key>> {
        let has_changed = self.undetermined.has_changed();
        has_changed.then(|| self.undetermined.iter().map(|v| self.records[v as usize].key.clone()).collect())
    }
    /// Returns whether a variable is solved for.
    pub(crate) fn is_in_tree(&self, variable: u32) -> bool {
        let place = self.record(variable);
        place.is_present && !self.is_undetermined(variable) && !place.is_held()
    }
    /// Returns the number of present variables.
    pub(crate) fn present(&self) -> usize {
        self.numbers.len()
    }
    /// Returns the type of a variable.
    pub(crate) fn type_of(&self, variable: u32) -> Option<TypeId> {
        self.point(variable).map(|point| point.erased().type_id())
    }
    /// Returns the linearization point of a variable.
    pub(crate) fn point(&self, variable: u32) -> Option<Box<dyn Variable>> {
        let place = self.record(variable);
        self.points.column(place.column as usize).get(place.index as usize)
    }

    /// Inserts a factor under an unused number. It is not linearized yet.
    pub(crate) fn insert(&mut self, number: u32, entry: &FactorEntry, resolved: &Resolved, weight: f64) {
        let variables = resolved.variables.clone();
        let mut members: SmallVec<[(u32, u32); 2]> = variables.iter().map(|v| (*v, 0)).collect();
        members.sort_unstable();
        let mut scalars = 0;
        for (v, at) in &mut members {
            *at = scalars;
            scalars += self.blocks.dim(*v) as u32;
        }
        let place = self.regions.acquire(scalars);
        let region = self.regions[place];
        self.blocks.connect(number, place, &members);
        let batch = self.batches.place(entry.factor.erased(), &resolved.whitener, entry.loss.as_deref());
        let residual = entry;
        let entry = entry.clone();
        let factor = Factor {
            variables,
            batch: batch as u32,
            weight,
            entry: Some(entry),
            ..Factor::prior(members, place, 0.0)
        };
        let index: SmallVec<[u32; 4]> =
            factor.variables.iter().map(|v| self.records[*v as usize].index).collect();
        let (starts, held) = self.starts(&factor, region);
        let slots = self.slots(&factor, region);
        let to = &mut self.batches.as_mut_slice()[batch];
        to.push(&Member {
            entry: number as usize,
            factor: residual.factor.erased().as_any(),
            index: &index,
            starts: &starts,
            fixed: &held,
            slots: &slots,
            whitener: &resolved.whitener,
            loss: residual.loss.as_deref(),
        });
        self.robust += usize::from(residual.loss.is_some());
        let index = to.len() - 1;
        if weight != 1.0 {
            to.set_weight(index, weight);
        }
        self.factors.insert(number, Factor { index: index as u32, ..factor });
    }

    /// Returns, for each variable of the factor's residual, its first scalar in the gradient and its held
    /// directions.
    fn starts(&self, factor: &Factor, region: Region) -> (SmallVec<[u32; 4]>, SmallVec<[u32; 4]>) {
        let one = |v: &u32| {
            let place = &self.records[*v as usize];
            let start = if place.is_held() { FIXED } else { (region.g as u32) + factor.at(*v) };
            (start, if place.is_held() { 0 } else { place.held })
        };
        factor.variables.iter().map(one).unzip()
    }

    /// Returns the position of the block of each pair of the factor's variables.
    fn slots(&self, factor: &Factor, region: Region) -> SmallVec<[Slot; 3]> {
        let mut slots = SmallVec::new();
        for (n, &a) in factor.variables.iter().enumerate() {
            for &b in &factor.variables[..=n] {
                let (lower, higher) = (factor.at(a.min(b)), factor.at(a.max(b)));
                let column = lower as usize;
                let at = region.column(column) + (higher - lower) as usize;
                slots.push(Slot { at, stride: region.scalars - 1 - lower, swapped: a < b });
            }
        }
        slots
    }

    /// Removes a factor.
    pub(crate) fn remove(&mut self, number: u32) -> Option<Factor> {
        let factor = self.factors.remove(number)?;
        if !self.rejected.remove(&number) {
            self.blocks.disconnect(number, &factor.members);
        }
        self.regions.release(factor.region);
        if factor.entry.is_none() {
            factor.members.iter().for_each(|(v, _)| self.records[*v as usize].prior_count -= 1);
            return Some(factor);
        }
        self.robust -= usize::from(factor.is_robust());
        let batch = &mut self.batches.as_mut_slice()[factor.batch as usize];
        if let Some(moved) = batch.remove(factor.index as usize)
            && let Some(moved) = self.factors.get_mut(moved as u32)
        {
            moved.index = factor.index;
        }
        Some(factor)
    }
}

impl VariableRecord {
    fn in_columns(&self) -> (usize, usize) {
        (self.column as usize, self.index as usize)
    }
}

impl Factor {
    /// Returns whether it has a robust loss.
    pub(super) fn is_robust(&self) -> bool {
        self.entry.as_ref().is_some_and(|entry| entry.loss.is_some())
    }
    /// Returns the first scalar of a variable among the factor's scalars.
    fn at(&self, variable: u32) -> u32 {
        self.members.iter().find(|(v, _)| *v == variable).map_or(0, |(_, at)| *at)
    }
}
