//! Settings of the smoother.
mod window;

use manifactor_document::{RenamedField, deserialize_with, read_renamed};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Factor, TypeName};
use manifactor_solve::Probability;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::num::NonZeroUsize;

pub use window::{NotOneSpan, Span, Window};

/// Settings of the smoother. The defaults suit any graph, because thresholds are in units of the estimate's
/// precision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", deny_unknown_fields, default)]
#[schemars(rename = "SmootherSettings")]
pub struct SmootherSettings {
    /// Number of updates from one relinearization to the next, at least 1. Default: 10.
    pub relinearize_every: NonZeroUsize,
    /// Relinearization threshold: largest error of a linearization. A variable is relinearized if a component
    /// of its step δ is larger than √(threshold · σ), with σ = 1/√Hᵢᵢ of the surrounding factors. It is also
    /// relinearized if new weights of robust losses change its gradient by more than 1/σ. 0 relinearizes
    /// every variable that moves. Default: 0.1. Unit: σ.
    pub relinearization_threshold: NotNegative,
    /// Wildfire threshold: smaller changes of a step δ are not propagated to other variables. 0 propagates
    /// every change. Default: 0.01. Unit: σ = 1/√Hᵢᵢ of the surrounding factors.
    pub wildfire_threshold: NotNegative,
    /// Multiple of the relinearization threshold above which a variable is relinearized at once, by an
    /// additional pass of the update. Default: 10.
    pub immediate_relinearization_factor: NotNegative,
    /// Largest number of additional passes in one update. Default: 1.
    pub passes: usize,
    /// Largest number of multiply-adds in an update that relinearizes, for deadlines. Variables with the
    /// largest errors are relinearized first, the remaining ones by the next updates. An update without other
    /// work relinearizes at least one. New factors and the shortening of steps are not limited. Default: no
    /// budget.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<NotNegative>,
    /// Window of variables to keep in a graph that grows without end. Default: all variables stay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Outlier test of new factors. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outliers: Option<Outliers>,
}

/// Outlier test: the additional cost of a candidate, given all accepted factors, must be below the χ²
/// quantile for its rows.
///
/// Candidates are all factors that couple variables, except odometry. Odometry is the first factor between
/// two variables of one type that were added consecutively. If an update adds several such factors, odometry
/// is the one that fits the values best.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", deny_unknown_fields, default)]
#[schemars(rename = "Outliers")]
pub struct Outliers {
    /// Share of inliers that pass the test. Default: 0.99.
    pub probability: Probability,
    /// Largest information gain of a factor that is accepted without a second one that confirms it. The limit
    /// applies to equal numbers of accepted and rejected candidates; otherwise the logarithm of their ratio
    /// is added. A factor with a larger gain is hardly tested by the estimate. Default: 1.5. Unit: nats per
    /// residual row.
    pub max_information_gain: NotNegative,
    /// Types of factors that can be candidates. Default: all types.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub types: Vec<TypeName<dyn Factor>>,
}

impl Default for Outliers {
    fn default() -> Self {
        Self {
            probability: Probability::default(),
            max_information_gain: NotNegative::literal(1.5),
            types: vec![],
        }
    }
}

impl Default for SmootherSettings {
    fn default() -> Self {
        Self {
            relinearize_every: NonZeroUsize::MIN.saturating_add(9),
            relinearization_threshold: NotNegative::literal(0.1),
            wildfire_threshold: NotNegative::literal(0.01),
            immediate_relinearization_factor: NotNegative::literal(10.0),
            passes: 1,
            budget: None,
            window: None,
            outliers: None,
        }
    }
}

/// Deprecated names of the fields of [`SmootherSettings`].
const RENAMED_SETTINGS: [RenamedField; 3] = [
    RenamedField { old: "bend", new: "relinearization_threshold" },
    RenamedField { old: "deviation", new: "wildfire_threshold" },
    RenamedField { old: "urgent", new: "immediate_relinearization_factor" },
];

/// Deprecated names of the fields of [`Outliers`].
const RENAMED_OUTLIERS: [RenamedField; 1] = [RenamedField { old: "gain", new: "max_information_gain" }];

// `remote = "Self"` makes the derived functions inherent ones, so that old names can be replaced first
impl<'de> Deserialize<'de> for SmootherSettings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| {
            Ok(Box::new(read_renamed(node, &RENAMED_SETTINGS, |reader| Self::deserialize(reader))?))
        })
    }
}

impl Serialize for SmootherSettings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for Outliers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| {
            Ok(Box::new(read_renamed(node, &RENAMED_OUTLIERS, |reader| Self::deserialize(reader))?))
        })
    }
}

impl Serialize for Outliers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}
