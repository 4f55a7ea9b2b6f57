//! How a session trades time for accuracy.
mod window;

use manifactor_graph::checked::NotNegative;
use manifactor_solve::{FactorType, Probability};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

pub use window::{ManifoldType, NotOneSpan, Span, UnknownManifold, Window};

/// Settings of a session. The defaults are meant for any graph: thresholds are in units of the estimate's own precision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Updates from one relinearization to the next, at least 1. Default: 10.
    pub relinearize_every: NonZeroUsize,
    /// Largest error of a linearization, in standard deviations of the factors around. A variable is linearized anew if a component
    /// of its step δ is larger than √(bend · σ), with σ = 1/√Hᵢᵢ, or if new weights of robust losses change its gradient by more
    /// than 1/σ. 0 relinearizes every variable that moves. Default: 0.1.
    pub bend: NotNegative,
    /// Changes of a step δ that are not passed on to other variables, in standard deviations σ = 1/√Hᵢᵢ of the factors around. 0 passes on
    /// every change. Default: 0.01.
    pub deviation: NotNegative,
    /// Multiples of the threshold for relinearization from which on a variable does not wait for its turn: the update is
    /// followed by another pass at once. Default: 10.
    pub urgent: NotNegative,
    /// Such passes that one update may take. Default: 1.
    pub passes: usize,
    /// Multiply-adds that an update may take where it relinearizes, for deadlines. Relinearizations beyond it wait for the next
    /// updates, those furthest out first; an update that has nothing else to do takes one at least. What new factors need
    /// is never put off, nor is a step shortened later because of it. Default: no budget.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<NotNegative>,
    /// What stays of a graph that grows without end. Default: all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Which factors may be wrong, and are tested before they count. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outliers: Option<Outliers>,
}

/// The test that a factor has to pass: what it costs on top of what is known must be below the χ² quantile for its rows.
///
/// Candidates are all factors that couple variables, except odometry. Odometry is the first factor between two variables of one type
/// that came one after the other; if an update brings several, it is the factor that fits the values of the variables best.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Outliers {
    /// Share of the right ones that the test keeps. Default: 0.99.
    pub probability: Probability,
    /// Nats for each row by which a factor alone may narrow down where its variables are, where as many candidates count as are rejected;
    /// the logarithm of that ratio is added. What says more is hardly tested by what is known, and waits for another that bears it
    /// out. Default: 1.5.
    pub gain: NotNegative,
    /// Of the candidates only the factors of these types. Default: all of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub types: Vec<FactorType>,
}

impl Default for Outliers {
    fn default() -> Self {
        Self { probability: Probability::default(), gain: NotNegative::literal(1.5), types: vec![] }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            relinearize_every: NonZeroUsize::MIN.saturating_add(9),
            bend: NotNegative::literal(0.1),
            deviation: NotNegative::literal(0.01),
            urgent: NotNegative::literal(10.0),
            passes: 1,
            budget: None,
            window: None,
            outliers: None,
        }
    }
}
