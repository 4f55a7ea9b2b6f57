//! Opportunities to detect each object, and the detections among them.
use crate::estimate::{Estimate, LandmarkEstimate};
use crate::mapping::measurements::{ObjectBox, ObjectMeasurements};
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric};
use manifactor_recording::camera::Cameras;
use manifactor_recording::prior_map::DetectionCounts;
use manifactor_recording::sequence::ObjectId;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Change of the viewing direction at which a new opportunity begins, in radians.
const NEW_OPPORTUNITY_RAD: f64 = 0.1;
/// Time after which a new opportunity begins, in seconds: the detector errs differently by then.
const NEW_OPPORTUNITY_S: f64 = 1.0;
/// An object is occluded if a nearer object covers more than this share of its outline.
const MAX_OCCLUDED_SHARE: f64 = 0.2;
/// An object is too far away to be detected if its outline is smaller than this share of its smallest box so
/// far. Both sizes are square roots of areas.
const MIN_SIZE_SHARE: f64 = 0.5;

/// An object should be detected again from viewing directions within this angle of an earlier detection, in
/// radians.
const SAME_DIRECTION_RAD: f64 = 0.26;

/// Opportunities to detect an object.
#[derive(Debug, Clone, Copy, Default)]
pub struct DetectionOpportunities {
    /// All opportunities.
    pub all: DetectionCounts,
    /// Opportunities that began before the last detection.
    pub before: DetectionCounts,
    /// Later opportunities from a direction with an earlier detection.
    pub since: usize,
}

/// Opportunities so far. The last one continues.
#[derive(Default)]
struct OpportunityCounter {
    opportunities: DetectionOpportunities,
    seen_from: Vec<Vector3<f64>>,
    is_seen: bool,
}

impl OpportunityCounter {
    /// Starts a new opportunity.
    fn start_opportunity(&mut self, last_seen: Option<usize>, sight: &VisibleObject) {
        self.opportunities.all.expected += 1;
        let is_near = || self.seen_from.iter().any(|seen| seen.angle(&sight.from) < SAME_DIRECTION_RAD);
        match last_seen {
            Some(last) if sight.frame <= last => self.opportunities.before.expected += 1,
            Some(_) => self.opportunities.since += usize::from(is_near()),
            None => {}
        }
        self.is_seen = false;
    }

    /// Records a detection in the current opportunity.
    fn record_detection(&mut self, from: Vector3<f64>) {
        if !self.is_seen {
            self.opportunities.all.seen += 1;
            self.opportunities.before.seen += 1;
            self.seen_from.push(from);
            self.is_seen = true;
        }
    }
}

/// Returns the opportunities to detect each mapped object, from the estimated poses and objects.
pub fn count_opportunities(estimate: &Estimate, border: f64) -> BTreeMap<ObjectId, DetectionOpportunities> {
    let measured = |id: ObjectId| estimate.mapping.measurements.object(id);
    let expected = |landmark: &LandmarkEstimate<'_>| {
        let id = landmark.object.id;
        ExpectedObject::new(id, *landmark.quadric, measured(id).and_then(ObjectMeasurements::least_px))
    };
    let objects: Vec<ExpectedObject> = estimate.landmarks().iter().map(expected).collect();
    let trajectory = estimate.trajectory();
    let poses = trajectory.iter().enumerate().map(|(frame, at)| (frame, at.timestamp, at.pose));
    // only images of the whole object count as opportunities, so only whole boxes count as detections
    let is_whole = |view: &&ObjectBox| is_whole(&view.bounding_box, &view.camera.model, border);
    let images_of = |measured: &ObjectMeasurements| {
        let images = measured.views.iter().filter(is_whole).map(ObjectBox::image).collect();
        (measured.id, images)
    };
    let seen: BTreeMap<ObjectId, Vec<(usize, usize)>> =
        estimate.mapping.measurements.objects.iter().map(images_of).collect();
    let mut all: BTreeMap<ObjectId, OpportunityCounter> = BTreeMap::new();
    visit_visible_objects(&objects, poses, &estimate.sequence.cameras, border, |sight| {
        let counted = all.entry(sight.id).or_default();
        let images = seen.get(&sight.id).map_or(&[][..], Vec::as_slice);
        if sight.begins {
            counted.start_opportunity(images.last().map(|(frame, _)| *frame), &sight);
        }
        if images.binary_search(&(sight.frame, sight.camera)).is_ok() {
            counted.record_detection(sight.from);
        }
    });
    all.into_iter().map(|(id, counted)| (id, counted.opportunities)).collect()
}

/// A frame with a visible object.
#[derive(Debug, Clone, Copy)]
pub struct VisibleObject {
    /// The object.
    pub id: ObjectId,
    /// Number of the frame.
    pub frame: usize,
    /// Index of the camera.
    pub camera: usize,
    /// Pose of the camera, without the views of a wide lens.
    pub pose: Se3,
    /// Vector from the centre of the object to the camera.
    from: Vector3<f64>,
    /// True if a new opportunity begins here.
    pub begins: bool,
}

/// Calls `visit` for each visible object of each image of the frames (index, timestamp in seconds, pose). An object counts
/// as visible if its whole outline is at least `border` pixels inside the image, it is not much smaller than
/// its smallest box, and no mapped object occludes it.
pub fn visit_visible_objects(
    objects: &[ExpectedObject],
    frames: impl Iterator<Item = (usize, f64, Se3)>,
    cameras: &Cameras,
    border: f64,
    mut visit: impl FnMut(VisibleObject),
) {
    // start time and first direction of the current opportunity
    let mut current: BTreeMap<(ObjectId, usize), (f64, Vector3<f64>)> = BTreeMap::new();
    let images = frames.flat_map(|frame| cameras.iter().map(move |camera| (frame, camera)));
    for ((frame, seconds, pose), camera) in images {
        let pose = camera.pose(&pose);
        for (id, from) in in_view(objects, &pose, &camera.model, border) {
            let goes_on = |(began, first): &(f64, Vector3<f64>)| {
                seconds - began < NEW_OPPORTUNITY_S && first.angle(&from) < NEW_OPPORTUNITY_RAD
            };
            let begins = !current.get(&(id, camera.index)).is_some_and(goes_on);
            if begins {
                current.insert((id, camera.index), (seconds, from));
            }
            visit(VisibleObject { id, frame, camera: camera.index, pose, from, begins });
        }
    }
}

/// An object that may be visible.
pub struct ExpectedObject {
    id: ObjectId,
    quadric: DualQuadric,
    /// Smallest outline that counts as visible, in square pixels.
    area: f64,
}

impl ExpectedObject {
    /// Creates the entry of an object. `least_px` is the size of its smallest box: the square root of the
    /// area, in pixels.
    pub fn new(id: ObjectId, quadric: DualQuadric, least_px: Option<f64>) -> Self {
        Self { id, quadric, area: (MIN_SIZE_SHARE * least_px.unwrap_or_default()).powi(2) }
    }
}

/// Returns the objects that are visible from a pose, with the vectors from their centres to the camera.
fn in_view(
    objects: &[ExpectedObject],
    pose: &Se3,
    camera: &Camera,
    border: f64,
) -> Vec<(ObjectId, Vector3<f64>)> {
    let nothing = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 0.0, ymax: 0.0 };
    let factor = BoundingBoxFactor { bounding_box: nothing, camera: *camera, model: BoxModel::Standard };
    let outline = |object: &'_ ExpectedObject| {
        let ExpectedObject { id, quadric, area } = object;
        let outline = factor.predict(pose, quadric).filter(|_| quadric.is_in_front_of(pose))?;
        Some((*id, outline, pose.translation - quadric.centroid(), *area))
    };
    let outlines: Vec<_> = objects.iter().filter_map(outline).collect();
    let is_hidden = |own: &BoundingBox, from: &Vector3<f64>| {
        let nearer = outlines.iter().filter(|(_, _, other, _)| other.norm() < from.norm());
        let mut shares =
            nearer.filter_map(|(_, other, ..)| Some(own.intersection(other)?.area() / own.area()));
        shares.any(|share| share > MAX_OCCLUDED_SHARE)
    };
    let there = outlines.iter().filter(|(_, outline, from, area)| {
        outline.area() >= *area && is_whole(outline, camera, border) && !is_hidden(outline, from)
    });
    there.map(|(id, _, from, _)| (*id, *from)).collect()
}

/// Returns whether all sides of a box are at least `border` pixels inside the image.
fn is_whole(bounding_box: &BoundingBox, camera: &Camera, border: f64) -> bool {
    bounding_box.sides_inside(camera.width, camera.height, border) == [true; 4]
}
