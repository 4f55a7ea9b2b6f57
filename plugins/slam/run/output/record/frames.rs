//! Poses and boxes of each frame.
use super::drawn::RecordFrames;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::pose_key;
use manifactor_mapping::settings::EvaluationSettings;
use manifactor_metrics::{Alignment, Pairing, PosePair, Sim3, align, associate, relative_errors};
use manifactor_quadric::{BoundingBox, Camera, DualQuadric, Ellipsoid};
use manifactor_recording::sequence::ObjectId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One frame. Poses are `world_from_camera`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Timestamp. Unit: seconds.
    pub timestamp: f64,
    /// True pose, if it is known for this time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<Se3>,
    /// Pose from odometry alone.
    pub odometry: PoseRecord,
    /// Pose from the solver.
    pub estimate: PoseRecord,
    /// Boxes in the frame, with their objects.
    pub boxes: Vec<BoxRecord>,
}

/// A pose and its errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PoseRecord {
    /// The pose.
    pub pose: Se3,
    /// Absolute position error under the run's alignment. Unit: metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Error of the relative motion that ends here. Unit: metres, radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<[f64; 2]>,
}

/// A box of an object in one frame. Boxes are xmin, ymin, xmax, ymax in pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoxRecord {
    /// Number of the object.
    pub object: ObjectId,
    /// Box of the detector.
    pub measured: BoundingBox,
    /// Box around the outline of the estimated ellipsoid, if the ellipsoid is in front of the camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub projected: Option<[f64; 4]>,
    /// This outline as the points centre + x with xᵀΣ⁻¹x ≤ 1: u, v, and the entries uu, uv, vv of Σ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ellipse: Option<[f64; 5]>,
}

impl BoxRecord {
    /// Creates a box of an object, with the projection of the `estimate`: camera pose and object.
    pub fn new(
        object: ObjectId,
        measured: BoundingBox,
        estimate: Option<(&Se3, &DualQuadric)>,
        camera: &Camera,
    ) -> Self {
        let ellipsoid = estimate.map(|(pose, quadric)| Ellipsoid::in_camera_frame(pose, quadric));
        let ellipse = ellipsoid.filter(Ellipsoid::is_in_front).map(|e| e.outline(camera));
        Self {
            object,
            measured,
            projected: ellipse.map(|e| e.bounds()),
            ellipse: ellipse.map(|e| [e.centre.x, e.centre.y, e.xx, e.xy, e.yy]),
        }
    }
}

/// Errors of one trajectory, by timestamp.
#[derive(Default)]
struct PoseErrors {
    absolute: Vec<(f64, f64)>,
    relative: Vec<(f64, [f64; 2])>,
    truth: Vec<(f64, Se3)>,
}

/// Returns all frames, and the alignment of their errors.
pub(super) fn frames(
    estimate: &Estimate,
    settings: &EvaluationSettings,
    drawn: &RecordFrames,
) -> (Vec<FrameRecord>, Option<Alignment>) {
    let alignment = settings.alignments.first().copied().unwrap_or_default();
    let (before, after) = (estimate.odometry(), estimate.trajectory());
    let [odometry, estimated] =
        [&before, &after].map(|poses| PoseErrors::of(estimate, poses, alignment, settings));
    let any = odometry.is_some();
    let (odometry, estimated) = (odometry.unwrap_or_default(), estimated.unwrap_or_default());
    let mut boxes = boxes(estimate);
    let frames = before.iter().zip(&after).enumerate().map(|(i, (before, after))| FrameRecord {
        timestamp: after.timestamp,
        truth: entry_at(&odometry.truth, after.timestamp),
        odometry: odometry.tracked(before, &drawn.odometry),
        estimate: estimated.tracked(after, &drawn.estimate),
        boxes: boxes.remove(&i).unwrap_or_default(),
    });
    (frames.collect(), any.then_some(alignment))
}

impl PoseErrors {
    /// Returns the errors; `None` if there is no ground truth to compare with.
    fn of(
        estimate: &Estimate,
        poses: &[StampedPose],
        alignment: Alignment,
        settings: &EvaluationSettings,
    ) -> Option<Self> {
        let truth = estimate.sequence.ground_truth.as_ref()?;
        let pairs = associate(&truth.trajectory, poses, *settings.max_time_difference).ok()?;
        let (_, aligned) = align(&pairs, alignment).ok()?;
        let distance = |p: &PosePair| (p.timestamp, (p.truth.translation - p.estimate.translation).norm());
        let over = settings.relative_over.get();
        let relative = relative_errors(&aligned, over, Pairing::All).into_iter();
        let ends = aligned.iter().skip(over).map(|p| p.timestamp);
        Some(Self {
            absolute: aligned.iter().map(distance).collect(),
            relative: ends.zip(relative.map(|(metres, radians)| [metres, radians])).collect(),
            truth: pairs.iter().map(|p| (p.timestamp, p.truth)).collect(),
        })
    }

    fn tracked(&self, stamped: &StampedPose, drawn: &Sim3) -> PoseRecord {
        PoseRecord {
            pose: drawn.act_on_pose(&stamped.pose),
            error: entry_at(&self.absolute, stamped.timestamp),
            relative: entry_at(&self.relative, stamped.timestamp),
        }
    }
}

/// Returns the entry of a sorted list at a timestamp.
fn entry_at<T: Copy>(list: &[(f64, T)], timestamp: f64) -> Option<T> {
    let place = list.binary_search_by(|(own, _)| own.total_cmp(&timestamp)).ok()?;
    list.get(place).map(|(_, value)| *value)
}

/// Returns the boxes, by frame.
fn boxes(estimate: &Estimate) -> BTreeMap<usize, Vec<BoxRecord>> {
    let landmarks = estimate.landmarks();
    let quadrics: BTreeMap<ObjectId, &DualQuadric> =
        landmarks.iter().map(|landmark| (landmark.object.id, landmark.quadric)).collect();
    let mut boxes: BTreeMap<usize, Vec<BoxRecord>> = BTreeMap::new();
    for object in &estimate.mapping.measurements.objects {
        // the page shows the images of the first camera
        for view in object.views.iter().filter(|view| view.camera.index == 0) {
            let first = estimate.solution.values.get(pose_key(view.frame));
            let camera = first.ok().map(|pose: &Se3| view.camera_pose(pose));
            let seen = camera.as_ref().zip(quadrics.get(&object.id).copied());
            let seen = BoxRecord::new(object.id, view.bounding_box, seen, &view.camera.model);
            boxes.entry(view.frame).or_default().push(seen);
        }
    }
    boxes
}
