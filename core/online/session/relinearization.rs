//! Variables that have moved out of the region where their linearization holds.
//!
//! The error of a linearization grows with the square of the step, so what a step may be is the root of what the error may
//! be: |δᵢ| ≤ √(bend · σᵢ) with σᵢ = 1/√Hᵢᵢ, the precision of the factors around. Thresholds in radians and metres would
//! be too coarse for precise data and too fine for coarse data, and need one number for each type of variable.
use super::Session;

/// Variables at new points, and what takes them back.
#[derive(Debug, Default)]
pub(super) struct Relinearized {
    pub(super) variables: Vec<u32>,
    factors: Vec<u32>,
    saved: Vec<f64>,
}

/// Halvings of a step that leads out of the domain of a factor.
const HALVINGS: usize = 4;

impl Session {
    /// The square of how many times its threshold the largest component of a variable's step is.
    pub(super) fn excess(&self, variable: u32) -> f64 {
        let blocks = &self.model.blocks;
        let steps = self.delta[blocks.range(variable)].iter().zip(blocks.precision(variable));
        steps.map(|(step, precision)| step * step * precision / self.settings.bend).fold(0.0, f64::max)
    }

    /// Whether something cannot wait for the next turn: after a large loop closure, a step is no estimate of anything.
    pub(super) fn is_urgent(&self) -> bool {
        let urgent = self.settings.urgent.powi(2);
        self.waiting.iter().any(|v| self.excess(*v) > urgent)
    }

    /// The variables to relinearize: those whose held directions have changed, and in turn those that wait.
    pub(super) fn choose(&mut self, held: &[u32], is_turn: bool) -> Vec<u32> {
        let mut chosen: Vec<u32> = held.to_vec();
        if is_turn {
            for v in std::mem::take(&mut self.waiting) {
                self.is_waiting[v as usize] = false;
                if self.excess(v) > 1.0 && self.tree.front_of(v) != crate::tree::NONE {
                    chosen.push(v);
                }
            }
        }
        chosen.sort_unstable();
        chosen.dedup();
        chosen
    }

    /// Linearizes the factors of these variables where the variables are estimated to be; their steps are still what they
    /// were. Where a factor is not defined there any more, or not finite, half the way there; at last, not at all.
    pub(super) fn relinearize(&mut self, variables: Vec<u32>) -> Relinearized {
        let mut factors: Vec<u32> = variables.iter().flat_map(|v| self.model.blocks.factors(*v)).collect();
        factors.sort_unstable();
        factors.dedup();
        let saved = self.model.save(&factors);
        let inactive = factors.iter().filter(|f| !self.model.takes_part(**f)).count();
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            for v in &variables {
                let step: smallvec::SmallVec<[f64; 9]> =
                    self.delta[self.model.blocks.range(*v)].iter().map(|d| d * share).collect();
                self.model.try_step(*v, &step);
            }
            let evaluation = self.model.linearize(&factors);
            let out = factors.iter().filter(|f| !self.model.takes_part(**f)).count();
            if evaluation.not_finite.is_none() && out <= inactive {
                for f in &factors {
                    self.note_activity(*f);
                }
                return Relinearized { variables, factors, saved };
            }
            share *= 0.5;
        }
        self.take_back_points(&Relinearized { variables, factors, saved });
        Relinearized::default()
    }

    /// Goes back to the old linearization points.
    pub(super) fn take_back_points(&mut self, relinearized: &Relinearized) {
        for v in &relinearized.variables {
            self.model.reset_trial(*v);
            self.wait(*v);
        }
        // the list of those that take part is made again, too
        self.model.linearize(&relinearized.factors);
        self.model.restore(&relinearized.factors, &relinearized.saved);
    }

    /// Makes the new points those of the session.
    pub(super) fn accept_points(&mut self, relinearized: Relinearized) {
        for v in relinearized.variables {
            self.model.accept(v);
            self.delta[self.model.blocks.range(v)].fill(0.0);
        }
    }

    /// Notes that a variable is to be relinearized when its turn comes.
    pub(super) fn wait(&mut self, variable: u32) {
        if !std::mem::replace(&mut self.is_waiting[variable as usize], true) {
            self.waiting.push(variable);
        }
    }
}
