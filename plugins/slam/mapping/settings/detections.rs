use super::poses::{every_row, noise_of};
use manifactor_graph::Noise;
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_graph::loss::Loss;
use manifactor_quadric::BoxModel;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// `[detections]`: selection, noise and loss of the bounding boxes.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DetectionSettings {
    /// Noise of the box sides xmin, ymin, xmax, ymax. Unit: pixels.
    #[serde(deserialize_with = "noise_of::<SIDES, _>")]
    pub noise: Noise,
    /// Robust loss. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
    /// Part of an object that its box encloses: the whole object, or the part inside the image.
    pub model: BoxModel,
    /// Treatment of boxes with sides at the image border: drop the box, mask its cut sides, or keep all
    /// sides.
    pub cut_sides: CutSides,
    /// Sides this close to the image border count as cut. Unit: pixels.
    pub border_px: NotNegative,
    /// Detections whose best class has a lower score are ignored.
    pub min_score: Share,
    /// Standard deviation of measured depths as a fraction of the depth, if the source has depths. Default:
    /// 0.03.
    #[serde(skip_serializing_if = "is_default_depth_error")]
    pub depth_error: Positive,
    /// Standard deviation of the centre and the semi-axes of ellipses, if the source has ellipses. Default: 5. Unit:
    /// pixels.
    #[serde(skip_serializing_if = "is_default_ellipse_error")]
    pub ellipse_error: Positive,
}

/// Treatment of a box that the image border cuts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutSides {
    /// Drop the box.
    #[default]
    Drop,
    /// Keep only the sides that are not cut.
    Mask,
    /// Keep the box unchanged. This is correct with the `truncated` model.
    Keep,
}

impl CutSides {
    /// Returns whether a box is used if these of its sides are inside the image.
    pub fn accepts(self, inside: [bool; 4]) -> bool {
        match self {
            Self::Drop => inside.iter().all(|inside| *inside),
            Self::Mask => inside.iter().any(|inside| *inside),
            Self::Keep => true,
        }
    }
}

/// Default standard deviation of depths, as a fraction of the depth.
const DEFAULT_DEPTH_ERROR: Positive = Positive::literal(0.03);

/// The default is not written, because sources without depths have this setting as well.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_default_depth_error(depth_error: &Positive) -> bool {
    *depth_error == DEFAULT_DEPTH_ERROR
}

/// Default standard deviation of ellipses. Unit: pixels.
const DEFAULT_ELLIPSE_ERROR: Positive = Positive::literal(5.0);

/// The default is not written, because sources without ellipses have this setting as well.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_default_ellipse_error(error: &Positive) -> bool {
    *error == DEFAULT_ELLIPSE_ERROR
}

/// Rows of a box residual.
const SIDES: usize = 4;

impl DetectionSettings {
    /// Returns the noise of a box with these of its sides inside the image.
    pub(crate) fn noise_of(&self, inside: [bool; 4]) -> Noise {
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
            depth_error: DEFAULT_DEPTH_ERROR,
            ellipse_error: DEFAULT_ELLIPSE_ERROR,
        }
    }
}
