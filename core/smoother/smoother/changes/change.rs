//! One change of the model, and the variables and factors that it touches.
use crate::model::Model;
use manifactor_graph::{FactorEntry, Resolved};

/// A change of the model. Each change has an inverse.
#[derive(Debug, Clone)]
pub(in crate::smoother) enum Change {
    /// If `rejected`, the factor is inserted as a rejected one.
    Insert {
        number: u32,
        entry: Box<FactorEntry>,
        resolved: Resolved,
        weight: f64,
        rejected: bool,
    },
    Remove {
        number: u32,
    },
    SetWeight {
        number: u32,
        weight: f64,
    },
    SetHeld {
        variable: u32,
        held: u32,
    },
    Reject {
        number: u32,
    },
    Readmit {
        number: u32,
    },
}

/// Variables and factors that changes have touched.
#[derive(Debug, Default)]
pub(in crate::smoother) struct Touched {
    /// Variables whose blocks of H have changed.
    pub(in crate::smoother) variables: Vec<u32>,
    /// Factors to linearize.
    pub(in crate::smoother) factors: Vec<u32>,
    /// Removed factors. Some may have been inserted again.
    pub(in crate::smoother) removed: Vec<u32>,
    /// Variables that may have become determined or undetermined.
    pub(in crate::smoother) doubtful: Vec<u32>,
    /// Variables whose held directions have changed.
    pub(in crate::smoother) held: Vec<u32>,
    /// True if damped variables take another step.
    pub(in crate::smoother) steps: bool,
}

impl Touched {
    /// Records that a factor has changed.
    pub(in crate::smoother) fn change(&mut self, model: &Model, factor: u32) {
        self.factors.push(factor);
        for v in model.factor(factor).into_iter().flat_map(|factor| factor.variables()) {
            self.variables.push(v);
            self.doubtful.push(v);
        }
    }
}

impl Change {
    /// Applies the change and returns its inverse.
    pub(in crate::smoother) fn apply(self, model: &mut Model, touched: &mut Touched) -> Option<Self> {
        match self {
            Self::Insert { number, entry, resolved, weight, rejected } => {
                model.insert(number, &entry, &resolved, weight);
                touched.factors.push(number);
                match rejected {
                    true => _ = model.reject(number),
                    false => touched.variables.extend(&resolved.variables),
                }
                let undetermined = resolved.variables.iter().filter(|v| model.is_undetermined(**v));
                touched.doubtful.extend(undetermined);
                Some(Self::Remove { number })
            }
            Self::Remove { number } => {
                let rejected = model.is_rejected(number);
                let factor = model.remove(number)?;
                touched.variables.extend(factor.variables());
                touched.doubtful.extend(factor.variables());
                touched.removed.push(number);
                let resolved = factor.resolved()?;
                let weight = factor.weight;
                Some(Self::Insert { number, entry: Box::new(factor.entry?), resolved, weight, rejected })
            }
            Self::SetWeight { number, weight } => {
                let before = model.set_weight(number, weight)?;
                touched.change(model, number);
                Some(Self::SetWeight { number, weight: before })
            }
            Self::SetHeld { variable, held } => {
                let before = model.set_held(variable, held);
                let neighbours: Vec<u32> = model.blocks.coupled(variable).iter().map(|c| c.other).collect();
                touched.factors.extend(model.blocks.factors(variable));
                for all in [&mut touched.variables, &mut touched.doubtful] {
                    all.extend(neighbours.iter().copied().chain([variable]));
                }
                touched.held.push(variable);
                Some(Self::SetHeld { variable, held: before })
            }
            Self::Reject { number } => model.reject(number).then(|| {
                touched.change(model, number);
                Self::Readmit { number }
            }),
            Self::Readmit { number } => model.readmit(number).then(|| {
                touched.change(model, number);
                Self::Reject { number }
            }),
        }
    }
}
