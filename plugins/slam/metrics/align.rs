//! Bringing an estimate into the frame of the truth.
use super::{MetricsError, PosePair};
use manifactor_geometry::{PointPairs, Se3, Similarity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How an estimate is brought into the frame of the truth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// By the rotation and translation that bring the positions closest, in the mean square.
    #[default]
    Se3,
    /// By rotation, translation and scale: for trajectories whose scale is not known.
    Sim3,
    /// So that the first poses agree.
    FirstPose,
    /// Not at all.
    None,
}

impl Alignment {
    /// Each of them.
    pub const ALL: [Self; 4] = [Self::Se3, Self::Sim3, Self::FirstPose, Self::None];
}

/// `truth_from_estimate` of the best alignment of that kind, and the pairs with aligned estimates.
///
/// # Errors
/// If there is no pair; for the best fit of positions, where they lie on one line.
pub fn align(pairs: &[PosePair], kind: Alignment) -> Result<(Similarity, Vec<PosePair>), MetricsError> {
    let too_few = MetricsError::TooFew { what: "alignment", needed: 1, found: 0 };
    let first = pairs.first().ok_or(too_few)?;
    let points = PointPairs::new(pairs.iter().map(|p| (p.estimate.translation, p.truth.translation, 1.0)));
    let similarity = match kind {
        Alignment::None => Similarity::rigid(Se3::identity()),
        Alignment::FirstPose => Similarity::rigid(first.truth.compose(&first.estimate.inverse())),
        Alignment::Se3 => points.rigid(FLAT).ok_or(MetricsError::Degenerate)?,
        Alignment::Sim3 => points.similarity(FLAT).ok_or(MetricsError::Degenerate)?,
    };
    let aligned = |p: &PosePair| PosePair { estimate: similarity.act_on_pose(&p.estimate), ..*p };
    Ok((similarity, pairs.iter().map(aligned).collect()))
}

/// Share of the largest singular value below which positions lie on one line: 0.3 mm on 300 m.
const FLAT: f64 = 1e-12;
