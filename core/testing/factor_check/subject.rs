//! A factor to check, with a point at which it is defined.
use crate::error::LawError;
use crate::example::{example, example_keys, example_point};
use manifactor_graph::catalogue::Entry;
use manifactor_graph::manifold_name;
use manifactor_graph::{Factor, Variable};
use serde_json::{Value, json};
use std::sync::Arc;

/// A factor, the keys of its variables, and a point around which further points are drawn.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The factor.
    pub factor: Arc<dyn Factor>,
    /// Keys of its variables.
    pub keys: Vec<String>,
    /// Variables at which the factor is defined.
    pub around: Vec<Box<dyn Variable>>,
}

impl Subject {
    /// Creates a subject from the example in the docs of a registered factor, at the examples of its
    /// manifolds.
    ///
    /// # Errors
    /// If the catalogue entry is incomplete.
    pub fn example(entry: &'static Entry) -> Result<Self, LawError> {
        Self::around_examples(entry, example::<dyn Factor>(entry)?.into())
    }

    /// Creates a subject from a factor of this entry, at the examples of its manifolds.
    ///
    /// # Errors
    /// If the catalogue entry is incomplete.
    pub fn around_examples(entry: &'static Entry, factor: Arc<dyn Factor>) -> Result<Self, LawError> {
        let signature = factor.erased().signature();
        let named = example_keys(entry);
        let mut types = signature.variables;
        if signature.many
            && let Some(first) = types.first().copied()
        {
            types.resize(if named.is_empty() { 3 } else { named.len() }, first);
        }
        let around: Vec<_> = types.iter().map(|id| example_point(entry, *id)).collect::<Result<_, _>>()?;
        let by_type = || types.iter().enumerate().map(|(i, id)| format!("{}_{i}", manifold_name(*id)));
        let keys = if named.len() == types.len() { named } else { by_type().collect() };
        Ok(Self { factor, keys, around })
    }

    /// Returns the name of a direction, given by variable and column: `q0.rx`.
    pub(super) fn direction(&self, variable: usize, column: usize) -> String {
        let key = self.keys.get(variable).map_or("?", String::as_str);
        let tangent = self.around.get(variable).map(|x| x.erased().tangent()).unwrap_or_default();
        format!("{key}.{}", tangent.get(column).copied().unwrap_or("?"))
    }

    /// Returns the variable and column of direction `number`, counted over all variables and then again from
    /// the first. Returns `None` if there are no directions.
    pub(super) fn column(&self, number: usize) -> Option<(usize, usize)> {
        let columns = |v: usize| (0..self.around[v].erased().dim()).map(move |c| (v, c));
        let all: Vec<_> = (0..self.around.len()).flat_map(columns).collect();
        all.get(number % all.len().max(1)).copied()
    }

    /// Returns the names of all directions of all variables.
    pub(super) fn directions(&self) -> Vec<String> {
        let columns = |v: usize| self.around[v].erased().dim();
        (0..self.around.len()).flat_map(|v| (0..columns(v)).map(move |c| self.direction(v, c))).collect()
    }

    /// Returns the graph document of this factor alone at a point, which reproduces the result there.
    pub(super) fn graph(&self, point: &[Box<dyn Variable>]) -> Value {
        let variables: Vec<_> =
            self.keys.iter().zip(point).map(|(key, value)| json!({ "key": key, "value": value })).collect();
        // a factor that no document can hold is replaced by the error
        let factor = serde_json::to_value(&*self.factor).unwrap_or_else(|error| json!(error.to_string()));
        json!({ "variables": variables, "factors": [{ "keys": self.keys, "factor": factor }] })
    }
}
