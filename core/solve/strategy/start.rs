//! Where a solve begins: initial values by a strategy that is chosen by name.
use crate::linear::BlockSystemError;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Graph, Key, ValueError, Values, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// A strategy that finds initial values. Chosen by name.
#[typetag::serialize(tag = "type")]
pub trait Start: Debug + Send + Sync {
    /// Values to begin with: `values`, with those replaced and added that the strategy has something to say
    /// of. Held variables keep their values, and the order of the values stays.
    ///
    /// # Errors
    /// If the strategy does not apply to the graph, or the graph does not fit its values.
    fn start(&self, graph: &Graph, values: &Values) -> Result<Values, StartError>;

    /// Returns whether `minimum`, which a solve from other values has led to, looks wrong, so that it is worth beginning
    /// here as well. [`Auto`](crate::Auto) asks after each solve: the answer must take almost no time, and may
    /// not depend on the unit of the noise. Default: no.
    fn doubts(&self, _graph: &Graph, _minimum: &Values) -> bool {
        false
    }
}

manifactor_graph::kind!(dyn Start, "start");

/// Why there are no initial values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// A factor takes a variable for another type than its value has.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// Noise of a factor that does not fit its residual.
    #[error("factor {factor}: {source}")]
    Noise {
        /// The factor, from 0 in the order of the graph.
        factor: usize,
        /// What is wrong with it.
        source: NoiseError,
    },
    /// The strategy finds nothing in the graph to work on.
    #[error(
        "the start `{start}` does not apply to this graph: it needs {needs}; choose another, such as `given`"
    )]
    NotApplicable {
        /// Its name.
        start: &'static str,
        /// What it would need.
        needs: &'static str,
    },
    /// The measurements leave something open.
    #[error(
        "the start `{start}`: the measurements leave the {what} of some of the {variables} variables around \
         `{key}` open, or their noise is too uneven for f64; choose another start, such as `given`"
    )]
    Open {
        /// The start's name.
        start: &'static str,
        /// What is left open: `rotations`, `positions`.
        what: &'static str,
        /// The first variable of the system.
        key: Key,
        /// How many there are.
        variables: usize,
    },
    /// Its linear system does not fit into memory.
    #[error(transparent)]
    System(#[from] BlockSystemError),
}

/// The values that came with the graph, as they are.
///
/// ```toml
/// start = { type = "given" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Given {}

impl Given {
    pub(crate) const NAME: &'static str = "given";
}

#[typetag::serialize(name = "given")]
impl Start for Given {
    fn start(&self, _: &Graph, values: &Values) -> Result<Values, StartError> {
        Ok(values.clone())
    }
}
register!(dyn Start, "given", Given);
