//! Measurements of each object: its class, and its boxes after the filters.
//!
//! The filters, in this order: boxes without area, detections without an object and detections with a low
//! score are skipped. The class is fused from all remaining ones. Boxes cut by the border are dropped or lose
//! a side. If an object has several boxes in one image, the last one counts.
use crate::settings::{DetectionSettings, MapAnchor, RunSettings};
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, Camera};
use manifactor_recording::camera::MountedCamera;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::ellipse::ImageEllipse;
use manifactor_recording::fusion::{ClassFusion, FusedClass};
use manifactor_recording::measurement::Quantities;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{Detection, ObjectId, Sequence};
use std::sync::Arc;

/// A box of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectBox {
    /// Index of the frame in the sequence.
    pub frame: usize,
    /// The camera of the image.
    pub camera: Arc<MountedCamera>,
    /// The box, in pixels.
    pub bounding_box: BoundingBox,
    /// Sides inside the border, in the order xmin, ymin, xmax, ymax. Only these belong to the object.
    pub inside: [bool; 4],
    /// Further measurements of the detection.
    pub quantities: Quantities,
    /// Outline of the object in place of the box, if measured and not cut by the border.
    pub ellipse: Option<ImageEllipse>,
}

impl ObjectBox {
    /// Returns the frame and the index of the camera.
    pub fn image(&self) -> (usize, usize) {
        (self.frame, self.camera.index)
    }

    /// Returns the pose of its camera from the pose of its frame.
    pub fn camera_pose(&self, world_from_first: &Se3) -> Se3 {
        self.camera.pose(world_from_first)
    }
}

/// The measurements of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectMeasurements {
    /// Object id.
    pub id: ObjectId,
    /// The object in the prior map.
    pub prior: Option<Arc<PriorObject>>,
    fusion: ClassFusion,
    /// Number of detections associated with it.
    pub detections: usize,
    /// Its remaining boxes in the order of frames, then of cameras; at most one per image.
    pub views: Vec<ObjectBox>,
}

/// Measurements of all objects, and counts of unused detections.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurements {
    /// Sorted by id.
    pub objects: Vec<ObjectMeasurements>,
    /// Detections without an object.
    pub unassociated: usize,
    /// Boxes without width or height.
    pub without_area: usize,
    /// Detections with a score that is too low.
    pub low_score: usize,
    /// Boxes that were dropped because the border cuts them.
    pub cut: usize,
    /// Boxes that a later box of their object in their image replaced.
    pub duplicates: usize,
    /// Boxes that were removed because the ellipsoid of their object does not touch them.
    pub untouched: usize,
}

impl Measurements {
    /// Groups the detections of a sequence by object.
    pub fn gather(sequence: &Sequence, settings: &RunSettings) -> Self {
        let mut all = Self::new(settings.anchor());
        for detection in &sequence.detections {
            all.add_detection(detection, &settings.detections, &settings.aliases);
        }
        all
    }

    /// Starts with the objects of the prior map, without detections.
    pub fn new(anchor: Option<MapAnchor<'_>>) -> Self {
        let known = anchor.map_or(&[][..], |anchor| &anchor.map.objects);
        Self { objects: known.iter().map(ObjectMeasurements::of_prior_object).collect(), ..Self::default() }
    }

    /// Adds a detection to its object.
    pub fn add_detection(
        &mut self,
        detection: &Detection,
        settings: &DetectionSettings,
        aliases: &ClassAliases,
    ) {
        let sifted = filter_detection(detection, settings);
        if let FilteredDetection::WithoutArea = sifted {
            self.without_area += 1;
            return;
        }
        let Some(id) = detection.object else {
            self.unassociated += 1;
            return;
        };
        if let FilteredDetection::LowScore = sifted {
            self.low_score += 1;
            return;
        }
        let place = self.object_index(id);
        let Some(object) = self.objects.get_mut(place) else { return };
        object.detections += 1;
        object.fusion.add(&detection.scores, aliases);
        match sifted {
            FilteredDetection::View(view) => self.duplicates += usize::from(object.add_box(view)),
            _ => self.cut += 1,
        }
    }

    /// Removes a detection that was assigned to `from`.
    pub fn remove_detection(
        &mut self,
        detection: &Detection,
        from: ObjectId,
        settings: &DetectionSettings,
        aliases: &ClassAliases,
    ) {
        let sifted = filter_detection(detection, settings);
        match sifted {
            FilteredDetection::WithoutArea => return,
            FilteredDetection::LowScore => {
                self.low_score = self.low_score.saturating_sub(1);
                return;
            }
            FilteredDetection::Cut | FilteredDetection::View(_) => {}
        }
        let Ok(place) = self.objects.binary_search_by_key(&from, |object| object.id) else { return };
        let object = &mut self.objects[place];
        object.detections = object.detections.saturating_sub(1);
        object.fusion.remove(&detection.scores, aliases);
        match sifted {
            FilteredDetection::View(view) => match object.views.iter().position(|own| *own == view) {
                Some(own) => drop(object.views.remove(own)),
                // a later box of its image has replaced it
                None => self.duplicates = self.duplicates.saturating_sub(1),
            },
            _ => self.cut = self.cut.saturating_sub(1),
        }
    }

    /// Removes an object; its detections become unassociated.
    pub fn remove_object(&mut self, id: ObjectId) {
        if let Ok(place) = self.objects.binary_search_by_key(&id, |object| object.id) {
            self.unassociated += self.objects.remove(place).detections;
        }
    }

    /// Merges the measurements of one object into a second one, and returns the boxes that are new to it. If
    /// both have a box in a frame, the second object keeps its own.
    pub fn merge_objects(&mut self, from: ObjectId, into: ObjectId) -> Vec<ObjectBox> {
        let Ok(place) = self.objects.binary_search_by_key(&from, |object| object.id) else { return vec![] };
        let gone = self.objects.remove(place);
        let place = self.object_index(into);
        let Some(object) = self.objects.get_mut(place) else { return vec![] };
        object.detections += gone.detections;
        object.fusion.add_all(gone.fusion);
        let seen =
            |view: &ObjectBox| object.views.binary_search_by_key(&view.image(), ObjectBox::image).is_ok();
        let (twice, new): (Vec<_>, Vec<_>) = gone.views.into_iter().partition(seen);
        self.duplicates += twice.len();
        for view in &new {
            object.add_box(view.clone());
        }
        new
    }

    /// Returns the object with this id.
    pub fn object(&self, id: ObjectId) -> Option<&ObjectMeasurements> {
        let place = self.objects.binary_search_by_key(&id, |object| object.id).ok()?;
        self.objects.get(place)
    }

    /// Returns the index of an object, which is created if it is new.
    fn object_index(&mut self, id: ObjectId) -> usize {
        let place = self.objects.binary_search_by_key(&id, |object| object.id);
        place.unwrap_or_else(|place| {
            self.objects.insert(place, ObjectMeasurements::new(id));
            place
        })
    }

    /// Returns the number of boxes after the filters.
    pub fn boxes(&self) -> usize {
        self.objects.iter().map(|object| object.views.len()).sum()
    }
}

/// The possible uses of a detection.
pub enum FilteredDetection {
    /// None: its box has no width or no height.
    WithoutArea,
    /// None: its score is too low.
    LowScore,
    /// Only the class of its object: the border cuts its box.
    Cut,
    /// Class and geometry of its object.
    View(ObjectBox),
}

/// Applies the filters to a detection.
pub fn filter_detection(detection: &Detection, settings: &DetectionSettings) -> FilteredDetection {
    if !detection.bounding_box.has_area() {
        return FilteredDetection::WithoutArea;
    }
    if detection.scores.best().is_some_and(|(_, score)| score < *settings.min_score) {
        return FilteredDetection::LowScore;
    }
    let bounding_box = detection.bounding_box;
    let Camera { width, height, .. } = detection.camera.model;
    let inside = bounding_box.sides_inside(width, height, *settings.border_px);
    if !settings.cut_sides.accepts(inside) {
        return FilteredDetection::Cut;
    }
    let (camera, quantities) = (detection.camera.clone(), detection.quantities.clone());
    // the moments of a mask change if the border cuts it
    let ellipse = detection.ellipse.filter(|_| inside == [true; 4]);
    let frame = detection.frame;
    FilteredDetection::View(ObjectBox { frame, camera, bounding_box, inside, quantities, ellipse })
}

impl ObjectMeasurements {
    fn new(id: ObjectId) -> Self {
        Self { id, prior: None, fusion: ClassFusion::default(), detections: 0, views: vec![] }
    }

    /// Creates the entry of an object of the prior map.
    fn of_prior_object(object: &Arc<PriorObject>) -> Self {
        Self { fusion: object.classes.clone(), prior: Some(object.clone()), ..Self::new(object.id) }
    }

    /// Returns its boxes in a frame, one for each camera that sees it.
    pub fn views_in(&self, frame: usize) -> &[ObjectBox] {
        let from = self.views.partition_point(|view| view.frame < frame);
        let until = self.views.partition_point(|view| view.frame <= frame);
        &self.views[from..until]
    }

    /// Adds a box. Returns whether it replaces an earlier box of its image.
    fn add_box(&mut self, view: ObjectBox) -> bool {
        let place = self.views.binary_search_by_key(&view.image(), ObjectBox::image);
        match place {
            Ok(place) => self.views[place] = view,
            Err(place) => self.views.insert(place, view),
        }
        place.is_ok()
    }

    /// Returns the fused class scores of its detections.
    pub fn classes(&self) -> &ClassFusion {
        &self.fusion
    }

    /// Returns the name of its class; `None` if no detection has one.
    pub fn class_name(&self) -> Option<&str> {
        self.fusion.leading().map(|(name, _)| name)
    }

    /// Returns its class; `None` if no detection has one.
    pub fn class(&self) -> Option<FusedClass> {
        self.fusion.best()
    }

    /// Returns the size of its smallest box that the border does not cut: the square root of its area, in pixels.
    /// Includes the prior map; `None` if unknown.
    pub fn least_px(&self) -> Option<f64> {
        let whole = self.views.iter().filter(|view| view.inside == [true; 4]);
        let seen = whole.map(|view| view.bounding_box.area().sqrt()).filter(|size| *size > 0.0);
        seen.chain(self.prior.as_ref().and_then(|prior| prior.least_px)).reduce(f64::min)
    }

    /// Returns the larger of the standard deviations of box width and height, in pixels; 0 without boxes.
    pub(crate) fn box_deviation(&self) -> f64 {
        let of = |size: fn(&BoundingBox) -> f64| {
            let sizes = self.views.iter().map(|view| size(&view.bounding_box));
            let n = self.views.len().max(1) as f64;
            let mean = sizes.clone().sum::<f64>() / n;
            (sizes.map(|s| (s - mean) * (s - mean)).sum::<f64>() / n).sqrt()
        };
        of(BoundingBox::width).max(of(BoundingBox::height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gravity::tests::sequence;
    use crate::settings::CutSides;
    use manifactor_graph::checked::{NotNegative, Share};
    use manifactor_recording::sequence::ClassScores;

    fn detection(frame: usize, object: u32, class: &str, score: f64, bounds: [f64; 4]) -> Detection {
        let (camera, bounding_box) = (sequence().cameras.first().clone(), BoundingBox::new(bounds).unwrap());
        Detection {
            frame,
            object: Some(ObjectId(object)).filter(|_| object > 0),
            ..Detection::new(camera, bounding_box, ClassScores::single(class, score))
        }
    }

    const INSIDE: [f64; 4] = [100.0, 100.0, 200.0, 150.0];
    const CUT: [f64; 4] = [10.0, 100.0, 200.0, 150.0];

    fn gather(detections: &[Detection], settings: &DetectionSettings) -> Measurements {
        let mut all = Measurements::default();
        for detection in detections {
            all.add_detection(detection, settings, &ClassAliases::default());
        }
        all
    }

    fn with(cut_sides: CutSides) -> DetectionSettings {
        DetectionSettings { border_px: NotNegative::literal(20.0), cut_sides, ..DetectionSettings::default() }
    }

    #[test]
    fn a_later_box_replaces_an_earlier_one_of_its_frame() {
        let later = [101.0, 100.0, 200.0, 150.0];
        let all = gather(
            &[detection(0, 1, "cup", 0.5, INSIDE), detection(0, 1, "cup", 0.5, later)],
            &with(CutSides::Drop),
        );
        assert_eq!(all.duplicates, 1);
        assert_eq!(all.objects[0].views.len(), 1);
        assert_eq!(all.objects[0].views[0].bounding_box.xmin, 101.0);
    }

    #[test]
    fn a_cut_box_votes_and_replaces_nothing() {
        let boxes = vec![detection(0, 1, "cup", 0.5, INSIDE), detection(0, 1, "bowl", 0.9, CUT)];
        let all = gather(&boxes, &with(CutSides::Drop));
        assert_eq!((all.cut, all.duplicates, all.boxes()), (1, 0, 1));
        assert_eq!(all.objects[0].class().unwrap().name, "bowl");
        assert_eq!(all.objects[0].detections, 2);
    }

    #[test]
    fn cut_sides_are_masked_or_kept_if_asked_for() {
        let mask = gather(&[detection(0, 1, "cup", 0.5, CUT)], &with(CutSides::Mask));
        assert_eq!(mask.objects[0].views[0].inside, [false, true, true, true]);
        let keep = gather(&[detection(0, 1, "cup", 0.5, CUT)], &with(CutSides::Keep));
        assert_eq!(keep.boxes(), 1);
        let whole = [0.0, 0.0, 640.0, 480.0];
        let nothing = gather(&[detection(0, 1, "cup", 0.5, whole)], &with(CutSides::Mask));
        assert_eq!((nothing.cut, nothing.boxes()), (1, 0));
    }

    #[test]
    fn strangers_and_doubtful_boxes_are_counted() {
        let settings = DetectionSettings { min_score: Share::literal(0.3), ..with(CutSides::Drop) };
        let all =
            gather(&[detection(0, 0, "cup", 0.9, INSIDE), detection(0, 2, "cup", 0.2, INSIDE)], &settings);
        assert_eq!((all.unassociated, all.low_score, all.objects.len()), (1, 1, 0));
    }

    #[test]
    fn deviation_is_that_of_the_worse_dimension() {
        let boxes = [[0.0, 0.0, 100.0, 50.0], [0.0, 0.0, 160.0, 50.0]];
        let boxes = boxes.iter().enumerate().map(|(i, b)| detection(i, 1, "cup", 0.5, *b));
        let boxes: Vec<_> = boxes.collect();
        let all = gather(&boxes, &with(CutSides::Keep));
        assert_eq!(all.objects[0].box_deviation(), 30.0);
    }
}
