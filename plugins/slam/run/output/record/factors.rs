//! Residuals at the estimate: by type of factor, and of the factors of each object.
use manifactor_geometry::OnBody;
use manifactor_graph::Key;
use manifactor_graph::batch::FactorState;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::semantics::AppliedRule;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Whitened residuals of one type of factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FactorResiduals {
    /// Type of the factors.
    pub factor: String,
    /// Number of factors that are defined at the estimate.
    pub count: usize,
    /// Number of factors that are not defined at the estimate.
    pub inactive: usize,
    /// Mean weight from the robust losses.
    pub weight: f64,
    /// All rows of all factors. Unit: standard deviations.
    #[serde(deserialize_with = "super::finite_or_nan")]
    pub rows: Vec<f64>,
}

/// A factor that a rule added to an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AppliedFactor {
    /// Type of the factor.
    pub factor: String,
    /// Reason in words.
    pub because: String,
    /// Further variables that the factor connects.
    pub with: Vec<String>,
    /// Residual at the estimate, empty if it is not defined. Unit: standard deviations.
    #[serde(deserialize_with = "super::finite_or_nan")]
    pub residual: Vec<f64>,
}

pub(super) fn residuals(estimate: &Estimate) -> Vec<FactorResiduals> {
    let mut all: Vec<FactorResiduals> = vec![];
    for state in &estimate.solution.factors {
        let Some(entry) = estimate.mapping.graph.factors().get(state.entry) else { continue };
        let name = OnBody::unwrapped(&*entry.factor).typetag_name();
        let place = all.iter().position(|known| known.factor == name).unwrap_or_else(|| {
            let (factor, rows) = (name.to_owned(), vec![]);
            all.push(FactorResiduals { factor, count: 0, inactive: 0, weight: 0.0, rows });
            all.len() - 1
        });
        let Some(of_type) = all.get_mut(place) else { continue };
        if state.defined {
            of_type.rows.extend(&state.whitened);
            of_type.count += 1;
            of_type.weight += state.weight;
        } else {
            of_type.inactive += 1;
        }
    }
    all.iter_mut().for_each(|of_type| of_type.weight /= of_type.count.max(1) as f64);
    all
}

/// States of an estimate's factors, indexed by variable.
pub(super) struct FactorStates<'a> {
    by_key: HashMap<&'a Key, Vec<OfVariable<'a>>>,
}

/// A factor of a variable: type, all keys, state.
type OfVariable<'a> = (&'static str, &'a [Key], &'a FactorState);

impl<'a> FactorStates<'a> {
    pub(super) fn of(estimate: &'a Estimate) -> Self {
        let mut by_key: HashMap<&Key, Vec<_>> = HashMap::new();
        for state in &estimate.solution.factors {
            let Some(entry) = estimate.mapping.graph.factors().get(state.entry) else { continue };
            for key in &entry.keys {
                let name = OnBody::unwrapped(&*entry.factor).typetag_name();
                let of = (name, entry.keys.as_slice(), state);
                by_key.entry(key).or_default().push(of);
            }
        }
        Self { by_key }
    }

    /// Returns the root mean square of an object's box residuals.
    pub(super) fn box_rms(&self, object: &Key) -> Option<f64> {
        let factors = self.by_key.get(object)?.iter();
        let boxes = factors.filter(|(name, _, state)| name.starts_with("bounding_box") && state.defined);
        let rows: Vec<f64> = boxes.flat_map(|(_, _, state)| state.whitened.iter().copied()).collect();
        let squares = rows.iter().map(|x| x * x).sum::<f64>();
        (!rows.is_empty()).then(|| (squares / rows.len() as f64).sqrt())
    }

    /// Returns a factor of an object, with its residual.
    pub(super) fn applied(&self, applied: &AppliedRule, object: &Key) -> AppliedFactor {
        let factors = self.by_key.get(object).into_iter().flatten();
        let mut same = factors.filter(|(name, keys, state)| {
            *name == applied.factor && *keys == applied.keys.as_slice() && state.defined
        });
        let others = applied.keys.iter().filter(|key| *key != object);
        AppliedFactor {
            factor: applied.factor.clone(),
            because: applied.because.clone(),
            with: others.map(ToString::to_string).collect(),
            residual: same.next().map_or(vec![], |(_, _, state)| state.whitened.clone()),
        }
    }
}
