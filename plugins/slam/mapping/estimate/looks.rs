//! How often objects were there to be seen, and were seen.
use crate::estimate::{Estimate, Landmark};
use crate::mapping::measurements::{Measured, ObjectBox};
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric};
use manifactor_recording::prior_map::Looks;
use manifactor_recording::sequence::ObjectId;
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

/// It should be seen again from where it was seen: from no other direction than this, in radians.
const NEAR: f64 = 0.26;

/// The looks at an object.
#[derive(Debug, Clone, Copy, Default)]
pub struct Looked {
    /// All looks.
    pub all: Looks,
    /// Those that began until it was seen last.
    pub before: Looks,
    /// Those since then from where it was seen; from anywhere, where no view says.
    pub since: usize,
}

/// The looks at an object so far, of which the last goes on.
#[derive(Default)]
struct Counted {
    looked: Looked,
    seen_from: Vec<Vector3<f64>>,
    is_seen: bool,
}

impl Counted {
    /// Begins another look.
    fn look(&mut self, views: &[ObjectBox], sight: &Sight) {
        self.looked.all.expected += 1;
        let is_near = || self.seen_from.iter().any(|seen| seen.angle(&sight.from) < NEAR);
        match views.last() {
            Some(last) if sight.frame <= last.frame => self.looked.before.expected += 1,
            Some(_) => self.looked.since += usize::from(is_near()),
            None => self.looked.since += 1,
        }
        self.is_seen = false;
    }

    /// Notes that the object is seen in the look that goes on.
    fn see(&mut self, from: Vector3<f64>) {
        if !self.is_seen {
            self.looked.all.seen += 1;
            self.looked.before.seen += 1;
            self.seen_from.push(from);
            self.is_seen = true;
        }
    }
}

/// The looks at each mapped object, by where it and the camera are estimated to be.
pub fn looks(estimate: &Estimate, border: f64) -> BTreeMap<ObjectId, Looked> {
    let measured = |id: ObjectId| estimate.mapping.measurements.object(id);
    let expected = |landmark: &Landmark<'_>| {
        let id = landmark.object.id;
        Expected::new(id, *landmark.quadric, measured(id).and_then(Measured::least_px))
    };
    let objects: Vec<Expected> = estimate.landmarks().iter().map(expected).collect();
    let trajectory = estimate.trajectory();
    let poses = trajectory.iter().enumerate().map(|(frame, at)| (frame, at.timestamp, at.pose));
    let mut all: BTreeMap<ObjectId, Counted> = BTreeMap::new();
    sights(&objects, poses, &estimate.sequence.camera, border, |sight| {
        let counted = all.entry(sight.id).or_default();
        let views = measured(sight.id).map_or(&[][..], |measured| &measured.views);
        if sight.begins {
            counted.look(views, &sight);
        }
        if views.binary_search_by_key(&sight.frame, |view| view.frame).is_ok() {
            counted.see(sight.from);
        }
    });
    all.into_iter().map(|(id, counted)| (id, counted.looked)).collect()
}

/// A frame in which an object is there to be seen.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    /// The object.
    pub id: ObjectId,
    /// Number of the frame.
    pub frame: usize,
    /// The camera.
    pub pose: Se3,
    /// The camera, from the object's centre.
    from: Vector3<f64>,
    /// Whether it is another look, and not the one that goes on.
    pub begins: bool,
}

/// Tells of all sights of objects from frames, each with its time stamp in seconds and its pose. An object is there to be seen where all of its outline is
/// in the image, `border` pixels from its sides, about as large at least as it was seen before, and nothing that is mapped hides it.
pub fn sights(
    objects: &[Expected],
    frames: impl Iterator<Item = (usize, f64, Se3)>,
    camera: &Camera,
    border: f64,
    mut tell: impl FnMut(Sight),
) {
    // when the look that goes on began, and from where
    let mut looks: BTreeMap<ObjectId, (f64, Vector3<f64>)> = BTreeMap::new();
    for (frame, seconds, pose) in frames {
        for (id, from) in in_view(objects, &pose, camera, border) {
            let goes_on = |(began, first): &(f64, Vector3<f64>)| {
                seconds - began < SECONDS && first.angle(&from) < ANGLE
            };
            let begins = !looks.get(&id).is_some_and(goes_on);
            if begins {
                looks.insert(id, (seconds, from));
            }
            tell(Sight { id, frame, pose, from, begins });
        }
    }
}

/// An object that may be there to be seen.
pub struct Expected {
    id: ObjectId,
    quadric: DualQuadric,
    /// An outline of less is too small to be seen, in square pixels.
    area: f64,
}

impl Expected {
    /// One whose smallest box had this size, in pixels: the root of its area.
    pub fn new(id: ObjectId, quadric: DualQuadric, least_px: Option<f64>) -> Self {
        Self { id, quadric, area: (FAR * least_px.unwrap_or_default()).powi(2) }
    }
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
