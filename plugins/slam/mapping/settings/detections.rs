use super::poses::{every_row, noise_of};
use manifactor_graph::Noise;
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_graph::loss::Loss;
use manifactor_quadric::BoxModel;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// `[detections]`: which boxes are used, and how.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DetectionSettings {
    /// Of a box: xmin, ymin, xmax, ymax, in pixels.
    #[serde(deserialize_with = "noise_of::<SIDES, _>")]
    pub noise: Noise,
    /// How much of a large error counts. Default: all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
    /// What of an object a box goes around.
    pub model: BoxModel,
    /// What becomes of a box with sides at the border.
    pub cut_sides: CutSides,
    /// Sides this near to the border count as cut, in pixels.
    pub border_px: NotNegative,
    /// Detections whose best class scores less are left out.
    pub min_score: Share,
    /// Standard deviation of depths, where the source has any, as a part of the depth. Default: 0.03.
    #[serde(skip_serializing_if = "is_usual")]
    pub depth_error: Positive,
}

/// What becomes of a box that the border of the image cuts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutSides {
    /// It is dropped.
    #[default]
    Drop,
    /// It keeps the sides that are not cut.
    Mask,
    /// It stays as it is: right with the truncated model.
    Keep,
}

impl CutSides {
    /// Returns whether a box with these of its sides inside of the image is used.
    pub fn accepts(self, inside: [bool; 4]) -> bool {
        match self {
            Self::Drop => inside.iter().all(|inside| *inside),
            Self::Mask => inside.iter().any(|inside| *inside),
            Self::Keep => true,
        }
    }
}

/// Of a depth, as a part of it, where a document does not say.
const DEPTH_ERROR: Positive = Positive::literal(0.03);

/// What is as usual is not written: sources without depths have it as well.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_usual(depth_error: &Positive) -> bool {
    *depth_error == DEPTH_ERROR
}

/// Rows of a box's residual.
const SIDES: usize = 4;

impl DetectionSettings {
    /// The noise of a box with these of its sides inside of the image.
    pub fn noise_of(&self, inside: [bool; 4]) -> Noise {
        match self.cut_sides {
            CutSides::Mask if inside.contains(&false) => self.noise.clone().observing(&inside),
            _ => self.noise.clone(),
        }
    }
}

impl Default for DetectionSettings {
    fn default() -> Self {
        Self {
            noise: every_row(20.0),
            loss: None,
            model: BoxModel::Standard,
            cut_sides: CutSides::Drop,
            border_px: NotNegative::literal(20.0),
            min_score: Share::literal(0.0),
            depth_error: DEPTH_ERROR,
        }
    }
}
