use manifactor_graph::checked::{NotNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// `[variance_components]`: estimates the noise of odometry and boxes from the data. The estimate replaces
/// the noise of `[odometry]` and `[detections]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VarianceSettings {
    /// Largest number of rounds. Each round estimates the noise and solves again.
    pub rounds: NonZeroUsize,
    /// Rounds end when no standard deviation changes by more than this share.
    pub tolerance: NotNegative,
    /// Boxes that share a noise; with `given`, boxes keep their given noise. The noises of several groups are
    /// shrunk towards each other, as far as their differences can be due to chance.
    pub boxes: BoxGroups,
    /// Lets the noise of a box grow with its width and height.
    pub size: bool,
    /// Models the errors of consecutive boxes of an object as correlated: a detector makes similar errors in
    /// image after image, and no ellipsoid has the outline of a chair. If τ is their integrated
    /// autocorrelation time, τ such boxes carry the information of one, so their standard deviation is √τ
    /// times as large.
    pub correlation: bool,
    /// Estimates the noise of the odometry. The given noise is used otherwise, with fewer than four
    /// objects, and for steps whose frame gives it.
    pub odometry: bool,
    /// Models odometry errors that turn about the observed scene, and not only about the camera.
    pub pivot: bool,
    /// A stream, and the data association of a batch, estimate the noise once from the frames of this time, or
    /// later if there are fewer than four objects. The estimate takes effect as much time later. Before it,
    /// the odometry keeps its poses, and the noise of boxes is 10 px. Unit: seconds.
    pub prefix_s: Positive,
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
            prefix_s: Positive::literal(5.0),
        }
    }
}

/// Groups of boxes that share a noise.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoxGroups {
    /// All boxes.
    #[default]
    All,
    /// The boxes of all objects of one class.
    Class,
    /// The boxes of one object.
    Object,
    /// No estimate: boxes keep their given noise.
    Given,
}
