use manifactor_graph::checked::NotNegative;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// `[variance_components]`: the noise of odometry and boxes, estimated from the data, whatever `[odometry]` and `[detections]` say of
/// it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VarianceSettings {
    /// Most estimates of the noise, each followed by a solve.
    pub rounds: NonZeroUsize,
    /// The last round is the one after which no standard deviation changes by more than this share.
    pub tolerance: NotNegative,
    /// Which boxes have a noise in common. Noises of several groups are drawn towards each other, as far as chance explains that they differ.
    pub boxes: BoxGroups,
    /// Whether the noise of a box may grow with its width and height.
    pub size: bool,
    /// Whether errors of consecutive boxes of an object are taken for correlated, as they are: a detector errs the same
    /// way in image after image, and no ellipsoid has the outline of a chair. τ such boxes say as much as one alone,
    /// τ their integrated autocorrelation time, so their standard deviation is √τ times as large.
    pub correlation: bool,
    /// Whether the noise of odometry is estimated; it stays as it is given, otherwise, and with fewer than four objects.
    pub odometry: bool,
    /// Whether odometry may err by turning about what the camera sees, and not only about the camera.
    pub pivot: bool,
}

impl Default for VarianceSettings {
    fn default() -> Self {
        let rounds = NonZeroUsize::MIN.saturating_add(9);
        Self {
            rounds,
            tolerance: NotNegative::literal(0.02),
            boxes: BoxGroups::All,
            size: false,
            correlation: true,
            odometry: true,
            pivot: true,
        }
    }
}

/// Which boxes have a noise in common.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoxGroups {
    /// All.
    #[default]
    All,
    /// Those of objects of one class.
    Class,
    /// Those of one object.
    Object,
    /// None: the noise of boxes stays as it is given.
    Given,
}
