//! Blocks of H and g: sums over the regions of the factors, recomputed if a factor has changed.
//!
//! Terms are added in the order of the factor numbers, so that a sum does not depend on the history.
use super::regions::Regions;
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// A neighbour that shares a factor, and the index of the pair with their block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coupling {
    pub other: u32,
    pub pair: u32,
}

/// A factor of a variable, its region, and the variable's first scalar in the region.
#[derive(Debug, Clone, Copy)]
struct Part {
    factor: u32,
    region: u32,
    at: u32,
}

/// A factor of a pair of variables, its region, and the first scalar of each variable in the region.
#[derive(Debug, Clone, Copy)]
struct Shared {
    factor: u32,
    region: u32,
    lower: u32,
    higher: u32,
}

/// The block of two variables. Its rows belong to the higher variable number, its columns to the lower.
#[derive(Debug, Clone, Default)]
struct Pair {
    lower: u32,
    higher: u32,
    at: usize,
    entries: u32,
    /// By ascending factor number.
    factors: SmallVec<[Shared; 2]>,
    is_dirty: bool,
}

#[derive(Debug, Clone, Default)]
struct Variable {
    dim: u32,
    /// First scalar, in the order of the variables.
    start: usize,
    diagonal: usize,
    /// One bit per held direction.
    held: u32,
    /// Damping, added to the diagonal of its block so that its steps become shorter.
    damping: f64,
    factors: Vec<Part>,
    coupled: Vec<Coupling>,
    is_dirty: bool,
}

/// Blocks of all variables and pairs.
#[derive(Debug, Default)]
pub(crate) struct Blocks {
    variables: Vec<Variable>,
    pairs: Vec<Pair>,
    /// Free pairs, by number of entries.
    unused: BTreeMap<u32, Vec<u32>>,
    /// Column-major. Diagonal blocks use only the lower triangle.
    diagonals: Vec<f64>,
    off_diagonals: Vec<f64>,
    /// By scalar: the gradient, and √Hᵢᵢ, the precision of the surrounding factors.
    gradient: Vec<f64>,
    precision: Vec<f64>,
    dirty: Vec<u32>,
    dirty_pairs: Vec<u32>,
}

impl Blocks {
    /// Appends a variable.
    pub(crate) fn push(&mut self, dim: usize, held: u32) {
        let (start, diagonal) = (self.gradient.len(), self.diagonals.len());
        self.diagonals.resize(diagonal + dim * dim, 0.0);
        self.gradient.resize(start + dim, 0.0);
        self.precision.resize(start + dim, 0.0);
        let dim = dim as u32;
        self.variables.push(Variable { dim, start, diagonal, held, ..Variable::default() });
    }

    /// Removes all variables after the first `variables` ones. The removed ones must have no factors.
    pub(crate) fn truncate(&mut self, variables: usize) {
        let Some(first) = self.variables.get(variables) else { return };
        self.gradient.truncate(first.start);
        self.precision.truncate(first.start);
        self.diagonals.truncate(first.diagonal);
        self.variables.truncate(variables);
        self.dirty.retain(|v| (*v as usize) < variables);
    }

    /// Returns the number of scalars of all variables.
    pub(crate) fn scalars(&self) -> usize {
        self.gradient.len()
    }
    pub(crate) fn dim(&self, variable: u32) -> usize {
        self.variables[variable as usize].dim as usize
    }
    /// Returns the scalars of a variable.
    #[inline(always)]
    pub(crate) fn range(&self, variable: u32) -> std::ops::Range<usize> {
        let v = &self.variables[variable as usize];
        v.start..v.start + v.dim as usize
    }
    #[inline(always)]
    pub(crate) fn gradient(&self, variable: u32) -> &[f64] {
        &self.gradient[self.range(variable)]
    }
    /// Returns √Hᵢᵢ by scalar.
    #[inline(always)]
    pub(crate) fn precision(&self, variable: u32) -> &[f64] {
        &self.precision[self.range(variable)]
    }
    /// Returns the diagonal block of a variable. Only its lower triangle is used.
    #[inline(always)]
    pub(crate) fn diagonal(&self, variable: u32) -> &[f64] {
        let v = &self.variables[variable as usize];
        &self.diagonals[v.diagonal..v.diagonal + (v.dim * v.dim) as usize]
    }
    /// Returns the block of a pair, with the rows of the higher variable.
    #[inline(always)]
    pub(crate) fn block(&self, pair: u32) -> &[f64] {
        let pair = &self.pairs[pair as usize];
        &self.off_diagonals[pair.at..pair.at + pair.entries as usize]
    }
    pub(crate) fn coupled(&self, variable: u32) -> &[Coupling] {
        &self.variables[variable as usize].coupled
    }
    pub(crate) fn factors(&self, variable: u32) -> impl Iterator<Item = u32> {
        self.variables[variable as usize].factors.iter().map(|part| part.factor)
    }
    pub(crate) fn set_held(&mut self, variable: u32, held: u32) {
        self.variables[variable as usize].held = held;
        self.mark(variable);
    }

    /// Sets the damping of a variable, in units of H. 0 disables it.
    pub(crate) fn damp(&mut self, variable: u32, damping: f64) {
        self.variables[variable as usize].damping = damping;
        self.mark(variable);
    }
    pub(crate) fn damping(&self, variable: u32) -> f64 {
        self.variables[variable as usize].damping
    }

    fn pair(&self, a: u32, b: u32) -> Option<u32> {
        // search the shorter list: an object has many more neighbours than a pose that observes it
        let (a, b) = if self.coupled(a).len() <= self.coupled(b).len() { (a, b) } else { (b, a) };
        self.coupled(a).iter().find(|c| c.other == b).map(|c| c.pair)
    }

    fn new_pair(&mut self, lower: u32, higher: u32) -> u32 {
        let entries = self.dim(lower) * self.dim(higher);
        let pair = self.unused.get_mut(&(entries as u32)).and_then(Vec::pop).unwrap_or_else(|| {
            let at = self.off_diagonals.len();
            self.pairs.push(Pair { at, entries: entries as u32, ..Pair::default() });
            self.off_diagonals.resize(at + entries, 0.0);
            self.pairs.len() as u32 - 1
        });
        let found = &mut self.pairs[pair as usize];
        (found.lower, found.higher) = (lower, higher);
        self.variables[lower as usize].coupled.push(Coupling { other: higher, pair });
        self.variables[higher as usize].coupled.push(Coupling { other: lower, pair });
        pair
    }

    /// Adds a factor of these variables. They ascend, each with its first scalar among the factor's scalars.
    pub(crate) fn connect(&mut self, factor: u32, region: u32, members: &[(u32, u32)]) {
        for (n, &(v, at)) in members.iter().enumerate() {
            let factors = &mut self.variables[v as usize].factors;
            let place = factors.partition_point(|part| part.factor < factor);
            factors.insert(place, Part { factor, region, at });
            for &(u, at_lower) in &members[..n] {
                let pair = self.pair(u, v).unwrap_or_else(|| self.new_pair(u, v));
                let factors = &mut self.pairs[pair as usize].factors;
                let place = factors.partition_point(|part| part.factor < factor);
                factors.insert(place, Shared { factor, region, lower: at_lower, higher: at });
            }
        }
        self.mark_factor(members);
    }

    /// Removes a factor.
    pub(crate) fn disconnect(&mut self, factor: u32, members: &[(u32, u32)]) {
        self.mark_factor(members);
        for (n, &(v, _)) in members.iter().enumerate() {
            self.variables[v as usize].factors.retain(|part| part.factor != factor);
            for &(u, _) in &members[..n] {
                let Some(pair) = self.pair(u, v) else { continue };
                let factors = &mut self.pairs[pair as usize].factors;
                factors.retain(|part| part.factor != factor);
                if factors.is_empty() {
                    self.variables[u as usize].coupled.retain(|c| c.other != v);
                    self.variables[v as usize].coupled.retain(|c| c.other != u);
                    let entries = self.pairs[pair as usize].entries;
                    self.unused.entry(entries).or_default().push(pair);
                }
            }
        }
    }

    fn mark(&mut self, variable: u32) {
        if !std::mem::replace(&mut self.variables[variable as usize].is_dirty, true) {
            self.dirty.push(variable);
        }
    }

    /// Marks the sums that contain this factor as outdated.
    pub(crate) fn mark_factor(&mut self, members: &[(u32, u32)]) {
        for (n, &(v, _)) in members.iter().enumerate() {
            self.mark(v);
            for &(u, _) in &members[..n] {
                let Some(pair) = self.pair(u, v) else { continue };
                if !std::mem::replace(&mut self.pairs[pair as usize].is_dirty, true) {
                    self.dirty_pairs.push(pair);
                }
            }
        }
    }

    /// Recomputes the outdated sums.
    pub(crate) fn sum_up(&mut self, regions: &Regions) {
        for v in std::mem::take(&mut self.dirty) {
            self.variables[v as usize].is_dirty = false;
            self.sum_variable(v, regions);
        }
        for pair in std::mem::take(&mut self.dirty_pairs) {
            self.pairs[pair as usize].is_dirty = false;
            self.sum_pair(pair, regions);
        }
    }

    /// Returns the diagonal block of a variable as a sum over the factors that `counts` selects.
    pub(crate) fn own_block(
        &self,
        variable: u32,
        regions: &Regions,
        counts: impl Fn(u32) -> bool,
    ) -> SmallVec<[f64; 36]> {
        let v = &self.variables[variable as usize];
        let d = v.dim as usize;
        let mut h = SmallVec::from_elem(0.0, d * d);
        for part in v.factors.iter().filter(|part| counts(part.factor)) {
            add_diagonal(&mut h, d, part.region, part.at as usize, regions);
        }
        (0..d).filter(|c| v.held >> c & 1 == 1).for_each(|c| h[c * d + c] = 1.0);
        h
    }

    fn sum_variable(&mut self, variable: u32, regions: &Regions) {
        let v = &self.variables[variable as usize];
        let d = v.dim as usize;
        let h = &mut self.diagonals[v.diagonal..v.diagonal + d * d];
        let g = &mut self.gradient[v.start..v.start + d];
        h.fill(0.0);
        g.fill(0.0);
        for part in &v.factors {
            let (region, at) = (regions[part.region], part.at as usize);
            if region.counts {
                add_diagonal(h, d, part.region, at, regions);
                g.iter_mut().zip(&regions.g[region.g + at..]).for_each(|(g, x)| *g += x);
            }
        }
        for c in 0..d {
            if v.held >> c & 1 == 1 {
                h[c * d + c] = 1.0;
            }
            self.precision[v.start + c] = h[c * d + c].sqrt();
            h[c * d + c] += v.damping;
        }
    }

    fn sum_pair(&mut self, pair: u32, regions: &Regions) {
        let pair = &self.pairs[pair as usize];
        let (columns, rows) = (self.dim(pair.lower), self.dim(pair.higher));
        let block = &mut self.off_diagonals[pair.at..pair.at + rows * columns];
        block.fill(0.0);
        for &Shared { region, lower, higher, .. } in &pair.factors {
            let region = regions[region];
            if region.counts {
                for (c, column) in block.chunks_exact_mut(rows).enumerate() {
                    let at = lower as usize + c;
                    let from = &regions.h[region.column(at) + higher as usize - at..][..rows];
                    column.iter_mut().zip(from).for_each(|(h, x)| *h += x);
                }
            }
        }
    }

    /// Returns whether the diagonal of H and the gradient of a variable are finite. They bound all other
    /// entries.
    pub(crate) fn is_finite(&self, variable: u32) -> bool {
        let own = self.precision(variable).iter().chain(self.gradient(variable));
        own.into_iter().all(|x| x.is_finite())
    }
}

/// Adds a variable's diagonal block of a region, lower triangle.
#[inline(always)]
fn add_diagonal(h: &mut [f64], d: usize, region: u32, at: usize, regions: &Regions) {
    let region = regions[region];
    for c in 0..d {
        let from = &regions.h[region.column(at + c)..][..d - c];
        h[c * d + c..(c + 1) * d].iter_mut().zip(from).for_each(|(h, x)| *h += x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_several_sizes_come_and_go_in_the_same_memory() {
        let mut blocks = Blocks::default();
        [6, 6, 9].iter().for_each(|dim| blocks.push(*dim, 0));
        let factors = [[(0, 0), (1, 6)], [(0, 0), (2, 6)]];
        for n in 0..100 {
            let both: [u32; 2] = std::array::from_fn(|i| 2 * n + i as u32);
            both.iter().zip(&factors).for_each(|(f, members)| blocks.connect(*f, 0, members));
            both.iter().zip(&factors).for_each(|(f, members)| blocks.disconnect(*f, members));
        }
        assert_eq!((blocks.pairs.len(), blocks.off_diagonals.len()), (2, 36 + 54));
    }
}
