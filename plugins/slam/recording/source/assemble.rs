//! Frames and detections, matched by time.
use super::interpolation::pose_at;
use super::{DetectionsFile, SourceError};
use crate::camera::MountedCamera;
use crate::measurement::{DepthMeasurement, Quantities};
use crate::recording::OBJECTS_FILE;
use crate::sequence::{
    ClassScores, Detection, DetectionsWithoutPose, Frame, GroundTruth, ObjectId, TrueObject, UnusedInput,
    remove_repeated,
};
use manifactor_config::{Document, Errors};
use manifactor_formats::detections::DetectionRow;
use manifactor_formats::tum;
use manifactor_formats::tum::{StampedPose, Trajectory};
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_quadric::BoundingBox;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames, their detections, and the detections without a frame.
pub(super) type MatchedDetections = (Vec<Frame>, Vec<Detection>, Vec<UnusedInput>);

/// Limits for matching detections with frames by time.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimeMatching {
    /// Largest time difference. Unit: seconds.
    pub within: NotNegative,
    /// Largest expected share of detections without a frame.
    pub without_pose: Share,
    /// Largest time between two poses, to interpolate between them. Unit: seconds.
    pub max_pose_gap: Option<Positive>,
}

impl TimeMatching {
    /// Returns the limit in seconds, and the name of its setting.
    fn limit(&self) -> (f64, &'static str) {
        match self.max_pose_gap {
            Some(gap) => (gap.get(), "max_pose_gap"),
            None => (*self.within, "max_time_difference"),
        }
    }
}

/// Returns the default: a tenth of the detections may lack an odometry pose, as at the beginning of a
/// recording.
pub(super) fn default_share() -> Share {
    Share::literal(0.1)
}

/// Returns whether a share is the default, which is not written, so that fingerprints of settings stay the
/// same.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
pub(super) fn is_default_share(share: &Share) -> bool {
    *share == default_share()
}

/// Reads odometry, and the detections of each camera, and [matches](match_by_time) them.
///
/// # Errors
/// Files that cannot be read, or detections that all lack a frame.
pub(super) fn read_matched(
    folder: &Path,
    odometry: &Path,
    files: &[(&DetectionsFile, &Arc<MountedCamera>)],
    by: TimeMatching,
) -> Result<MatchedDetections, SourceError> {
    let odometry = folder.join(odometry);
    let poses = read_poses(&odometry)?;
    let mut rows = vec![];
    for (file, camera) in files {
        rows.extend(file.read(folder, camera)?);
    }
    let first = files.first().map_or_else(PathBuf::new, |(file, _)| file.path(folder));
    let images: Vec<f64> = rows.iter().map(|(timestamp, _)| *timestamp).collect();
    match_by_time(&poses, images, rows, by, [&first, &odometry])
}

/// Assigns each detection to the frame nearest in time. Frames are the poses, or the images with an interpolated
/// pose. Detections without a frame near enough are left out. `from` names the origin of detections and poses.
///
/// # Errors
/// Detections that all lack a frame.
pub(super) fn match_by_time(
    poses: &[StampedPose],
    images: Vec<f64>,
    rows: Vec<(f64, Detection)>,
    by: TimeMatching,
    from: [&Path; 2],
) -> Result<MatchedDetections, SourceError> {
    let within = *by.within;
    let frames: Vec<Frame> = match by.max_pose_gap {
        Some(gap) => interpolated_frames(poses, images, gap.get()),
        None => poses.iter().map(|pose| Frame::new(pose.timestamp, pose.pose)).collect(),
    };
    let times: Vec<f64> = frames.iter().map(|frame| frame.timestamp).collect();
    let count = rows.len();
    let without = without_frame(&times, &rows, by);
    let closest = || {
        let times: Vec<f64> = poses.iter().map(|pose| pose.timestamp).collect();
        let away = |(at, _): &(f64, Detection)| nearest(&times, *at).map(|(_, away)| (*at, away));
        rows.iter().filter_map(away).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let is_matched = |at: f64| nearest(&times, at).filter(|(_, away)| *away <= within);
    if count > 0 && !rows.iter().any(|(at, _)| is_matched(*at).is_some()) {
        let [file, odometry] = from.map(Path::to_owned);
        let ((within, setting), nearest) = (by.limit(), closest());
        return Err(SourceError::NothingMatches {
            file,
            odometry,
            detections: count,
            within,
            setting,
            nearest,
        });
    }
    let merged = merged_images(&rows, |at| is_matched(at).map(|(frame, _)| frame));
    let matched = rows.into_iter().filter_map(|(at, detection)| {
        let (frame, _) = is_matched(at)?;
        Some(Detection { frame, ..detection })
    });
    let mut matched: Vec<Detection> = matched.collect();
    // stable, so that the order of the file decides between duplicates
    matched.sort_by_key(|detection| detection.frame);
    let mut unused: Vec<UnusedInput> = without.map(UnusedInput::WithoutPose).into_iter().collect();
    if merged > 0 {
        unused.push(UnusedInput::Recording(format!(
            "{merged} images have the same nearest pose as another image, and their boxes are taken for those of one image; \
             `source.max_pose_gap` gives each image a pose of its own, a smaller `source.max_time_difference` leaves them out"
        )));
    }
    let mut kept = Vec::with_capacity(matched.len());
    for boxes in matched.chunk_by(|a, b| a.frame == b.frame) {
        let mut boxes = boxes.to_vec();
        let repeated = remove_repeated(&mut boxes);
        let time = boxes.first().and_then(|first| times.get(first.frame)).copied().unwrap_or_default();
        unused.extend(repeated.into_iter().map(|places| UnusedInput::repeated(time, places)));
        kept.extend(boxes);
    }
    Ok((frames, kept, unused))
}

/// Returns the number of images that share their frame with an earlier image of their camera.
fn merged_images(rows: &[(f64, Detection)], frame: impl Fn(f64) -> Option<usize>) -> usize {
    let mut images: BTreeMap<(usize, &str), BTreeSet<u64>> = BTreeMap::new();
    for (at, detection) in rows {
        if let Some(frame) = frame(*at) {
            images.entry((frame, &detection.camera.name)).or_default().insert(at.to_bits());
        }
    }
    images.values().map(|times| times.len() - 1).sum()
}

/// Returns a frame for each image that lies between two poses.
fn interpolated_frames(poses: &[StampedPose], mut images: Vec<f64>, max_gap: f64) -> Vec<Frame> {
    images.sort_by(f64::total_cmp);
    images.dedup();
    let frame = |timestamp: f64| Some(Frame::new(timestamp, pose_at(poses, timestamp, max_gap).ok()?));
    images.into_iter().filter_map(frame).collect()
}

/// Returns a summary of the rows without a frame; `None` if there are none.
fn without_frame(
    times: &[f64],
    rows: &[(f64, Detection)],
    by: TimeMatching,
) -> Option<DetectionsWithoutPose> {
    let TimeMatching { within, without_pose: allowed, .. } = by;
    let away = |(at, _): &(f64, Detection)| Some((*at, nearest(times, *at)?.1));
    let far: Vec<(f64, f64)> = rows.iter().filter_map(away).filter(|(_, away)| *away > *within).collect();
    let nearest = far.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(DetectionsWithoutPose {
        rows: far.len(),
        of: rows.len(),
        allowed: *allowed,
        within: by.limit().0,
        is_interpolated: by.max_pose_gap.is_some(),
        nearest,
    })
}

/// Reads the poses of a file. Repairs are logged.
fn read_poses(file: &Path) -> Result<Vec<StampedPose>, SourceError> {
    let Trajectory { poses, moved, dropped } = tum::read(file)?;
    let (moved, dropped) = (moved.len(), dropped.len());
    if moved + dropped > 0 {
        tracing::warn!("{}: {moved} lines out of order, {dropped} time stamps twice", file.display());
    }
    Ok(poses)
}

/// Returns the index of the nearest of some times, which ascend, and its distance in seconds.
fn nearest(times: &[f64], timestamp: f64) -> Option<(usize, f64)> {
    let after = times.partition_point(|time| *time < timestamp);
    let candidates = [after.checked_sub(1), Some(after)].into_iter().flatten();
    let away = candidates.filter_map(|i| Some((i, (times.get(i)? - timestamp).abs())));
    away.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the detection of a row in an image of a camera, for frame 0.
pub(super) fn detection(row: &DetectionRow, camera: &Arc<MountedCamera>) -> Detection {
    let scores: ClassScores = match row.class_scores() {
        Ok(scores) => scores.into_iter().collect(),
        // cannot happen: the reader has checked the scores
        Err(_) => ClassScores::single(row.class_name.clone(), row.score),
    };
    let bounding_box = BoundingBox { xmin: row.xmin, ymin: row.ymin, xmax: row.xmax, ymax: row.ymax };
    Detection {
        object: row.object_key.filter(|key| *key != 0).map(ObjectId),
        quantities: row
            .depth
            .and_then(|depth| Positive::new(depth).ok())
            .map_or(Quantities::NONE, |depth| Quantities::one(DepthMeasurement(depth))),
        ..Detection::new(camera.clone(), bounding_box, scores)
    }
}

/// Reads the true objects from the named file, or from the file that `simulate` writes, if it exists.
pub(super) fn read_objects(folder: &Path, named: Option<&Path>) -> Result<Vec<TrueObject>, SourceError> {
    let file = folder.join(named.unwrap_or(Path::new(OBJECTS_FILE)));
    if named.is_none() && !file.is_file() {
        return Ok(vec![]);
    }
    let document = Document::open(&file)?;
    let errors = Errors::new();
    let objects = document.root().read::<Vec<TrueObject>>(&errors);
    let objects = errors.finish(objects)?;
    let is_sound = |object: &&TrueObject| object.half_extents.iter().all(|x| *x > 0.0 && x.is_finite());
    match objects.iter().find(|object| !is_sound(object)) {
        Some(object) => Err(SourceError::NoObject { file, object: object.id }),
        None => Ok(objects),
    }
}

/// Reads the ground truth from the named file, or from `groundtruth.txt` if it exists.
pub(super) fn read_ground_truth(
    folder: &Path,
    named: Option<&Path>,
) -> Result<Option<GroundTruth>, SourceError> {
    let usual = folder.join("groundtruth.txt");
    let file = match named {
        Some(name) => Some(folder.join(name)),
        None => usual.is_file().then_some(usual),
    };
    let trajectory = file.map(|file| read_poses(&file)).transpose()?;
    Ok(trajectory.map(|trajectory| GroundTruth { trajectory, objects: vec![] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Cameras;
    use manifactor_geometry::Se3;
    use manifactor_quadric::Camera;

    const TIMES: [f64; 3] = [1.0, 2.0, 3.0];

    #[test]
    fn the_nearest_time_is_taken_if_it_is_near() {
        let found =
            |timestamp| nearest(&TIMES, timestamp).map(|(frame, away)| (frame, (10.0 * away).round()));
        assert_eq!([found(2.4), found(2.6), found(0.9)], [Some((1, 4.0)), Some((2, 4.0)), Some((0, 1.0))]);
        assert_eq!(found(9.0), Some((2, 60.0)));
        assert_eq!(nearest(&[], 1.0), None);
    }

    #[test]
    fn images_that_share_a_pose_and_boxes_that_repeat_are_reported() {
        let poses = TIMES.map(|timestamp| StampedPose { timestamp, pose: Se3::identity() });
        let camera = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
        let camera = Cameras::from(camera).first().clone();
        let row = |time: f64, left: f64| {
            let sides = BoundingBox::new([left, 10.0, left + 50.0, 60.0]).unwrap();
            (time, Detection::new(camera.clone(), sides, ClassScores::single("cup", 0.5)))
        };
        let read = |rows: &[(f64, Detection)], within: f64| {
            let by = TimeMatching {
                within: NotNegative::new(within).unwrap(),
                without_pose: Share::new(1.0).unwrap(),
                max_pose_gap: None,
            };
            let images = rows.iter().map(|(time, _)| *time).collect();
            let (_, boxes, unused) =
                match_by_time(&poses, images, rows.to_vec(), by, [Path::new("a"), Path::new("b")]).unwrap();
            (boxes.len(), unused)
        };
        // three images at the first two poses, one of them with two boxes
        let rows = [row(0.9, 10.0), row(1.1, 20.0), row(1.1, 30.0), row(2.0, 10.0)];
        let (boxes, unused) = read(&rows, 0.2);
        assert_eq!(boxes, 4);
        let [UnusedInput::Recording(text)] = &unused[..] else { panic!("{unused:?}") };
        assert!(text.starts_with("1 images have the same nearest pose"), "{text}");
        assert_eq!(read(&rows[1..], 0.2), (3, vec![]));
        // the second one overlaps by 2/3, the last ones by 1 and 0.92
        let rows = [row(1.0, 10.0), row(1.0, 20.0), row(1.0, 10.0), row(1.0, 8.0)];
        let (boxes, unused) = read(&rows, 0.2);
        let repeated = |place: usize, overlap: &str| UnusedInput::Box {
            timestamp: 1.0,
            place,
            fault: format!("it shows what box 1 shows: the class is the same, and they overlap by {overlap}"),
        };
        assert_eq!((boxes, unused), (2, vec![repeated(3, "1.00"), repeated(4, "0.92")]));
    }
}
