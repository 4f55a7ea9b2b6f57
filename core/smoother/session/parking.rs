//! Variables that nothing determines yet: they wait outside of the tree, with all their factors.
//!
//! A variable is parked while its own block of H has no full rank: a point that was seen once, or a pose whose only factor
//! is not defined. Its factors would say nothing of their other variables, so leaving them out is exact. What the own block
//! cannot show, two poses that are tied to each other alone, is found by pivots: see [`Fronts`](crate::fronts::Fronts).
use super::Session;
use super::changes::Touched;
use crate::elimination_tree::Couplings;
use std::collections::{BTreeSet, VecDeque};

/// A block has no full rank where a pivot of it, scaled to a unit diagonal, is smaller.
const RANK: f64 = 1e-8;

/// Variables that begin or cease to be solved for.
#[derive(Debug, Default)]
pub(super) struct Moves {
    /// Both ascend.
    pub(super) entering: Vec<u32>,
    pub(super) leaving: Vec<u32>,
    /// Those that were looked at, ascending, and those of them whose flag has changed.
    pub(super) judged: Vec<u32>,
    pub(super) flipped: Vec<u32>,
}

impl Session {
    /// Decides which of the doubtful variables are parked, and which factors count.
    pub(super) fn park(&mut self, touched: &mut Touched) -> Moves {
        let candidates: BTreeSet<u32> = touched.doubtful.iter().copied().collect();
        let was_parked: Vec<(u32, bool)> =
            candidates.iter().map(|v| (*v, self.model.place(*v).parked)).collect();
        // as many as possible are in; those that cannot be are taken out, and with them what hangs on them
        candidates.iter().for_each(|v| self.model.place_mut(*v).parked = false);
        let mut parked = BTreeSet::new();
        let mut queue: VecDeque<u32> = candidates.iter().copied().collect();
        while let Some(v) = queue.pop_front() {
            let place = self.model.place(v);
            // a prior says something of the others, also where it leaves this one open
            if !place.parked && !place.is_held() && place.sealed == 0 && !self.is_determined(v) {
                self.model.place_mut(v).parked = true;
                parked.insert(v);
                queue.extend(self.model.coupled(v));
            }
        }
        let others = parked.iter().filter(|v| !candidates.contains(v)).map(|v| (*v, false));
        let mut before: Vec<(u32, bool)> = was_parked.into_iter().chain(others).collect();
        before.sort_unstable();
        let mut moves = Moves::default();
        let mut factors = touched.factors.clone();
        for (v, was_parked) in before {
            moves.judged.push(v);
            if self.model.place(v).parked != was_parked {
                moves.flipped.push(v);
                factors.extend(self.model.blocks.factors(v));
            }
        }
        factors.sort_unstable();
        factors.dedup();
        for f in factors {
            self.model.count(f, self.model.is_whole(f));
            touched.variables.extend(self.model.factor(f).into_iter().flat_map(|f| f.variables()));
        }
        let looked_at = touched.variables.iter().chain(&candidates).chain(&parked);
        for v in looked_at.copied().collect::<BTreeSet<u32>>() {
            let is_in = self.factorization.contains(v);
            match (is_in, self.model.place(v).is_in_tree()) {
                (false, true) => moves.entering.push(v),
                (true, false) => moves.leaving.push(v),
                _ => {}
            }
        }
        moves
    }

    /// Has parked variables looked at again by the next update, as their factors say something else now.
    pub(super) fn doubt_parked(&mut self, factors: &[u32]) {
        let factors =
            factors.iter().filter(|f| !self.model.is_whole(**f)).filter_map(|f| self.model.factor(*f));
        let parked = factors.flat_map(|f| f.variables()).filter(|v| self.model.place(*v).parked);
        self.doubtful.extend(parked);
        self.doubtful.sort_unstable();
        self.doubtful.dedup();
    }

    /// Takes back what [`park`](Self::park) decided.
    pub(super) fn unpark(&mut self, moves: &Moves) {
        for v in &moves.flipped {
            let place = self.model.place_mut(*v);
            place.parked = !place.parked;
        }
        let factors: BTreeSet<u32> =
            moves.flipped.iter().flat_map(|v| self.model.blocks.factors(*v)).collect();
        for f in factors {
            self.model.count(f, self.model.is_whole(f));
        }
    }

    /// Whether the factors that could count determine a variable, all others being known.
    fn is_determined(&self, variable: u32) -> bool {
        let others_are_in = |f: u32| {
            let mut others = self.model.factor(f).into_iter().flat_map(|f| f.variables());
            others.all(|v| v == variable || !self.model.place(v).parked)
        };
        let mut h = self.model.own_block(variable, others_are_in);
        has_full_rank(&mut h, self.model.dim(variable))
    }
}

/// Whether a symmetric matrix, of which the lower triangle counts, has full rank once it is scaled to a unit diagonal.
fn has_full_rank(h: &mut [f64], d: usize) -> bool {
    let scale: Vec<f64> = (0..d).map(|c| 1.0 / h[c * d + c].sqrt()).collect();
    if !scale.iter().all(|s| s.is_finite()) {
        return false;
    }
    for c in 0..d {
        (c..d).for_each(|r| h[c * d + r] *= scale[c] * scale[r]);
    }
    for c in 0..d {
        let pivot = h[c * d + c];
        if pivot.is_nan() || pivot <= RANK {
            return false;
        }
        for k in c + 1..d {
            let factor = h[c * d + k] / pivot;
            (k..d).for_each(|r| h[k * d + r] -= factor * h[c * d + r]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::has_full_rank;

    #[test]
    fn units_do_not_matter_for_rank() {
        assert!(has_full_rank(&mut [1e-12, 0.0, 0.0, 1e12], 2));
        assert!(has_full_rank(&mut [1e6, 0.5, 0.0, 1e-6], 2));
        assert!(!has_full_rank(&mut [1e6, 1.0, 0.0, 1e-6], 2));
        assert!(!has_full_rank(&mut [1.0, 0.0, 0.0, 0.0], 2));
        assert!(!has_full_rank(&mut [f64::NAN, 0.0, 0.0, 1.0], 2));
    }
}
