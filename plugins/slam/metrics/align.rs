//! Alignment of an estimate with the ground truth.
use super::{MetricsError, PosePair};
use manifactor_geometry::{PointPairs, Se3, Sim3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Alignment of the estimated trajectory with the ground truth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// Rotation and translation with the least mean square distance of the positions.
    #[default]
    Se3,
    /// Rotation, translation and scale: for trajectories of unknown scale.
    Sim3,
    /// Transform that makes the first poses equal.
    FirstPose,
    /// No alignment.
    None,
}

impl Alignment {
    /// All alignments.
    pub const ALL: [Self; 4] = [Self::Se3, Self::Sim3, Self::FirstPose, Self::None];
}

/// Returns the transform `truth_from_estimate` of the alignment, and the pairs with aligned estimates.
///
/// # Errors
/// If there is no pair, or if the alignment fits positions and they lie on one line.
pub fn align(pairs: &[PosePair], kind: Alignment) -> Result<(Sim3, Vec<PosePair>), MetricsError> {
    let too_few = MetricsError::TooFew { what: "alignment", needed: 1, found: 0 };
    let first = pairs.first().ok_or(too_few)?;
    let points = PointPairs::new(pairs.iter().map(|p| (p.estimate.translation, p.truth.translation, 1.0)));
    let similarity = match kind {
        Alignment::None => Sim3::rigid(Se3::identity()),
        Alignment::FirstPose => Sim3::rigid(first.truth.compose(&first.estimate.inverse())),
        Alignment::Se3 => points.rigid(COLLINEAR_RATIO).ok_or(MetricsError::Degenerate)?,
        Alignment::Sim3 => points.similarity(COLLINEAR_RATIO).ok_or(MetricsError::Degenerate)?,
    };
    let aligned = |p: &PosePair| PosePair { estimate: similarity.act_on_pose(&p.estimate), ..*p };
    Ok((similarity, pairs.iter().map(aligned).collect()))
}

/// Singular value, relative to the largest, below which positions lie on one line: 0.3 mm on 300 m.
const COLLINEAR_RATIO: f64 = 1e-12;
