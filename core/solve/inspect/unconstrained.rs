//! Factors and variables that a solve excludes: undefined factors, and variables without an active factor.
use crate::outcome::{InactiveFactor, UnconstrainedVariables};
use crate::problem::Problem;
use manifactor_graph::Key;

/// Number of inactive factors that an outcome names.
const MAX_NAMED: usize = 10;

impl Problem {
    /// Returns the first of the factors that were undefined at the last linearization.
    pub(crate) fn inactive_factors(&self) -> Vec<InactiveFactor> {
        let mut factors = vec![];
        self.model.batches.iter().for_each(|batch| batch.inactive(&mut |factor| factors.push(factor)));
        factors.sort_unstable();
        let named = factors.into_iter().take(MAX_NAMED);
        let describe = |factor| InactiveFactor {
            factor,
            name: self.model.factors[factor].label(),
            keys: self.model.keys(factor),
        };
        named.map(describe).collect()
    }

    /// Returns the free variables without a factor that was active in the last linearization; `None` if
    /// there are none.
    pub(crate) fn unconstrained(&self) -> Option<UnconstrainedVariables> {
        let mut takes_part = vec![true; self.factors()];
        self.model.batches.iter().for_each(|batch| batch.inactive(&mut |factor| takes_part[factor] = false));
        takes_part.iter_mut().zip(self.weights()).for_each(|(part, weight)| *part &= *weight != 0.0);
        if self.has_flat_variable() {
            // a redescending loss gives weight zero to outliers
            let idle = self.model.inspect().into_iter().filter(|state| state.weight == 0.0);
            idle.for_each(|state| takes_part[state.entry] = false);
        }
        let mut constrained = vec![false; self.model.variables.len()];
        for (factor, _) in self.model.factors.iter().zip(&takes_part).filter(|(_, part)| **part) {
            factor.variables.iter().for_each(|variable| constrained[*variable as usize] = true);
        }
        let free = self.model.variables.iter().zip(&constrained).filter(|(place, _)| place.start.is_some());
        let keys: Vec<Key> =
            free.filter(|(_, constrained)| !**constrained).map(|(place, _)| place.key.clone()).collect();
        let active = takes_part.iter().filter(|part| **part).count();
        (!keys.is_empty()).then(|| UnconstrainedVariables { keys, active, factors: self.factors() })
    }

    /// Returns whether a free variable has no residual that depends on it to first order.
    fn has_flat_variable(&self) -> bool {
        let diagonal: Vec<f64> = self.system.diagonal().copied().collect();
        self.model.variables.iter().any(|place| {
            let mut unknowns = place.unknowns().flatten().peekable();
            unknowns.peek().is_some() && unknowns.all(|unknown| diagonal[unknown] == 0.0)
        })
    }
}
