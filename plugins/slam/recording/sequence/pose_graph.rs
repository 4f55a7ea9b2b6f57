//! Measurements of poses besides odometry: loop closures, positions from satellites, markers, and corrected
//! poses of the SLAM system that provides the odometry.
use super::Frame;
use crate::keys::{is_pose_or_object, pose_key};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Direction, Factor, FactorEntry, Key, Manifold, Noise};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// Largest difference between a timestamp and that of the frame it means, in seconds. Sources that write
/// timestamps with milliseconds fit.
const MAX_TIME_DIFFERENCE_S: f64 = 1e-3;
/// A corrected pose between two frames is compared with an interpolated one if the frames are at most this far
/// apart, in seconds.
const MAX_FRAME_GAP_S: f64 = 1.0;

/// Changes of the pose graph that arrive with a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PoseGraphChanges {
    /// New factors. A factor with the id of an earlier one replaces it.
    pub factors: Vec<PoseFactor>,
    /// Ids of factors to remove.
    pub removed: Vec<String>,
    /// Poses of earlier frames as the source corrects them, `world_from_camera` in the odometry frame.
    pub corrected: Vec<StampedPose>,
}

/// A factor that involves poses of frames, which its source knows by their timestamps.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseFactor {
    /// Name by which a later frame can replace or remove the factor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The variables, in the order of the factor.
    pub keys: Vec<PoseFactorKey>,
    /// Type and parameters.
    pub factor: Arc<dyn Factor>,
    /// Noise of the residual.
    pub noise: Noise,
    /// Robust loss. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
}

/// A variable of a [`PoseFactor`].
#[derive(Debug, Clone, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum PoseFactorKey {
    /// The pose of the frame at this timestamp. Unit: seconds.
    Timestamp(f64),
    /// A variable of the run document.
    Key(Key),
}

/// Reason why a factor or a corrected pose cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseGraphError {
    /// No frame has this timestamp.
    #[error("there is no frame at {timestamp} s{}: give the timestamp of a frame that was accepted", nearest_frame(*nearest))]
    NoFrame {
        /// The timestamp, in seconds.
        timestamp: f64,
        /// Timestamp of the nearest frame, if there is any frame.
        nearest: Option<f64>,
    },
    /// The key of a pose or an object.
    #[error(
        "`{key}` may not be named here, because the numbers of poses and objects can change: give the timestamp of a \
         frame, or the key of a variable of the document"
    )]
    NumberedKey {
        /// The key.
        key: Key,
    },
    /// A corrected pose with an infinite number or NaN.
    #[error("the pose of the frame at {timestamp} s is not finite")]
    NotFinite {
        /// The timestamp, in seconds.
        timestamp: f64,
    },
    /// A factor needs the up direction, and nothing gives it.
    #[error("the up direction is unknown: give `up` in the factor, or `gravity` in the document")]
    NoUp,
    /// A factor without a pose or variable.
    #[error("`keys` is empty")]
    NoKeys,
}

fn nearest_frame(timestamp: Option<f64>) -> String {
    timestamp.map_or(String::new(), |at| format!(" (the nearest is at {at} s)"))
}

impl PoseFactor {
    /// Returns the factor between the poses of `frames` and other variables. `up` is the world's up direction, for factors
    /// that leave it open.
    ///
    /// # Errors
    /// If there is no such frame, a key is that of a pose or an object, or the up direction is needed and unknown.
    pub fn entry(&self, frames: &[Frame], up: Option<Direction>) -> Result<FactorEntry, PoseGraphError> {
        let key = |key: &PoseFactorKey| match key {
            PoseFactorKey::Timestamp(timestamp) => frame_at(frames, *timestamp).map(pose_key),
            PoseFactorKey::Key(key) if is_pose_or_object(key) => {
                Err(PoseGraphError::NumberedKey { key: key.clone() })
            }
            PoseFactorKey::Key(key) => Ok(key.clone()),
        };
        let keys: Vec<Key> = self.keys.iter().map(key).collect::<Result<_, _>>()?;
        if keys.is_empty() {
            return Err(PoseGraphError::NoKeys);
        }
        let leaves_up_open = self.factor.with_up(Direction::Z).is_some();
        let filled = match up {
            None if leaves_up_open => return Err(PoseGraphError::NoUp),
            known => known.and_then(|up| self.factor.with_up(up)).map(Arc::from),
        };
        let factor = filled.unwrap_or_else(|| self.factor.clone());
        let (noise, loss) = (self.noise.clone(), self.loss.clone());
        // the name distinguishes a factor between consecutive frames from odometry, which has none
        Ok(FactorEntry { keys, name: Some(self.label().into()), factor, noise, loss })
    }

    /// Returns the id, or else the name of the type.
    pub fn label(&self) -> &str {
        self.id.as_deref().unwrap_or_else(|| self.factor.typetag_name())
    }
}

/// Equal if they are written equally.
impl PartialEq for PoseFactor {
    fn eq(&self, other: &Self) -> bool {
        let written = |factor: &Self| serde_json::to_string(factor).ok();
        written(self).is_some_and(|text| Some(text) == written(other))
    }
}

impl Serialize for PoseFactorKey {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Timestamp(timestamp) => timestamp.serialize(serializer),
            Self::Key(key) => key.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for PoseFactorKey {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = PoseFactorKey;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the timestamp of a frame, or the key of a variable of the document")
            }
            fn visit_f64<E>(self, timestamp: f64) -> Result<PoseFactorKey, E> {
                Ok(PoseFactorKey::Timestamp(timestamp))
            }
            fn visit_u64<E>(self, timestamp: u64) -> Result<PoseFactorKey, E> {
                Ok(PoseFactorKey::Timestamp(timestamp as f64))
            }
            fn visit_i64<E>(self, timestamp: i64) -> Result<PoseFactorKey, E> {
                Ok(PoseFactorKey::Timestamp(timestamp as f64))
            }
            fn visit_str<E>(self, key: &str) -> Result<PoseFactorKey, E> {
                Ok(PoseFactorKey::Key(key.into()))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// Returns the index of the frame at a timestamp, up to a millisecond.
///
/// # Errors
/// If there is no such frame.
pub fn frame_at(frames: &[Frame], timestamp: f64) -> Result<usize, PoseGraphError> {
    let after = frames.partition_point(|frame| frame.timestamp < timestamp);
    let difference = |i: &usize| (frames[*i].timestamp - timestamp).abs();
    let around = (after.saturating_sub(1)..frames.len()).take(2);
    let nearest = around.min_by(|a, b| difference(a).total_cmp(&difference(b)));
    match nearest {
        Some(i) if difference(&i) <= MAX_TIME_DIFFERENCE_S => Ok(i),
        _ => Err(PoseGraphError::NoFrame { timestamp, nearest: nearest.map(|i| frames[i].timestamp) }),
    }
}

/// Returns the pose at a timestamp: of a frame, or between two frames at most a second apart.
fn pose_at(frames: &[Frame], timestamp: f64) -> Result<Se3, PoseGraphError> {
    let error = match frame_at(frames, timestamp) {
        Ok(frame) => return Ok(frames[frame].world_from_camera),
        Err(error) => error,
    };
    let after = frames.partition_point(|frame| frame.timestamp < timestamp);
    match after.checked_sub(1).map(|before| &frames[before..]) {
        Some([from, to, ..]) if to.timestamp - from.timestamp <= MAX_FRAME_GAP_S => {
            let stamped = |f: &Frame| StampedPose { timestamp: f.timestamp, pose: f.world_from_camera };
            Ok(stamped(from).interpolate(&stamped(to), timestamp))
        }
        _ => Err(error),
    }
}

/// Corrects odometry poses. A frame between two corrected poses gets an interpolated correction, a frame after
/// the last one the same correction. Frames before the first one stay. Returns the errors of poses that
/// belong to no frame.
///
/// A correction C acts from the left: the corrected pose is C X.
pub fn correct_frames(frames: &mut [Frame], corrected: &[StampedPose]) -> Vec<PoseGraphError> {
    let (mut corrections, mut errors) = (vec![], vec![]);
    // the last one counts if a pose is corrected twice
    for StampedPose { timestamp, pose } in corrected.iter().rev() {
        match pose_at(frames, *timestamp) {
            Ok(_) if !pose.is_finite() => errors.push(PoseGraphError::NotFinite { timestamp: *timestamp }),
            Ok(before) => {
                corrections
                    .push(StampedPose { timestamp: *timestamp, pose: pose.compose(&before.inverse()) });
            }
            Err(error) => errors.push(error),
        }
    }
    corrections.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
    corrections.dedup_by(|a, b| a.timestamp - b.timestamp <= MAX_TIME_DIFFERENCE_S);
    for frame in frames {
        let after = corrections.partition_point(|c| c.timestamp <= frame.timestamp + MAX_TIME_DIFFERENCE_S);
        let correction = match (after.checked_sub(1).map(|i| &corrections[i]), corrections.get(after)) {
            (None, _) => continue,
            (Some(from), Some(to)) => from.interpolate(to, frame.timestamp.max(from.timestamp)),
            (Some(last), None) => last.pose,
        };
        frame.world_from_camera = correction.compose(&frame.world_from_camera);
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use nalgebra::Vector3;

    fn frames() -> Vec<Frame> {
        let at = |i: u32| {
            let pose = Se3::new(So3::identity(), Vector3::new(f64::from(i), 0.0, 0.0));
            Frame::new(f64::from(i), pose)
        };
        (0..6).map(at).collect()
    }

    fn shifted(timestamp: f64, x: f64, y: f64) -> StampedPose {
        StampedPose { timestamp, pose: Se3::new(So3::identity(), Vector3::new(x, y, 0.0)) }
    }

    #[test]
    fn a_timestamp_means_the_frame_within_a_millisecond() {
        assert_eq!(frame_at(&frames(), 2.0004), Ok(2));
        assert_eq!(frame_at(&frames(), 1.9996), Ok(2));
        let error = frame_at(&frames(), 7.5).unwrap_err().to_string();
        assert!(error.contains("no frame at 7.5 s (the nearest is at 5 s)"), "{error}");
        assert!(frame_at(&[], 1.0).is_err() && frame_at(&frames(), f64::NAN).is_err());
    }

    #[test]
    fn frames_between_corrected_ones_are_interpolated_and_later_ones_follow() {
        let mut frames = frames();
        let corrected = [shifted(3.0, 3.0, 0.4), shifted(9.0, 0.0, 0.0), shifted(1.0, 1.0, 0.0)];
        let errors = correct_frames(&mut frames, &corrected);
        assert_eq!(errors, [PoseGraphError::NoFrame { timestamp: 9.0, nearest: Some(5.0) }]);
        let y: Vec<f64> = frames.iter().map(|frame| frame.world_from_camera.translation.y).collect();
        for (y, expected) in y.iter().zip([0.0, 0.0, 0.2, 0.4, 0.4, 0.4]) {
            assert!((y - expected).abs() < 1e-12, "{y} {expected}");
        }
        assert!(
            frames
                .iter()
                .zip(0..)
                .all(|(f, i)| (f.world_from_camera.translation.x - f64::from(i)).abs() < 1e-12)
        );
    }

    #[test]
    fn a_corrected_pose_between_frames_is_compared_with_an_interpolated_one() {
        let mut frames = frames();
        assert!(correct_frames(&mut frames, &[shifted(2.5, 2.5, 0.5)]).is_empty());
        let y: Vec<f64> = frames.iter().map(|frame| frame.world_from_camera.translation.y).collect();
        assert_eq!(y, [0.0, 0.0, 0.0, 0.5, 0.5, 0.5]);
    }

    #[test]
    fn the_last_correction_of_a_frame_counts() {
        let mut frames = frames();
        correct_frames(&mut frames, &[shifted(2.0, 2.0, 1.0), shifted(2.0, 2.0, 3.0)]);
        assert!((frames[2].world_from_camera.translation.y - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_factor_that_leaves_up_open_gets_that_of_the_world() {
        let read = |more: &str| {
            let factor = format!(r#"{{ "type": "heading_se3", "heading": 0.1{more} }}"#);
            let text = format!(r#"{{ "keys": [1.0], "factor": {factor}, "noise": {{ "sigma": 0.1 }} }}"#);
            serde_json::from_str::<PoseFactor>(&text).unwrap()
        };
        let down = Direction::new(-Vector3::y()).unwrap();
        let used = |factor: &PoseFactor, up| {
            let entry = factor.entry(&frames(), up)?;
            Ok(serde_json::to_value(&entry.factor).unwrap()["up"].clone())
        };
        let open = read("");
        assert_eq!(used(&open, Some(down)), Ok(serde_json::json!([0.0, -1.0, 0.0])));
        assert_eq!(used(&open, None), Err(PoseGraphError::NoUp));
        let given = read(r#", "up": [0.0, 0.0, 1.0]"#);
        assert_eq!(used(&given, Some(down)), Ok(serde_json::json!([0.0, 0.0, 1.0])));
        assert!(used(&given, None).is_ok());
    }

    #[test]
    fn keys_are_timestamps_or_names() {
        let read = |text: &str| serde_json::from_str::<Vec<PoseFactorKey>>(text);
        let keys = read(r#"[1.5, 2, "anchor"]"#).unwrap();
        let expected = [
            PoseFactorKey::Timestamp(1.5),
            PoseFactorKey::Timestamp(2.0),
            PoseFactorKey::Key("anchor".into()),
        ];
        assert_eq!(keys, expected);
        assert_eq!(serde_json::to_string(&keys).unwrap(), r#"[1.5,2.0,"anchor"]"#);
        assert!(read("[null]").unwrap_err().to_string().contains("the timestamp of a frame"));
    }
}
