//! What is estimated, and from what: variables at their linearization points, and factors with their parts of H and g.
mod blocks;
mod counting;
mod evaluation;
mod factors;
mod parked;
mod regions;
mod sealing;
mod variables;

use crate::elimination_tree::Couplings;
use crate::gone::Removed;
use crate::report::Shared;
pub(crate) use blocks::Blocks;
pub(crate) use sealing::Prior;
pub(crate) use variables::{NewNumber, Reserved};

use factors::Factors;
use manifactor_graph::batch::{Batches, Member};
use manifactor_graph::column::{Columns, FIXED};
use manifactor_graph::normal_equations::Slot;
use manifactor_graph::{FactorEntry, Key, Resolved, Variable, VariableIndices};
use parked::Parked;
use regions::{Region, Regions};
use smallvec::SmallVec;
use std::any::TypeId;
use std::collections::{BTreeSet, HashMap};

/// A sum that is not finite, though its terms are: at this variable.
#[derive(Debug)]
pub(crate) struct Overflow(pub u32);

/// A variable of a session.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    pub key: Key,
    /// How many came before it, and how many of its type; and whether it is there still.
    pub born: u64,
    pub ordinal: u64,
    pub is_there: bool,
    /// Which column, and where in it.
    pub column: u32,
    pub index: u32,
    pub tangent: &'static [&'static str],
    /// A bit for each direction that is held.
    pub held: u32,
    /// Linear priors that it is part of: it keeps its linearization point, as they do.
    pub sealed: u32,
}

impl Place {
    /// Returns whether all of it is held.
    pub(crate) fn is_held(&self) -> bool {
        self.held.count_ones() as usize == self.tangent.len()
    }
}

/// A factor of a session, or a linear prior that variables have left behind.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    /// `None` for a prior, which is in no batch: its region is all that there is.
    pub entry: Option<FactorEntry>,
    /// In the order of its residual.
    variables: VariableIndices,
    /// Ascending, each with where it begins among the factor's scalars.
    members: SmallVec<[(u32, u32); 2]>,
    batch: u32,
    index: u32,
    /// Where its region is.
    region: u32,
    pub weight: f64,
    /// How much of that counts while it is in doubt.
    pub share: f64,
    /// What a prior costs at the linearization points.
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
    /// Its variables and its noise, as they were looked up; `None` where that is not possible any more.
    pub(crate) fn resolved(&self) -> Option<Resolved> {
        let entry = self.entry.as_ref()?;
        let rows = entry.factor.erased().signature().rows.unwrap_or(0);
        let whitener = entry.noise.whitener(rows).ok()?;
        Some(Resolved { variables: self.variables.clone(), whitener })
    }
    /// Its variables, ascending.
    pub(crate) fn variables(&self) -> impl Iterator<Item = u32> {
        self.members.iter().map(|(v, _)| *v)
    }
}

/// Variables and factors, which come and go.
#[derive(Default)]
pub(crate) struct Model {
    places: Vec<Place>,
    numbers: HashMap<Key, u32, foldhash::fast::RandomState>,
    /// By column, numbers of variables that are gone.
    unused: Vec<Vec<u32>>,
    born: u64,
    /// By column, how many variables have come.
    ordinals: Vec<u64>,
    /// Linearization points; and where variables are about to be linearized: the same, but during an update.
    points: Columns,
    pub trial: Columns,
    factors: Factors,
    regions: Regions,
    batches: Batches,
    pub blocks: Blocks,
    /// By batch, factors that are about to be evaluated.
    listed: Vec<Vec<u32>>,
    /// How many factors have a loss.
    robust: usize,
    /// Factors that are left out as outliers: they couple nothing, and are in no sum.
    rejected: BTreeSet<u32>,
    parked: Parked,
    /// Variables and factors that were removed.
    pub removed: Removed,
}

impl Couplings for Model {
    fn variables(&self) -> usize {
        self.places.len()
    }
    fn dim(&self, variable: u32) -> usize {
        self.blocks.dim(variable)
    }
    fn coupled(&self, variable: u32) -> impl Iterator<Item = u32> {
        self.blocks.coupled(variable).iter().map(|c| c.other)
    }
}

impl Model {
    /// The number of the next new factor.
    pub(crate) fn next_factor(&self) -> u32 {
        self.factors.next
    }
    /// Leaves numbers out: they were those of factors that are gone.
    pub(crate) fn skip_to(&mut self, next: u32) {
        self.factors.next = self.factors.next.max(next);
    }
    pub(crate) fn factor(&self, factor: u32) -> Option<&Factor> {
        self.factors.get(factor)
    }
    /// The factors that are there, with their numbers; no priors.
    pub(crate) fn all_factors(&self) -> impl Iterator<Item = (u32, &Factor, &FactorEntry)> {
        self.factors.iter().filter_map(|(f, factor)| Some((f, factor, factor.entry.as_ref()?)))
    }
    pub(crate) fn variable(&self, key: &str) -> Option<u32> {
        self.numbers.get(key).copied()
    }
    pub(crate) fn place(&self, variable: u32) -> &Place {
        &self.places[variable as usize]
    }
    pub(crate) fn place_mut(&mut self, variable: u32) -> &mut Place {
        &mut self.places[variable as usize]
    }
    /// Returns whether a variable waits, outside of the tree, for factors that determine it.
    pub(crate) fn is_parked(&self, variable: u32) -> bool {
        self.parked.contains(variable)
    }
    /// Parks or unparks a variable. Returns whether it was parked.
    pub(crate) fn set_parked(&mut self, variable: u32, is_parked: bool) -> bool {
        self.parked.set(variable, is_parked)
    }
    /// The keys of all parked variables; `None` if these are the same as at the last call.
    pub(crate) fn changed_parked_keys(&mut self) -> Option<Shared<Key>> {
        let has_changed = self.parked.has_changed();
        has_changed.then(|| self.parked.iter().map(|v| self.places[v as usize].key.clone()).collect())
    }
    /// Returns whether a variable is to be solved for.
    pub(crate) fn is_in_tree(&self, variable: u32) -> bool {
        let place = self.place(variable);
        place.is_there && !self.is_parked(variable) && !place.is_held()
    }
    /// Number of variables that are there.
    pub(crate) fn present(&self) -> usize {
        self.numbers.len()
    }
    /// The type of a variable.
    pub(crate) fn type_of(&self, variable: u32) -> Option<TypeId> {
        self.point(variable).map(|point| point.erased().type_id())
    }
    /// A variable's linearization point.
    pub(crate) fn point(&self, variable: u32) -> Option<Box<dyn Variable>> {
        let place = self.place(variable);
        self.points.column(place.column as usize).get(place.index as usize)
    }

    /// Puts a factor in, under a number that is unused. It is not linearized yet.
    pub(crate) fn insert(&mut self, number: u32, entry: &FactorEntry, resolved: &Resolved, weight: f64) {
        let variables = resolved.variables.clone();
        let mut members: SmallVec<[(u32, u32); 2]> = variables.iter().map(|v| (*v, 0)).collect();
        members.sort_unstable();
        let mut scalars = 0;
        for (v, at) in &mut members {
            *at = scalars;
            scalars += self.blocks.dim(*v) as u32;
        }
        let place = self.regions.take(scalars);
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
            factor.variables.iter().map(|v| self.places[*v as usize].index).collect();
        let (starts, held) = self.starts(&factor, region);
        let slots = self.slots(&factor, region);
        let to = &mut self.batches.as_mut_slice()[batch];
        to.push(&Member {
            entry: number as usize,
            factor: residual.factor.erased().as_any(),
            index: &index,
            starts: &starts,
            held: &held,
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

    /// By variable of a factor's residual: where it begins in the gradient, and what is held of it.
    fn starts(&self, factor: &Factor, region: Region) -> (SmallVec<[u32; 4]>, SmallVec<[u32; 4]>) {
        let one = |v: &u32| {
            let place = &self.places[*v as usize];
            let start = if place.is_held() { FIXED } else { (region.g as u32) + factor.at(*v) };
            (start, if place.is_held() { 0 } else { place.held })
        };
        factor.variables.iter().map(one).unzip()
    }

    /// By pair of a factor's variables, where its block is.
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

    /// Takes a factor out.
    pub(crate) fn remove(&mut self, number: u32) -> Option<Factor> {
        let factor = self.factors.remove(number)?;
        if !self.rejected.remove(&number) {
            self.blocks.disconnect(number, &factor.members);
        }
        self.regions.give(factor.region);
        if factor.entry.is_none() {
            factor.members.iter().for_each(|(v, _)| self.places[*v as usize].sealed -= 1);
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

impl Place {
    fn in_columns(&self) -> (usize, usize) {
        (self.column as usize, self.index as usize)
    }
}

impl Factor {
    /// Returns whether it has a loss.
    pub(super) fn is_robust(&self) -> bool {
        self.entry.as_ref().is_some_and(|entry| entry.loss.is_some())
    }
    /// Where a variable begins among the factor's scalars.
    fn at(&self, variable: u32) -> u32 {
        self.members.iter().find(|(v, _)| *v == variable).map_or(0, |(_, at)| *at)
    }
}
