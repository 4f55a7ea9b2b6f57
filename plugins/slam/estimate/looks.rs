//! How often objects were there to be seen, and were seen.
use crate::estimate::{Estimate, Landmark};
use crate::input::prior_map::Looks;
use crate::input::sequence::ObjectId;
use crate::mapping::measurements::Measured;
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Another look begins where an object is seen from another direction, in radians,
const ANGLE: f64 = 0.1;
/// or so many seconds later, when the detector errs in another way.
const SECONDS: f64 = 1.0;
/// An object of which others in front of it cover more than this share of its outline is hidden.
const HIDDEN: f64 = 0.2;
/// It is too far away to be seen where its outline is smaller than this part of the smallest box that it ever had, both by the roots of
/// their areas.
const FAR: f64 = 0.5;

/// The looks at an object so far, of which the last goes on.
struct Counted {
    looks: Looks,
    began: f64,
    from: Vector3<f64>,
    is_seen: bool,
}

/// The looks at each mapped object, by where it and the camera are estimated to be. It is there to be seen where all of its outline is in
/// the image, `border` pixels from its sides, about as large at least as it was seen before, and nothing that is mapped hides it.
pub(crate) fn looks(estimate: &Estimate, border: f64) -> BTreeMap<ObjectId, Looks> {
    let landmarks = estimate.landmarks();
    let expected = |landmark: &Landmark<'_>| {
        let measured = estimate.mapping.measurements.object(landmark.object.id);
        let least = measured.and_then(Measured::least_px).unwrap_or_default();
        Expected { id: landmark.object.id, quadric: *landmark.quadric, area: (FAR * least).powi(2) }
    };
    let objects: Vec<Expected> = landmarks.iter().map(expected).collect();
    let has_box = |id: ObjectId, frame: usize| {
        let measured = estimate.mapping.measurements.object(id);
        measured.is_some_and(|own| own.views.binary_search_by_key(&frame, |view| view.frame).is_ok())
    };
    let mut all: BTreeMap<ObjectId, Counted> = BTreeMap::new();
    for (frame, stamped) in estimate.trajectory().iter().enumerate() {
        for (id, from) in in_view(&objects, &stamped.pose, &estimate.sequence.camera, border) {
            let new = Counted { looks: Looks::default(), began: f64::NEG_INFINITY, from, is_seen: false };
            let counted = all.entry(id).or_insert(new);
            if stamped.timestamp - counted.began >= SECONDS || counted.from.angle(&from) >= ANGLE {
                counted.looks.expected += 1;
                (counted.began, counted.from, counted.is_seen) = (stamped.timestamp, from, false);
            }
            if !counted.is_seen && has_box(id, frame) {
                counted.looks.seen += 1;
                counted.is_seen = true;
            }
        }
    }
    all.into_iter().map(|(id, counted)| (id, counted.looks)).collect()
}

/// An object that may be there to be seen.
struct Expected {
    id: ObjectId,
    quadric: DualQuadric,
    /// An outline of less is too small to be seen, in square pixels.
    area: f64,
}

/// Objects that are there to be seen from a pose, with the directions from which they are.
fn in_view(objects: &[Expected], pose: &Se3, camera: &Camera, border: f64) -> Vec<(ObjectId, Vector3<f64>)> {
    let nothing = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 0.0, ymax: 0.0 };
    let factor = BoundingBoxFactor { bounding_box: nothing, camera: *camera, model: BoxModel::Standard };
    let outline = |object: &'_ Expected| {
        let Expected { id, quadric, area } = object;
        let outline = factor.predict(pose, quadric).filter(|_| quadric.is_in_front_of(pose))?;
        Some((*id, outline, pose.translation - quadric.centroid(), *area))
    };
    let outlines: Vec<_> = objects.iter().filter_map(outline).collect();
    let is_hidden = |own: &BoundingBox, from: &Vector3<f64>| {
        let nearer = outlines.iter().filter(|(_, _, other, _)| other.norm() < from.norm());
        let mut shares =
            nearer.filter_map(|(_, other, ..)| Some(own.intersection(other)?.area() / own.area()));
        shares.any(|share| share > HIDDEN)
    };
    let is_whole =
        |outline: &BoundingBox| outline.sides_inside(camera.width, camera.height, border) == [true; 4];
    let there = outlines.iter().filter(|(_, outline, from, area)| {
        outline.area() >= *area && is_whole(outline) && !is_hidden(outline, from)
    });
    there.map(|(id, _, from, _)| (*id, *from)).collect()
}
