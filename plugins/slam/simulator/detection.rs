//! Simulated detections in each image.
use super::moves::Scene;
use super::occlusion::DepthImage;
use super::scene::SceneObject;
use super::solid::Boxes;
use super::{Simulated, catalogue, noise};
use manifactor_geometry::Se3;
use manifactor_quadric::BoundingBox;
use manifactor_recording::measurement::Quantities;
use manifactor_recording::sequence::{ClassScores, Detection};
use rand::RngExt;
use rand_pcg::Pcg64;

/// Random number streams of a detector's errors, and the errors that persist.
pub(super) struct Errors {
    boxes: Pcg64,
    mistakes: Pcg64,
    depths: Pcg64,
    /// For each object: the noise of its last box, and the seconds since then.
    lasting: Vec<([f64; 4], f64)>,
}

impl Errors {
    pub(super) fn new(objects: usize, boxes: Pcg64, mistakes: Pcg64, depths: Pcg64) -> Self {
        Self { boxes, mistakes, depths, lasting: vec![([0.0; 4], f64::INFINITY); objects] }
    }
}

/// Camera pose of an image, and its depth image if objects hide each other.
struct View<'a> {
    pose: &'a Se3,
    depths: Option<DepthImage>,
}

/// A box of an object, and the object that it is assigned to.
struct Seen {
    bounding_box: BoundingBox,
    scores: ClassScores,
    quantities: Quantities,
    taken_for: usize,
}

impl Simulated {
    /// Returns all boxes, image by image. The first `errors` apply to objects in their first place, and the
    /// second to objects that have been moved.
    pub(super) fn detect(
        &self,
        scene: &Scene,
        poses: &[Se3],
        [mut before, mut after]: [Errors; 2],
        imagination: &mut Pcg64,
    ) -> Vec<Detection> {
        let classes: Vec<&str> = catalogue::KINDS.iter().map(|kind| kind.class).collect();
        let mut usual = vec![];
        for object in &scene.objects {
            let rng = &mut before.boxes;
            let (wrong, other) = (
                rng.random_bool(*self.detector.misclassified),
                noise::another(&object.truth.class, &classes, rng),
            );
            usual.push(if wrong { other } else { object.truth.class.as_str() });
        }
        let mut detections = vec![];
        for (frame, pose) in poses.iter().enumerate() {
            let time = frame as f64 * *self.trajectory.interval;
            let there = (0..usual.len()).map(|i| scene.at(i, time));
            let solids = there.map(|o| (&o.solid, pose.between(&o.truth.world_from_object)));
            let depths = self.detector.occluded_by_objects.then(|| DepthImage::new(solids, &self.camera));
            let view = View { pose, depths };
            for (i, object) in scene.objects.iter().enumerate() {
                let class = (usual[i], classes.as_slice());
                // an object draws noise even after it has moved away, so that a move changes only its own
                // effect
                let mut seen = self.see(i, object, &view, class, &mut before);
                if let Some(moved) = scene.moved(i, time) {
                    seen = self.see(i, moved, &view, class, &mut after);
                }
                if let Some(Seen { bounding_box, scores, quantities, taken_for }) = seen {
                    let object = Some(scene.at(taken_for, time).truth.id);
                    detections.push(Detection { frame, object, scores, bounding_box, quantities });
                }
            }
            for (bounding_box, scores) in self.detector.imagine(&self.camera, &classes, imagination) {
                let quantities = Quantities::NONE;
                detections.push(Detection { frame, object: None, scores, bounding_box, quantities });
            }
        }
        detections
    }

    /// Simulates the detection of one object; `None` if it is not detected. `usual` is the class that the
    /// detector usually reports.
    fn see(
        &self,
        i: usize,
        object: &SceneObject,
        view: &View<'_>,
        (usual, classes): (&str, &[&str]),
        Errors { boxes, mistakes, depths, lasting }: &mut Errors,
    ) -> Option<Seen> {
        let objects = lasting.len();
        let (noise, seconds) = &mut lasting[i];
        *seconds += *self.trajectory.interval;
        let world_from_object = &object.truth.world_from_object;
        let Boxes { whole, inside } = object.solid.boxes(world_from_object, &self.camera, view.pose)?;
        let left = view.depths.as_ref().map_or(Some((inside, 1.0)), |depths| depths.left_of(i, inside));
        // a hidden object draws noise as well, so that a setting changes only its own effect
        let (seen, share) = left.unwrap_or((inside, 0.0));
        let visible = share * inside.area() / whole.area();
        let drawn = self.detector.draw(&seen, visible, &self.camera, (noise, *seconds), boxes);
        *seconds = 0.0;
        let scores = self.detector.classify(usual, classes, boxes);
        let taken_for = noise::mistaken(*self.detector.wrong_object, i, objects, mistakes);
        let away = view.pose.inverse().act(&world_from_object.translation).z;
        let quantities = self.detector.measure(away, depths);
        let bounding_box = drawn.filter(|_| left.is_some())?;
        Some(Seen { bounding_box, scores, quantities, taken_for })
    }
}
