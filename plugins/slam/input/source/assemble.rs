//! Frames and detections put together by time.
use super::SourceError;
use crate::input::sequence::{ClassScores, Detection, Frame, GroundTruth, ObjectId};
use manifactor_formats::tum::{StampedPose, Trajectory};
use manifactor_formats::{detections, tum};
use manifactor_quadric::BoundingBox;
use std::path::Path;

/// Frames, and the detections in them.
pub(super) type Matched = (Vec<Frame>, Vec<Detection>);

/// Reads odometry and detections; each detection goes to the frame nearest in time, if it is near enough. Detections
/// of images that the odometry does not cover are left out.
pub(super) fn read_matched(odometry: &Path, file: &Path, within: f64) -> Result<Matched, SourceError> {
    let frames = read_poses(odometry)?.into_iter();
    let frames = frames.map(|StampedPose { timestamp, pose }| Frame { timestamp, world_from_camera: pose });
    let frames: Vec<Frame> = frames.collect();
    let rows = detections::read(file)?;
    let mut matched = vec![];
    for row in &rows {
        if let Some(frame) = nearest(&frames, row.timestamp, within) {
            matched.push(detection(frame, row)?);
        }
    }
    if matched.is_empty() && !rows.is_empty() {
        let (file, odometry) = (file.to_owned(), odometry.to_owned());
        return Err(SourceError::NothingMatches { file, odometry, detections: rows.len(), within });
    }
    // stable: the order of a file decides between duplicates
    matched.sort_by_key(|detection| detection.frame);
    Ok((frames, matched))
}

/// The poses of a file; what had to be repaired is logged.
fn read_poses(file: &Path) -> Result<Vec<StampedPose>, SourceError> {
    let Trajectory { poses, moved, dropped } = tum::read(file)?;
    let (moved, dropped) = (moved.len(), dropped.len());
    if moved + dropped > 0 {
        tracing::warn!("{}: {moved} lines out of order, {dropped} time stamps twice", file.display());
    }
    Ok(poses)
}

/// The frame nearest in time, if it is near enough.
fn nearest(frames: &[Frame], timestamp: f64, within: f64) -> Option<usize> {
    let after = frames.partition_point(|frame| frame.timestamp < timestamp);
    let candidates = [after.checked_sub(1), Some(after)].into_iter().flatten();
    let away = candidates.filter_map(|i| Some((i, (frames.get(i)?.timestamp - timestamp).abs())));
    let nearest = away.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.filter(|(_, away)| *away <= within).map(|(i, _)| i)
}

fn detection(frame: usize, row: &detections::Detection) -> Result<Detection, SourceError> {
    let scores: ClassScores = match row.class_scores() {
        Ok(scores) => scores.into_iter().collect(),
        // the reader has checked them
        Err(_) => ClassScores::single(row.class_name.clone(), row.score),
    };
    Ok(Detection {
        frame,
        object: row.object_key.filter(|key| *key != 0).map(ObjectId),
        scores,
        bounding_box: BoundingBox { xmin: row.xmin, ymin: row.ymin, xmax: row.xmax, ymax: row.ymax },
    })
}

/// The ground truth that is named, or the one that lies there.
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
    use manifactor_geometry::Se3;

    fn frames() -> Vec<Frame> {
        [1.0, 2.0, 3.0].map(|timestamp| Frame { timestamp, world_from_camera: Se3::identity() }).into()
    }

    #[test]
    fn the_nearest_frame_is_taken_if_it_is_near() {
        assert_eq!(nearest(&frames(), 2.4, 0.5), Some(1));
        assert_eq!(nearest(&frames(), 2.6, 0.5), Some(2));
        assert_eq!(nearest(&frames(), 2.4, 0.3), None);
        assert_eq!(nearest(&frames(), 0.9, 0.2), Some(0));
        assert_eq!(nearest(&frames(), 9.0, 1.0), None);
        assert_eq!(nearest(&[], 1.0, 1.0), None);
    }
}
