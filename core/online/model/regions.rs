//! Where each factor adds its part of the normal equations: a region of its own, so that it can be made again, or taken
//! away, without a look at any other.
use manifactor_graph::normal_equations::NormalEquations;
use std::collections::BTreeMap;

/// A factor's region: the packed lower triangle of H over its own `scalars`, and its gradient.
///
/// Scalars are those of its variables one after the other, by ascending number of the variable.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Region {
    pub h: usize,
    pub g: usize,
    pub scalars: u32,
    /// Whether its part counts: not where a variable is parked.
    pub counts: bool,
}

impl Region {
    /// Entries of the triangle.
    fn entries(self) -> usize {
        let n = self.scalars as usize;
        n * (n + 1) / 2
    }
    /// Where entry (column, column) of the triangle is.
    #[inline(always)]
    pub(crate) fn column(self, column: usize) -> usize {
        let n = self.scalars as usize;
        self.h + column * n - column * column.saturating_sub(1) / 2
    }
}

/// The memory of all regions. That of factors that are gone is used again.
#[derive(Debug, Default)]
pub(crate) struct Regions {
    pub h: Vec<f64>,
    pub g: Vec<f64>,
    unused: BTreeMap<u32, Vec<Region>>,
}

impl Regions {
    pub(crate) fn take(&mut self, scalars: u32) -> Region {
        if let Some(region) = self.unused.get_mut(&scalars).and_then(Vec::pop) {
            return region;
        }
        let region = Region { h: self.h.len(), g: self.g.len(), scalars, counts: true };
        self.h.resize(self.h.len() + region.entries(), 0.0);
        self.g.resize(self.g.len() + scalars as usize, 0.0);
        region
    }

    pub(crate) fn give(&mut self, region: Region) {
        self.unused.entry(region.scalars).or_default().push(Region { counts: true, ..region });
    }

    pub(crate) fn clear(&mut self, region: Region) {
        self.h[region.h..region.h + region.entries()].fill(0.0);
        self.g[region.g..region.g + region.scalars as usize].fill(0.0);
    }

    /// Whether all numbers of a region are finite.
    pub(crate) fn is_finite(&self, region: Region) -> bool {
        let (h, g) =
            (&self.h[region.h..][..region.entries()], &self.g[region.g..][..region.scalars as usize]);
        h.iter().chain(g).all(|x| x.is_finite())
    }

    pub(crate) fn normal_equations(&mut self) -> NormalEquations<'_> {
        NormalEquations { h: &mut self.h, g: &mut self.g }
    }
}
