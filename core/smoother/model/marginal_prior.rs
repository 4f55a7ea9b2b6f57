//! Marginalization: eliminated variables are replaced by a linear prior on their neighbours, at the
//! linearization points.
//!
//! The factors of a variable L form the quadratic ½ δᵀHδ + gᵀδ + c over L and its neighbours B. Eliminating L
//! leaves the Schur complement H_BB − H_BL H_LL⁻¹ H_LB. The terms g and c are reduced in the same way.
use super::{Factor, Model, Overflow};
use manifactor_graph::batch::Evaluation;
use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

/// A linear prior ½ δᵀHδ + gᵀδ + constant, with the steps δ of its variables from their linearization points.
#[derive(Debug, Default)]
pub(crate) struct Prior {
    /// Ascending.
    pub variables: Vec<u32>,
    /// The packed lower triangle, by columns.
    pub h: Vec<f64>,
    pub g: Vec<f64>,
    pub constant: f64,
}

/// A pivot below this share of the diagonal entry is rounding error. The direction is held, as in the fronts.
const MIN_PIVOT_SHARE: f64 = 1e-14;
/// Information below this share of the original information is left over from cancellation.
const CANCELLATION_SHARE: f64 = 1e-13;

/// A dense system: the lower triangle of an n × n matrix, and g.
struct Dense {
    n: usize,
    h: Vec<f64>,
    g: Vec<f64>,
}

impl Model {
    /// Eliminates a variable from these factors. Returns the linear prior on their remaining variables, or
    /// `None` if that has no information.
    ///
    /// # Errors
    /// If the prior is not finite, or too large to be added to other factors.
    pub(crate) fn marginal_prior(&self, variable: u32, factors: &[u32]) -> Result<Option<Prior>, Overflow> {
        let of_factors = factors.iter().filter_map(|f| self.factor(*f)).flat_map(|f| f.variables());
        let mut others: Vec<u32> =
            of_factors.filter(|v| *v != variable && !self.record(*v).is_held()).collect();
        others.sort_unstable();
        others.dedup();
        let mut constant = self.cost(factors, None).cost;
        let own = self.blocks.dim(variable);
        others.insert(0, variable);
        let mut dense = self.gather(&others, factors);
        others.remove(0);
        let before: Vec<f64> = (own..dense.n).map(|i| dense.h[i * (dense.n + 1)]).collect();
        let least: Vec<f64> = (0..own).map(|k| MIN_PIVOT_SHARE * dense.h[k * (dense.n + 1)]).collect();
        for (k, least) in least.into_iter().enumerate() {
            constant -= dense.eliminate(k, least);
        }
        for (i, before) in before.into_iter().enumerate() {
            dense.clear_rounding(own + i, CANCELLATION_SHARE * before);
        }
        let n = dense.n;
        let columns = (own..n).map(|c| &dense.h[c * n + c..(c + 1) * n]);
        let h: Vec<f64> = columns.flatten().copied().collect();
        let g = dense.g[own..].to_vec();
        // sums with other factors have to be finite too
        let is_small = h.iter().chain(&g).chain([&constant]).all(|x| x.abs() < 1e150);
        let has_information = h.iter().any(|x| *x != 0.0);
        match is_small {
            true => Ok(has_information.then_some(Prior { variables: others, h, g, constant })),
            false => Err(Overflow(variable)),
        }
    }

    /// Returns the sum of factors over these variables, in their order. Other variables are left out.
    fn gather(&self, variables: &[u32], factors: &[u32]) -> Dense {
        let mut n = 0;
        let first = |v: &u32| {
            n += self.blocks.dim(*v);
            (*v, n - self.blocks.dim(*v))
        };
        let mut first: Vec<(u32, usize)> = variables.iter().map(first).collect();
        first.sort_unstable();
        let place = |v: u32| first.binary_search_by_key(&v, |(v, _)| *v).ok().map(|i| first[i].1);
        let mut dense = Dense { n, h: vec![0.0; n * n], g: vec![0.0; n] };
        let mut to: Vec<Option<usize>> = vec![];
        for factor in factors.iter().filter_map(|f| self.factor(*f)) {
            let region = self.regions[factor.region];
            to.clear();
            for v in factor.variables() {
                let dim = self.blocks.dim(v);
                to.extend((0..dim).map(|d| place(v).map(|first| first + d)));
            }
            for (c, column) in to.iter().enumerate() {
                let Some(column) = *column else { continue };
                dense.g[column] += self.regions.g[region.g + c];
                let values = &self.regions.h[region.column(c)..][..to.len() - c];
                for (row, value) in to[c..].iter().zip(values) {
                    if let Some(row) = *row {
                        dense.h[row.min(column) * n + row.max(column)] += value;
                    }
                }
            }
        }
        dense
    }

    /// Returns H and g of factors over these variables, in their order.
    pub(crate) fn sums(&self, variables: &[u32], factors: &[u32]) -> (DMatrix<f64>, DVector<f64>) {
        let Dense { n, h, g } = self.gather(variables, factors);
        (DMatrix::from_fn(n, n, |r, c| h[r.min(c) * n + r.max(c)]), DVector::from_vec(g))
    }

    /// Returns the value of a prior at the steps `delta`, by scalar of all variables. `None` means zero
    /// steps.
    pub(super) fn prior_cost(&self, factor: &Factor, delta: Option<&[f64]>) -> Evaluation {
        let mut cost = factor.constant;
        let Some(delta) = delta else { return Evaluation { cost, ..Evaluation::default() } };
        let region = self.regions[factor.region];
        let steps = factor.variables().flat_map(|v| &delta[self.blocks.range(v)]).copied();
        let x: SmallVec<[f64; 16]> = steps.collect();
        for (c, step) in x.iter().enumerate() {
            let column = &self.regions.h[region.column(c)..][..x.len() - c];
            let below: f64 = column[1..].iter().zip(&x[c + 1..]).map(|(h, x)| h * x).sum();
            cost += step * (0.5 * column[0] * step + below + self.regions.g[region.g + c]);
        }
        Evaluation { cost, ..Evaluation::default() }
    }

    /// Inserts a prior under an unused number.
    pub(crate) fn insert_prior(&mut self, number: u32, prior: &Prior) {
        let mut scalars = 0;
        let first = |v: &u32| {
            scalars += self.blocks.dim(*v) as u32;
            (*v, scalars - self.blocks.dim(*v) as u32)
        };
        let members: SmallVec<[(u32, u32); 2]> = prior.variables.iter().map(first).collect();
        let place = self.regions.acquire(scalars);
        let region = self.regions[place];
        self.regions.h[region.h..region.h + prior.h.len()].copy_from_slice(&prior.h);
        self.regions.g[region.g..region.g + prior.g.len()].copy_from_slice(&prior.g);
        self.blocks.connect(number, place, &members);
        prior.variables.iter().for_each(|v| self.record_mut(*v).prior_count += 1);
        self.factors.insert(number, Factor::prior(members, place, prior.constant));
    }

    /// Returns the prior with this number; `None` if the number belongs to a factor or is unused.
    pub(crate) fn prior(&self, number: u32) -> Option<Prior> {
        let factor = self.factor(number).filter(|factor| factor.entry.is_none())?;
        let region = self.regions[factor.region];
        Some(Prior {
            variables: factor.variables().collect(),
            h: self.regions.h[region.h..region.h + region.entries()].to_vec(),
            g: self.regions.g[region.g..region.g + region.scalars as usize].to_vec(),
            constant: factor.constant,
        })
    }

    /// Returns the numbers of all priors.
    pub(crate) fn priors(&self) -> impl Iterator<Item = u32> {
        self.factors.iter().filter(|(_, factor)| factor.entry.is_none()).map(|(f, _)| f)
    }
}

impl Dense {
    /// Eliminates scalar `k` after all earlier ones, unless its pivot is `least` or lower. Returns the
    /// decrease of the constant.
    fn eliminate(&mut self, k: usize, least: f64) -> f64 {
        let Self { n, h, g } = self;
        let n = *n;
        let (done, rest) = h.split_at_mut((k + 1) * n);
        let column = &mut done[k * n..];
        let pivot = column[k];
        if pivot <= least || !pivot.is_finite() {
            return 0.0;
        }
        for j in k + 1..n {
            let factor = column[j] / pivot;
            let to = &mut rest[(j - k - 1) * n..][..n];
            to[j..].iter_mut().zip(&column[j..]).for_each(|(to, x)| *to -= factor * x);
            g[j] -= factor * g[k];
        }
        0.5 * g[k] * g[k] / pivot
    }

    /// Clears the row and column of a scalar whose information is `least` or lower.
    fn clear_rounding(&mut self, i: usize, least: f64) {
        if self.h[i * (self.n + 1)] <= least {
            (0..=i).for_each(|c| self.h[c * self.n + i] = 0.0);
            self.h[i * self.n + i..(i + 1) * self.n].fill(0.0);
            self.g[i] = 0.0;
        }
    }
}
