//! Simulated detections in each image.
use super::moves::Scene;
use super::occlusion::DepthImage;
use super::scene::SceneObject;
use super::solid::ImageBoxes;
use super::{SimulatedSource, catalogue, noise};
use manifactor_geometry::Se3;
use manifactor_recording::camera::MountedCamera;
use manifactor_recording::sequence::Detection;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::sync::Arc;

/// Random number streams of a detector's errors, and the errors that persist.
pub(super) struct DetectorErrors {
    boxes: Pcg64,
    mistakes: Pcg64,
    depths: Pcg64,
    /// For each object: the noise of its last box, and the seconds since then.
    lasting: Vec<([f64; 4], f64)>,
}

impl DetectorErrors {
    pub(super) fn draw(objects: usize, rng: &mut Pcg64) -> Self {
        let [boxes, mistakes, depths] = [(); 3].map(|()| Pcg64::from_rng(rng));
        Self::new(objects, boxes, mistakes, depths)
    }

    pub(super) fn new(objects: usize, boxes: Pcg64, mistakes: Pcg64, depths: Pcg64) -> Self {
        Self { boxes, mistakes, depths, lasting: vec![([0.0; 4], f64::INFINITY); objects] }
    }
}

/// Camera pose of an image, and its depth image if objects hide each other.
struct ImageView<'a> {
    camera: &'a Arc<MountedCamera>,
    pose: &'a Se3,
    depths: Option<DepthImage>,
}

impl SimulatedSource {
    /// Returns all boxes in the images of a camera, image by image. `poses` are those of the first camera. The first `errors` apply to objects in their first place, and the
    /// second to objects that have been moved.
    pub(super) fn detect(
        &self,
        scene: &Scene,
        camera: &Arc<MountedCamera>,
        poses: &[Se3],
        [mut before, mut after]: [DetectorErrors; 2],
        imagination: &mut Pcg64,
    ) -> Vec<Detection> {
        let classes: Vec<&str> = catalogue::KINDS.iter().map(|kind| kind.class).collect();
        let mut usual = vec![];
        for object in &scene.objects {
            let rng = &mut before.boxes;
            let (wrong, other) = (
                rng.random_bool(*self.detector.misclassified),
                noise::draw_different_class(&object.truth.class, &classes, rng),
            );
            usual.push(if wrong { other } else { object.truth.class.as_str() });
        }
        let mut detections = vec![];
        for (frame, pose) in poses.iter().map(|pose| camera.pose(pose)).enumerate() {
            let time = frame as f64 * *self.trajectory.interval;
            let there = (0..usual.len()).map(|i| scene.object_at(i, time));
            let solids = there.map(|o| (&o.solid, pose.between(&o.truth.world_from_object)));
            let depths = self.detector.occluded_by_objects.then(|| DepthImage::new(solids, &camera.model));
            let view = ImageView { camera, pose: &pose, depths };
            for (i, object) in scene.objects.iter().enumerate() {
                let class = (usual[i], classes.as_slice());
                // an object draws noise even after it has moved away, so that a move changes only its own
                // effect
                let mut seen = self.detect_object(i, object, &view, class, &mut before);
                if let Some(moved) = scene.moved_object(i, time) {
                    seen = self.detect_object(i, moved, &view, class, &mut after);
                }
                detections.extend(seen.map(|(assigned_to, detection)| Detection {
                    frame,
                    object: Some(scene.object_at(assigned_to, time).truth.id),
                    ..detection
                }));
            }
            for (bounding_box, scores) in self.detector.draw_false_boxes(&camera.model, &classes, imagination)
            {
                detections.push(Detection { frame, ..Detection::new(camera.clone(), bounding_box, scores) });
            }
        }
        detections
    }

    /// Simulates the detection of one object in frame 0, with the index of the object that it is assigned to; `None` if it is
    /// not detected. `usual` is the class that the detector usually reports.
    fn detect_object(
        &self,
        i: usize,
        object: &SceneObject,
        view: &ImageView<'_>,
        (usual, classes): (&str, &[&str]),
        DetectorErrors { boxes, mistakes, depths, lasting }: &mut DetectorErrors,
    ) -> Option<(usize, Detection)> {
        let objects = lasting.len();
        let (noise, seconds) = &mut lasting[i];
        *seconds += *self.trajectory.interval;
        let world_from_object = &object.truth.world_from_object;
        let ImageBoxes { whole, inside } =
            object.solid.boxes(world_from_object, &view.camera.model, view.pose)?;
        let left = view.depths.as_ref().map_or(Some((inside, 1.0)), |depths| depths.visible_part(i, inside));
        // a hidden object draws noise as well, so that a setting changes only its own effect
        let (seen, share) = left.unwrap_or((inside, 0.0));
        let visible = share * inside.area() / whole.area();
        let drawn = self.detector.draw_box(&seen, visible, &view.camera.model, (noise, *seconds), boxes);
        *seconds = 0.0;
        let scores = self.detector.draw_class(usual, classes, boxes);
        let taken_for = noise::draw_assigned_object(*self.detector.wrong_object, i, objects, mistakes);
        let away = view.pose.inverse().act(&world_from_object.translation).z;
        let quantities = self.detector.draw_measurements(away, depths);
        let outline = object.solid.outline(&view.pose.between(world_from_object), &view.camera.model);
        let ellipse = self.detector.draw_ellipse(outline, depths);
        let bounding_box = drawn.filter(|_| left.is_some())?;
        let detection = Detection::new(view.camera.clone(), bounding_box, scores);
        Some((taken_for, Detection { quantities, ellipse, ..detection }))
    }
}
