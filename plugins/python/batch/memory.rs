//! Results of a factor at its last points.
use super::evaluate::{Function, Linearized};
use std::mem::replace;

/// Results at the last two points of a factor: the accepted one, and a trial of the solver.
#[derive(Default)]
pub(super) struct Memory([Option<Results>; 2]);

struct Results {
    /// Numbers of the variables.
    at: Vec<f64>,
    /// Residual, followed by the Jacobian of each variable.
    parts: Vec<Vec<f64>>,
}

impl Memory {
    /// Stores the results at the index `place` of a call.
    pub(super) fn store(&mut self, at: Vec<f64>, function: &Function, place: usize, from: &Linearized) {
        let sizes = sizes(function);
        let from = std::iter::once(&from.0).chain(&from.1);
        let part = |(all, size): (&Vec<f64>, usize)| {
            all.get(place * size..(place + 1) * size).unwrap_or_default().to_vec()
        };
        let parts = from.zip(sizes).map(part).collect();
        let [last, before] = &mut self.0;
        let new = Some(Results { at, parts });
        if last.as_ref().is_some_and(|last| new.as_ref().is_some_and(|new| last.at == new.at)) {
            *last = new;
        } else {
            *before = replace(last, new);
        }
    }

    /// Copies remembered results to the index `place` of a call. Returns false if the point is another one.
    pub(super) fn restore(&self, at: &[f64], function: &Function, place: usize, to: &mut Linearized) -> bool {
        let Some(results) = self.0.iter().flatten().find(|results| results.at == at) else { return false };
        let to = std::iter::once(&mut to.0).chain(&mut to.1);
        for ((to, from), size) in to.zip(&results.parts).zip(sizes(function)) {
            if let Some(to) = to.get_mut(place * size..(place + 1) * size)
                && to.len() == from.len()
            {
                to.copy_from_slice(from);
            }
        }
        true
    }
}

/// Sizes of the residual and of the Jacobian of each variable.
fn sizes(function: &Function) -> impl Iterator<Item = usize> {
    std::iter::once(function.rows).chain(function.dimensions.iter().map(|n| function.rows * n))
}
