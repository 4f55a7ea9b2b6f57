//! Starts: strategies for initial values, chosen by name.
use crate::linear::BlockSystemError;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Graph, Key, ValueError, Values, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// A strategy for initial values. Documents choose it by name.
#[typetag::serialize(tag = "type")]
pub trait Start: Debug + Send + Sync {
    /// Returns initial values: a copy of `values`, with values replaced and added by the strategy. Fixed
    /// variables keep their values, and the order of the values stays.
    ///
    /// # Errors
    /// If the strategy does not apply to the graph, or the graph does not fit its values.
    fn start(&self, graph: &Graph, values: &Values) -> Result<Values, StartError>;

    /// Returns whether `minimum`, the result of a solve from different values, looks wrong, so that this
    /// start is worth a try. [`Auto`](crate::Auto) calls it after each solve. It must take almost no time,
    /// and must not depend on the unit of the noise. Default: no.
    fn doubts(&self, _graph: &Graph, _minimum: &Values) -> bool {
        false
    }
}

impl dyn Start + '_ {
    /// Returns the initial values of a solve: those of [`start`](Start::start), moved into the bounds of their
    /// variables.
    ///
    /// # Errors
    /// As [`start`](Start::start), or if one of `values` is out of its bounds.
    pub fn initial_values(&self, graph: &Graph, values: &Values) -> Result<Values, StartError> {
        match graph.out_of_bounds(values) {
            Some(out) => Err(ValueError::from(out).into()),
            None => Ok(graph.within_bounds(self.start(graph, values)?)),
        }
    }
}

manifactor_graph::kind!(dyn Start, "start");

/// The error of a start without initial values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// A value has a different type than its factor requires, or is out of its bounds.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// The noise of a factor does not fit its residual.
    #[error("factor {factor}: {source}")]
    Noise {
        /// The factor, from 0 in the order of the graph.
        factor: usize,
        /// The error of the noise.
        source: NoiseError,
    },
    /// The graph contains nothing that the strategy can use.
    #[error(
        "the start `{start}` does not apply to this graph: it needs {needs}; choose another, such as `given`"
    )]
    NotApplicable {
        /// Name of the start.
        start: &'static str,
        /// The requirements of the start.
        needs: &'static str,
    },
    /// The measurements leave variables undetermined.
    #[error(
        "the start `{start}`: the measurements leave the {what} of some of the {variables} variables around \
         `{key}` open, or their noise is too uneven for f64; choose another start, such as `given`"
    )]
    Open {
        /// Name of the start.
        start: &'static str,
        /// The undetermined quantities: `rotations`, `positions`.
        what: &'static str,
        /// The first variable of the system.
        key: Key,
        /// Number of variables of the system.
        variables: usize,
    },
    /// The linear system of the start does not fit into memory.
    #[error(transparent)]
    System(#[from] BlockSystemError),
}

/// The values from the graph's document, unchanged.
///
/// ```toml
/// start = { type = "given" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenStart {}

impl GivenStart {
    pub(crate) const NAME: &'static str = "given";
}

#[typetag::serialize(name = "given")]
impl Start for GivenStart {
    fn start(&self, _: &Graph, values: &Values) -> Result<Values, StartError> {
        Ok(values.clone())
    }
}
register!(dyn Start, "given", GivenStart);
