use super::{Gravity, GravityError, MapFrame, first_frame};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Direction, register};
use manifactor_recording::sequence::Sequence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The up direction is the z axis of the ground truth.
///
/// The ground-truth pose nearest in time to the first frame moves the map into the frame of the ground truth,
/// as in the paper. Only for experiments, because a robot has no ground truth.
///
/// ```toml
/// gravity = { type = "ground_truth" }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "GroundTruthPose")]
pub struct GroundTruthGravity {
    /// Largest time difference between that pose and the first frame. Unit: seconds.
    pub max_time_difference: NotNegative,
}

impl Default for GroundTruthGravity {
    fn default() -> Self {
        Self { max_time_difference: NotNegative::literal(0.1) }
    }
}

#[typetag::serialize(name = "ground_truth")]
impl Gravity for GroundTruthGravity {
    fn locate(&self, sequence: &Sequence) -> Result<MapFrame, GravityError> {
        let first = first_frame(sequence)?;
        let away = |timestamp: f64| (timestamp - first.timestamp).abs();
        let truth = sequence.ground_truth.iter().flat_map(|truth| &truth.trajectory);
        let nearest = truth.min_by(|a, b| away(a.timestamp).total_cmp(&away(b.timestamp)));
        match nearest {
            Some(pose) if away(pose.timestamp) <= *self.max_time_difference => Ok(MapFrame {
                map_from_odometry: pose.pose.compose(&first.world_from_camera.inverse()),
                up: Some(Direction::Z),
            }),
            _ => Err(GravityError::NoGroundTruth {
                timestamp: first.timestamp,
                within: *self.max_time_difference,
                nearest: nearest.map(|pose| pose.timestamp),
            }),
        }
    }
}
register!(dyn Gravity, "ground_truth", GroundTruthGravity);

#[cfg(test)]
mod tests {
    use super::super::tests::{sequence, upright_camera, with_truth};
    use super::*;

    #[test]
    fn the_first_frame_comes_to_lie_on_its_true_pose() {
        let map = GroundTruthGravity::default().locate(&with_truth(10.05)).unwrap();
        assert_eq!(map.map_from_odometry, upright_camera());
        assert_eq!(map.up, Some(Direction::Z));
    }

    #[test]
    fn a_truth_of_another_time_is_refused() {
        let locate = |sequence| GroundTruthGravity::default().locate(&sequence).unwrap_err().to_string();
        assert!(locate(with_truth(12.0)).contains("the nearest is at 12 s"));
        assert!(locate(sequence()).contains("give the source a ground truth"));
    }
}
