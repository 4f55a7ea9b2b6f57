//! Bringing an estimate into the frame of the truth.
use super::{MetricsError, PosePair};
use manifactor_geometry::{NearestRotation, Se3, So3, nearest_rotation};
use nalgebra::{Matrix3, Vector3};
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

/// y = scale · R x + t
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Factor of lengths.
    pub scale: f64,
    /// R
    pub rotation: So3,
    /// t
    pub translation: Vector3<f64>,
}

impl Similarity {
    /// Lengths as they are, then the pose.
    pub fn rigid(pose: Se3) -> Self {
        Self { scale: 1.0, rotation: pose.rotation, translation: pose.translation }
    }
    /// A point in the other frame.
    pub fn act(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.act(point) * self.scale + self.translation
    }
    /// A pose in the other frame: its position is scaled, its rotation is not.
    pub fn act_on_pose(&self, pose: &Se3) -> Se3 {
        Se3::new(self.rotation.compose(&pose.rotation), self.act(&pose.translation))
    }
}

/// `truth_from_estimate` of the best alignment of that kind, and the pairs with aligned estimates.
///
/// # Errors
/// Where there is no pair; for the best fit of positions, where they lie on one line.
pub fn align(pairs: &[PosePair], kind: Alignment) -> Result<(Similarity, Vec<PosePair>), MetricsError> {
    let too_few = MetricsError::TooFew { what: "alignment", needed: 1, found: 0 };
    let first = pairs.first().ok_or(too_few)?;
    let similarity = match kind {
        Alignment::None => Similarity::rigid(Se3::identity()),
        Alignment::FirstPose => Similarity::rigid(first.truth.compose(&first.estimate.inverse())),
        Alignment::Se3 => umeyama(pairs, false)?,
        Alignment::Sim3 => umeyama(pairs, true)?,
    };
    let aligned = |p: &PosePair| PosePair { estimate: similarity.act_on_pose(&p.estimate), ..*p };
    Ok((similarity, pairs.iter().map(aligned).collect()))
}

/// Share of the largest singular value below which positions lie on one line: 0.3 mm on 300 m.
const FLAT: f64 = 1e-12;

/// Umeyama, Least-Squares Estimation of Transformation Parameters Between Two Point Patterns, 1991,
/// equations 38 to 43.
fn umeyama(pairs: &[PosePair], with_scale: bool) -> Result<Similarity, MetricsError> {
    let n = pairs.len() as f64;
    let mean = |f: fn(&PosePair) -> Vector3<f64>| pairs.iter().map(f).sum::<Vector3<f64>>() / n;
    let (x_mean, y_mean) = (mean(|p| p.estimate.translation), mean(|p| p.truth.translation));
    let centred = pairs.iter().map(|p| (p.estimate.translation - x_mean, p.truth.translation - y_mean));
    let (mut variance, mut covariance) = (0.0, Matrix3::zeros());
    for (x, y) in centred {
        variance += x.norm_squared() / n;
        covariance += y * x.transpose() / n;
    }
    let NearestRotation { rotation, singular_values } = nearest_rotation(&covariance);
    // rank 1 or 0, to rounding: the rotation about a line is arbitrary
    if singular_values[1] <= FLAT * singular_values[0] {
        return Err(MetricsError::Degenerate);
    }
    let scale = if with_scale { singular_values.iter().sum::<f64>() / variance } else { 1.0 };
    let translation = y_mean - rotation.act(&x_mean) * scale;
    Ok(Similarity { scale, rotation, translation })
}
