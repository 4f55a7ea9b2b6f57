//! What takes no part in a solve: factors that are not defined, and variables that no other factor touches.
use crate::problem::Problem;
use manifactor_graph::Key;
use serde::Serialize;
use std::fmt;

/// Inactive factors that an outcome names.
const NAMED: usize = 10;

/// A factor that is not defined at the final values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InactiveFactor {
    /// Its place in the graph, from 0.
    pub factor: usize,
    /// Its type.
    pub name: &'static str,
    /// Its variables.
    pub keys: Vec<Key>,
}

/// Variables that no factor which takes part touches: nothing is known of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Untouched {
    /// Their keys, in the order of the values. Those that are held are not among them.
    pub keys: Vec<Key>,
    /// Factors that take part: they are defined, and their weight is not zero.
    pub active: usize,
    /// Factors in the problem.
    pub factors: usize,
}

impl fmt::Display for Untouched {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 3;
        let keys: Vec<_> = self.keys.iter().take(SHOWN).map(ToString::to_string).collect();
        write!(f, "no factor that takes part touches {}", keys.join(", "))?;
        match self.keys.len().saturating_sub(SHOWN) {
            0 => {}
            1 => f.write_str(" and 1 more variable")?,
            more => write!(f, " and {more} more variables")?,
        }
        let advice = match (self.factors, self.factors - self.active) {
            (0, _) => " (the graph has no factors); add factors",
            (_, 0) => "; add factors",
            (factors, idle) => {
                write!(f, " ({idle} of {factors} take no part at these values)")?;
                "; begin where their factors are defined, add others"
            }
        };
        write!(f, "{advice}, or fix or remove what nothing touches")
    }
}

impl Problem {
    /// The first of the factors that were not defined at the last linearization.
    pub(crate) fn inactive_factors(&self) -> Vec<InactiveFactor> {
        let mut factors = vec![];
        self.batches.iter().for_each(|batch| batch.inactive(&mut |factor| factors.push(factor)));
        factors.sort_unstable();
        let named = factors.into_iter().take(NAMED);
        let describe = |factor| InactiveFactor {
            factor,
            name: self.factor_types[factor].0,
            keys: self.factor_keys(factor),
        };
        named.map(describe).collect()
    }

    /// The free variables that no factor touches which took part in the last linearization; `None` where there are
    /// none.
    pub(crate) fn untouched(&self) -> Option<Untouched> {
        let mut takes_part = vec![true; self.factors()];
        self.batches.iter().for_each(|batch| batch.inactive(&mut |factor| takes_part[factor] = false));
        takes_part.iter_mut().zip(&self.weights).for_each(|(part, weight)| *part &= *weight != 0.0);
        let mut touched = vec![false; self.variables.len()];
        for (variables, _) in self.factor_variables.iter().zip(&takes_part).filter(|(_, part)| **part) {
            variables.iter().for_each(|variable| touched[*variable as usize] = true);
        }
        let free = self.variables.iter().zip(&touched).filter(|(place, _)| place.start.is_some());
        let keys: Vec<Key> =
            free.filter(|(_, touched)| !**touched).map(|(place, _)| place.key.clone()).collect();
        let active = takes_part.iter().filter(|part| **part).count();
        (!keys.is_empty()).then(|| Untouched { keys, active, factors: self.factors() })
    }
}
