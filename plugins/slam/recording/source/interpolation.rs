//! Poses at the times of images, between the poses of a source.
mod steps;

use super::SourceError;
use crate::sequence::pose_graph::PoseGraphChanges;
use crate::sequence::{Acceleration, Frame, Observation, UnusedInput};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::Manifold;
use std::collections::VecDeque;
use std::sync::Arc;
use steps::{GivenNoise, GivenSteps};

/// Reason why an image has no pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoPose {
    /// The image was taken before the first pose.
    Before,
    /// The image was taken after the last pose.
    After,
    /// The poses around the image are too far apart. Unit: seconds.
    Gap(f64),
}

/// Sources write timestamps with microseconds, so that equal gaps differ by this much. Unit: seconds.
const TIME_ROUNDING_S: f64 = 2e-6;

/// Returns the pose at a time, interpolated on SE(3) between neighbours that are at most `max_gap` seconds
/// apart. `poses` are sorted by time.
///
/// # Errors
/// If there are no such neighbours.
pub(super) fn pose_at(poses: &[StampedPose], timestamp: f64, max_gap: f64) -> Result<Se3, NoPose> {
    let after = poses.partition_point(|pose| pose.timestamp < timestamp);
    let to = poses.get(after).ok_or(NoPose::After)?;
    if to.timestamp == timestamp {
        return Ok(to.pose);
    }
    let from = after.checked_sub(1).and_then(|before| poses.get(before)).ok_or(NoPose::Before)?;
    let gap = to.timestamp - from.timestamp;
    if gap > max_gap + TIME_ROUNDING_S {
        return Err(NoPose::Gap(gap));
    }
    Ok(from.interpolate(to, timestamp))
}

/// A pose, an image, or both, as they arrive.
#[derive(Debug, Clone)]
pub(super) struct PoseOrImage {
    /// The image; without a pose, its frame has the identity.
    pub observation: Observation,
    pub has_pose: bool,
    pub is_image: bool,
}

/// An image may arrive this long after its time, and waits this long for a pose, in seconds.
const MAX_DELAY_S: f64 = 10.0;

/// Frames with interpolated poses. An image waits for the first pose after it. A pose without an image adds no
/// frame.
pub(super) struct InterpolatedFrames<I> {
    read: I,
    max_gap: f64,
    /// Poses of the last seconds, sorted by time.
    poses: Vec<StampedPose>,
    /// Images that wait for a pose, sorted by time.
    images: Vec<Observation>,
    given: GivenSteps,
    /// Timestamp of the last image that was released.
    last: Option<f64>,
    /// Data of poses without an image, for the next frame.
    accelerometer: Vec<Acceleration>,
    pose_graph: PoseGraphChanges,
    unused: Vec<UnusedInput>,
    ready: VecDeque<Result<Observation, SourceError>>,
}

impl<I: Iterator<Item = Result<PoseOrImage, SourceError>>> InterpolatedFrames<I> {
    /// Interpolates between poses that are at most `max_gap` seconds apart.
    pub(super) fn new(read: I, max_gap: f64) -> Self {
        Self {
            read,
            max_gap,
            poses: vec![],
            images: vec![],
            given: GivenSteps::default(),
            last: None,
            accelerometer: vec![],
            pose_graph: PoseGraphChanges::default(),
            unused: vec![],
            ready: VecDeque::new(),
        }
    }

    fn add(&mut self, PoseOrImage { mut observation, has_pose, is_image }: PoseOrImage) {
        let timestamp = observation.frame.timestamp;
        let pose = observation.frame.world_from_camera;
        if !(timestamp.is_finite() && pose.is_finite()) {
            // the map rejects it with the reason
            self.ready.push_back(Ok(observation));
            return;
        }
        self.correct_poses(&observation.pose_graph.corrected);
        self.take_noise(&mut observation, has_pose);
        if has_pose {
            let place = self.poses.partition_point(|before| before.timestamp < timestamp);
            match self.poses.get_mut(place).filter(|before| before.timestamp == timestamp) {
                Some(before) => before.pose = pose,
                None => self.poses.insert(place, StampedPose { timestamp, pose }),
            }
            // a later pose had a wrong timestamp, with which all images would seem to lie in a gap
            let late = self.poses.partition_point(|pose| pose.timestamp <= timestamp + MAX_DELAY_S);
            self.poses.truncate(late);
        }
        self.pose_graph.corrected.append(&mut observation.pose_graph.corrected);
        if is_image {
            let place = self.images.partition_point(|before| before.frame.timestamp <= timestamp);
            self.images.insert(place, observation);
        } else {
            self.keep_for_next(observation);
        }
        self.release(false);
        let oldest = self.images.first().map_or(timestamp, |image| image.frame.timestamp.min(timestamp));
        let old = self.poses.partition_point(|pose| pose.timestamp < oldest - MAX_DELAY_S);
        self.poses.drain(..old);
    }

    /// Takes the noise of the step from the last pose to that of a line.
    fn take_noise(&mut self, line: &mut Observation, has_pose: bool) {
        let Some(noise) = line.frame.odometry_noise.take() else { return };
        let Frame { timestamp, world_from_camera: pose, .. } = line.frame;
        let from = self.poses.last().map(|last| last.timestamp);
        let taken = match from.filter(|from| *from < timestamp) {
            _ if !has_pose => Err("it belongs to a line with a pose".to_owned()),
            Some(from) => self.given.push(from, StampedPose { timestamp, pose }, &noise),
            None if from.is_none() => Ok(()),
            None => Err("the pose comes after a later one".to_owned()),
        };
        if let Err(fault) = taken {
            line.unused.push(UnusedInput::PoseGraph { timestamp, field: "odometry_noise".into(), fault });
        }
    }

    /// Sets the pose of an image, and the noise of the step from the image before.
    fn set_pose(&mut self, image: &mut Observation, pose: Se3) {
        let frame = &mut image.frame;
        let timestamp = frame.timestamp;
        frame.world_from_camera = pose;
        let from = self.last.unwrap_or(f64::NEG_INFINITY);
        let given = self.given.take(from, &StampedPose { timestamp, pose });
        match given {
            GivenNoise::Whole(noise) => frame.odometry_noise = Some(Arc::new(noise)),
            GivenNoise::Partial if self.last.is_some() => {
                let fault = "some poses since the last image have none".to_owned();
                image.unused.push(UnusedInput::PoseGraph {
                    timestamp,
                    field: "odometry_noise".into(),
                    fault,
                });
            }
            GivenNoise::None | GivenNoise::Partial => {}
        }
        self.last = Some(timestamp);
    }

    /// Keeps the data of a line that becomes no frame.
    fn keep_for_next(&mut self, mut line: Observation) {
        self.pose_graph.factors.append(&mut line.pose_graph.factors);
        self.pose_graph.removed.append(&mut line.pose_graph.removed);
        self.accelerometer.append(&mut line.accelerometer);
        self.unused.append(&mut line.unused);
    }

    /// Moves the poses so far to the corrected odometry frame of the next ones.
    fn correct_poses(&mut self, corrected: &[StampedPose]) {
        let correction = |corrected: &StampedPose| {
            let before = pose_at(&self.poses, corrected.timestamp, self.max_gap).ok()?;
            Some((corrected.timestamp, corrected.pose.compose(&before.inverse())))
        };
        let newest = corrected.iter().filter_map(correction).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, correction)) = newest {
            for stamped in &mut self.poses {
                stamped.pose = correction.compose(&stamped.pose);
            }
            self.given.move_by(&correction);
        }
    }

    /// Releases the images that a later pose follows, those of one time as one, and images for which none has come; at the end, all. The first
    /// one gets the corrections that have arrived, the last one the factors.
    fn release(&mut self, is_end: bool) {
        let last = self.poses.last().map_or(f64::NEG_INFINITY, |pose| pose.timestamp);
        // the newest image may have a wrong timestamp
        let newest = self.images.iter().nth_back(1).map_or(last, |image| image.frame.timestamp);
        // an image at the time of the last pose waits: one of another camera may come at the same time
        let is_ready = |time: f64| time < last || time <= newest - MAX_DELAY_S;
        let ready = self.images.partition_point(|image| is_end || is_ready(image.frame.timestamp));
        let mut released: Vec<Result<Observation, SourceError>> = vec![];
        for mut image in self.images.drain(..ready).collect::<Vec<_>>() {
            let timestamp = image.frame.timestamp;
            match pose_at(&self.poses, timestamp, self.max_gap) {
                Ok(pose) => match released.last_mut() {
                    Some(Ok(before)) if before.frame.timestamp == timestamp => before.join(image),
                    _ => {
                        self.set_pose(&mut image, pose);
                        released.push(Ok(image));
                    }
                },
                Err(why) => {
                    let boxes = image.detections.len();
                    self.keep_for_next(image);
                    released.push(Err(SourceError::ImageWithoutPose { timestamp, boxes, why }));
                }
            }
        }
        if let Some(first) = released.iter_mut().flatten().next() {
            first.accelerometer.splice(..0, self.accelerometer.drain(..));
            first.pose_graph.corrected.append(&mut self.pose_graph.corrected);
            first.unused.append(&mut self.unused);
        }
        if let Some(last) = released.iter_mut().flatten().next_back() {
            last.pose_graph.factors.append(&mut self.pose_graph.factors);
            last.pose_graph.removed.append(&mut self.pose_graph.removed);
        }
        self.ready.extend(released);
    }
}

impl<I: Iterator<Item = Result<PoseOrImage, SourceError>>> Iterator for InterpolatedFrames<I> {
    type Item = Result<Observation, SourceError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(ready) = self.ready.pop_front() {
                return Some(ready);
            }
            match self.read.next() {
                Some(Ok(read)) => self.add(read),
                Some(Err(error)) => return Some(Err(error)),
                None if !self.images.is_empty() => self.release(true),
                None => {
                    let PoseGraphChanges { factors, removed, corrected } =
                        std::mem::take(&mut self.pose_graph);
                    let changes = factors.len() + removed.len() + corrected.len();
                    return (changes > 0).then_some(Err(SourceError::ChangesWithoutImage { changes }));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use manifactor_graph::Noise;
    use nalgebra::{Vector3, Vector6};

    fn stamped(timestamp: f64) -> StampedPose {
        StampedPose { timestamp, pose: Se3::exp(&(Vector6::new(0.1, 0.2, -0.1, 1.0, 0.5, 0.0) * timestamp)) }
    }

    #[test]
    fn a_constant_twist_is_interpolated_exactly() {
        let poses = [1.0, 1.2, 1.4].map(stamped);
        for timestamp in [1.0, 1.07, 1.2, 1.33, 1.4] {
            let found = pose_at(&poses, timestamp, 0.25).unwrap();
            assert!(stamped(timestamp).pose.local(&found).norm() < 1e-12, "{timestamp}");
        }
        assert!(matches!(pose_at(&poses, 0.9, 0.25), Err(NoPose::Before)));
        assert!(matches!(pose_at(&poses, 1.5, 0.25), Err(NoPose::After)));
        assert!(matches!(pose_at(&poses, 1.1, 0.1), Err(NoPose::Gap(gap)) if (gap - 0.2).abs() < 1e-12));
    }

    fn pose(timestamp: f64) -> Result<PoseOrImage, SourceError> {
        let position = Se3::new(So3::identity(), Vector3::new(timestamp, 0.0, 0.0));
        let mut observation = Observation::new(Frame::new(timestamp, position));
        observation.accelerometer.push(Acceleration { timestamp, acceleration: Vector3::z() });
        Ok(PoseOrImage { observation, has_pose: true, is_image: false })
    }

    fn image(timestamp: f64) -> Result<PoseOrImage, SourceError> {
        let observation = Observation::new(Frame::new(timestamp, Se3::identity()));
        Ok(PoseOrImage { observation, has_pose: false, is_image: true })
    }

    #[test]
    fn images_get_poses_in_order_of_time_and_others_are_reported() {
        let read = [
            image(0.5),
            pose(1.0),
            image(1.25),
            pose(2.0),
            image(1.5),
            image(1.75),
            pose(5.0),
            image(3.0),
            image(6.0),
        ];
        let frames = InterpolatedFrames::new(read.into_iter(), 1.0);
        let found: Vec<String> = frames
            .map(|frame| match frame {
                Ok(frame) => {
                    let x = frame.frame.world_from_camera.translation.x;
                    format!("{} {x} {}", frame.frame.timestamp, frame.accelerometer.len())
                }
                Err(SourceError::ImageWithoutPose { timestamp, why, .. }) => format!("{timestamp} {why:?}"),
                Err(error) => error.to_string(),
            })
            .collect();
        let expected = ["0.5 Before", "1.25 1.25 2", "1.5 1.5 0", "1.75 1.75 0", "3 Gap(3.0)", "6 After"];
        assert_eq!(found, expected);
    }

    #[test]
    fn the_noise_of_poses_between_images_is_that_of_the_step() {
        let noisy = |timestamp: f64, noise: Option<f64>| {
            let mut read = pose(timestamp).unwrap();
            read.observation.frame.odometry_noise = noise.map(|s| Arc::new(Noise::sigma(s).unwrap()));
            Ok(read)
        };
        let of = |read: Vec<Result<PoseOrImage, SourceError>>| {
            InterpolatedFrames::new(read.into_iter(), 1.0).map(Result::unwrap).collect::<Vec<_>>()
        };
        let read = (0..5).map(|i| noisy(f64::from(i), Some(0.1))).chain([image(0.5), image(3.5)]);
        let frames = of(read.collect());
        let noise = frames[1].frame.odometry_noise.as_ref().unwrap();
        assert!((noise.information_matrix(6).unwrap()[(0, 0)] - 1.0 / 0.03).abs() < 1e-6);
        let some = [noisy(0.0, None), noisy(1.0, Some(0.1)), image(0.5), noisy(2.0, None), image(1.5)];
        let frames = of(some.into());
        assert!(frames[1].frame.odometry_noise.is_none());
        assert!(
            matches!(&frames[1].unused[..], [UnusedInput::PoseGraph { field, .. }] if field == "odometry_noise")
        );
    }

    /// Returns the timestamps of frames, and of images without a pose as negative numbers.
    fn timestamps(read: impl IntoIterator<Item = Result<PoseOrImage, SourceError>>) -> Vec<f64> {
        let timestamp = |frame| match frame {
            Ok(Observation { frame, .. }) => frame.timestamp,
            Err(SourceError::ImageWithoutPose { timestamp, .. }) => -timestamp,
            Err(error) => panic!("{error}"),
        };
        InterpolatedFrames::new(read.into_iter(), 1.0).map(timestamp).collect()
    }

    #[test]
    fn images_do_not_wait_for_ever_for_a_pose() {
        let mut frames = InterpolatedFrames::new((0..).map(|i| image(f64::from(i))), 1.0);
        let first = frames.next().unwrap();
        assert!(matches!(first, Err(SourceError::ImageWithoutPose { timestamp: 0.0, .. })));
        assert_eq!(frames.images.len(), 11);
    }

    #[test]
    fn one_wrong_timestamp_costs_few_images() {
        let with = |wrong: Result<PoseOrImage, SourceError>| {
            let (before, after) =
                ([pose(1.0), image(1.5)], [pose(2.0), image(2.5), pose(3.0), image(3.5), pose(4.0)]);
            timestamps(before.into_iter().chain([wrong]).chain(after))
        };
        assert_eq!(with(pose(1e300)), [-1.5, 2.5, 3.5]);
        assert_eq!(with(image(1e300)), [1.5, 2.5, 3.5, -1e300]);
    }

    #[test]
    fn changes_of_an_image_without_a_pose_are_kept_and_those_after_the_last_image_reported() {
        let with_removed = |read: Result<PoseOrImage, SourceError>, id: &str| {
            let mut read = read.unwrap();
            read.observation.pose_graph.removed.push(id.into());
            Ok(read)
        };
        let read =
            [with_removed(image(0.5), "a"), pose(1.0), image(1.5), pose(2.0), with_removed(pose(3.0), "b")];
        let frames: Vec<_> = InterpolatedFrames::new(read.into_iter(), 1.0).collect();
        assert!(matches!(frames[0], Err(SourceError::ImageWithoutPose { .. })));
        assert_eq!(frames[1].as_ref().unwrap().pose_graph.removed, ["a"]);
        assert!(matches!(frames[2], Err(SourceError::ChangesWithoutImage { changes: 1 })));
        assert_eq!(frames.len(), 3);
    }
}
