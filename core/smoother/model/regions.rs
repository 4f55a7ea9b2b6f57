//! Regions of the normal equations. Each factor adds its terms to a separate region, so that they can be
//! recomputed or removed independently.
use manifactor_graph::normal_equations::NormalEquations;
use std::collections::BTreeMap;
use std::ops::Index;

/// The region of a factor: the packed lower triangle of H over the factor's `scalars`, and its gradient.
///
/// The scalars of its variables are concatenated by ascending variable number.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Region {
    pub h: usize,
    pub g: usize,
    pub scalars: u32,
    /// True if the region is included in the sums. It is not if a variable is undetermined.
    pub counts: bool,
}

impl Region {
    /// Returns the number of entries of the triangle.
    pub(crate) fn entries(self) -> usize {
        let n = self.scalars as usize;
        n * (n + 1) / 2
    }
    /// Returns the index of the entry (column, column) of the triangle.
    #[inline(always)]
    pub(crate) fn column(self, column: usize) -> usize {
        let n = self.scalars as usize;
        self.h + column * n - column * column.saturating_sub(1) / 2
    }
}

/// All regions and their memory. Regions of removed factors are reused.
#[derive(Debug, Default)]
pub(crate) struct Regions {
    all: Vec<Region>,
    pub h: Vec<f64>,
    pub g: Vec<f64>,
    /// Free regions, by number of scalars.
    unused: BTreeMap<u32, Vec<u32>>,
}

impl Index<u32> for Regions {
    type Output = Region;
    #[inline(always)]
    fn index(&self, place: u32) -> &Region {
        &self.all[place as usize]
    }
}

impl Regions {
    /// Returns the index of an unused region, and includes it in the sums.
    pub(crate) fn acquire(&mut self, scalars: u32) -> u32 {
        if let Some(place) = self.unused.get_mut(&scalars).and_then(Vec::pop) {
            self.all[place as usize].counts = true;
            return place;
        }
        let region = Region { h: self.h.len(), g: self.g.len(), scalars, counts: true };
        self.h.resize(self.h.len() + region.entries(), 0.0);
        self.g.resize(self.g.len() + scalars as usize, 0.0);
        self.all.push(region);
        self.all.len() as u32 - 1
    }

    pub(crate) fn release(&mut self, place: u32) {
        self.unused.entry(self[place].scalars).or_default().push(place);
    }

    /// Sets whether a region is included in the sums. Returns the previous value.
    pub(crate) fn count(&mut self, place: u32, counts: bool) -> bool {
        std::mem::replace(&mut self.all[place as usize].counts, counts)
    }

    pub(crate) fn clear(&mut self, place: u32) {
        let region = self[place];
        self.h[region.h..region.h + region.entries()].fill(0.0);
        self.g[region.g..region.g + region.scalars as usize].fill(0.0);
    }

    /// Returns whether all values of a region are finite.
    pub(crate) fn is_finite(&self, place: u32) -> bool {
        let region = self[place];
        let (h, g) =
            (&self.h[region.h..][..region.entries()], &self.g[region.g..][..region.scalars as usize]);
        h.iter().chain(g).all(|x| x.is_finite())
    }

    pub(crate) fn normal_equations(&mut self) -> NormalEquations<'_> {
        NormalEquations { h: &mut self.h, g: &mut self.g }
    }
}
