//! What is measured of each object: its class, and its boxes after the filters.
//!
//! In this order: boxes without area, detections of no object and of low score are left out; the class is fused from all others; boxes cut
//! by the border are dropped, or lose a side; of several boxes of an object in one frame the last stays.
use crate::settings::{Anchor, DetectionSettings, Settings};
use manifactor_quadric::{BoundingBox, Camera};
use manifactor_recording::class::Aliases;
use manifactor_recording::fusion::{FusedClass, Fusion};
use manifactor_recording::measurement::Quantities;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{Detection, ObjectId, Sequence};
use std::sync::Arc;

/// One box of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectBox {
    /// Place in the sequence's frames.
    pub frame: usize,
    /// The box, in pixels.
    pub bounding_box: BoundingBox,
    /// Which of its sides are the object's own, and not the border's: xmin, ymin, xmax, ymax.
    pub inside: [bool; 4],
    /// What is measured besides the box.
    pub quantities: Quantities,
}

/// One object.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Its number.
    pub id: ObjectId,
    /// What an earlier map has of it.
    pub prior: Option<Arc<PriorObject>>,
    fusion: Fusion,
    /// Detections that are associated with it.
    pub detections: usize,
    /// Its boxes that are left, one a frame at most, in order of frames.
    pub views: Vec<ObjectBox>,
}

/// Which boxes a sequence has of which objects.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurements {
    /// By number.
    pub objects: Vec<Measured>,
    /// Detections of no object.
    pub unassociated: usize,
    /// Boxes without width or height.
    pub without_area: usize,
    /// Detections that score too low.
    pub low_score: usize,
    /// Boxes that the border cuts, and that were dropped for it.
    pub cut: usize,
    /// Boxes that a later one of the same object in the same frame replaces.
    pub duplicates: usize,
}

impl Measurements {
    /// Sorts the detections of a sequence by object.
    pub fn gather(sequence: &Sequence, settings: &Settings) -> Self {
        let mut all = Self::new(settings.anchor());
        for detection in &sequence.detections {
            all.add(detection, &sequence.camera, &settings.detections, &settings.aliases);
        }
        all
    }

    /// Nothing but what an earlier map has.
    pub fn new(anchor: Option<Anchor<'_>>) -> Self {
        let known = anchor.map_or(&[][..], |anchor| &anchor.map.objects);
        Self { objects: known.iter().map(Measured::known).collect(), ..Self::default() }
    }

    /// Sorts one detection in.
    pub fn add(
        &mut self,
        detection: &Detection,
        camera: &Camera,
        settings: &DetectionSettings,
        aliases: &Aliases,
    ) {
        let sifted = sift(detection, camera, settings);
        if let Sifted::WithoutArea = sifted {
            self.without_area += 1;
            return;
        }
        let Some(id) = detection.object else {
            self.unassociated += 1;
            return;
        };
        if let Sifted::LowScore = sifted {
            self.low_score += 1;
            return;
        }
        let place = self.place(id);
        let Some(object) = self.objects.get_mut(place) else { return };
        object.detections += 1;
        object.fusion.add(&detection.scores, aliases);
        match sifted {
            Sifted::View(view) => self.duplicates += usize::from(object.see(view)),
            _ => self.cut += 1,
        }
    }

    /// Takes a detection back that was taken for one of an object.
    pub fn take_back(
        &mut self,
        detection: &Detection,
        from: ObjectId,
        camera: &Camera,
        settings: &DetectionSettings,
        aliases: &Aliases,
    ) {
        let sifted = sift(detection, camera, settings);
        match sifted {
            Sifted::WithoutArea => return,
            Sifted::LowScore => {
                self.low_score = self.low_score.saturating_sub(1);
                return;
            }
            Sifted::Cut | Sifted::View(_) => {}
        }
        let Ok(place) = self.objects.binary_search_by_key(&from, |object| object.id) else { return };
        let object = &mut self.objects[place];
        object.detections = object.detections.saturating_sub(1);
        object.fusion.take_back(&detection.scores, aliases);
        match sifted {
            Sifted::View(view) => match object.views.iter().position(|own| *own == view) {
                Some(own) => drop(object.views.remove(own)),
                // another box of its frame has taken its place
                None => self.duplicates = self.duplicates.saturating_sub(1),
            },
            _ => self.cut = self.cut.saturating_sub(1),
        }
    }

    /// Forgets an object: its boxes are of none.
    pub fn disown(&mut self, id: ObjectId) {
        if let Ok(place) = self.objects.binary_search_by_key(&id, |object| object.id) {
            self.unassociated += self.objects.remove(place).detections;
        }
    }

    /// Gives what is measured of one object to another, and returns the boxes that are new to it: of two boxes in one frame, its own
    /// stays.
    pub fn merge(&mut self, from: ObjectId, into: ObjectId) -> Vec<ObjectBox> {
        let Ok(place) = self.objects.binary_search_by_key(&from, |object| object.id) else { return vec![] };
        let gone = self.objects.remove(place);
        let place = self.place(into);
        let Some(object) = self.objects.get_mut(place) else { return vec![] };
        object.detections += gone.detections;
        object.fusion.add_all(gone.fusion);
        let seen = |view: &ObjectBox| object.views.binary_search_by_key(&view.frame, |own| own.frame).is_ok();
        let (twice, new): (Vec<_>, Vec<_>) = gone.views.into_iter().partition(seen);
        self.duplicates += twice.len();
        for view in &new {
            object.see(view.clone());
        }
        new
    }

    /// The object of this number.
    pub fn object(&self, id: ObjectId) -> Option<&Measured> {
        let place = self.objects.binary_search_by_key(&id, |object| object.id).ok()?;
        self.objects.get(place)
    }

    /// The place of an object, which may be a new one.
    fn place(&mut self, id: ObjectId) -> usize {
        let place = self.objects.binary_search_by_key(&id, |object| object.id);
        place.unwrap_or_else(|place| {
            self.objects.insert(place, Measured::new(id));
            place
        })
    }

    /// All boxes that are left.
    pub fn boxes(&self) -> usize {
        self.objects.iter().map(|object| object.views.len()).sum()
    }
}

/// What a detection is good for.
pub enum Sifted {
    /// For nothing: its box has no width or no height.
    WithoutArea,
    /// For nothing: it scores too low.
    LowScore,
    /// For the class of its object: the border cuts its box.
    Cut,
    /// For the object's place as well.
    View(ObjectBox),
}

/// Passes a detection through the filters.
pub fn sift(detection: &Detection, camera: &Camera, settings: &DetectionSettings) -> Sifted {
    if !detection.bounding_box.has_area() {
        return Sifted::WithoutArea;
    }
    if detection.scores.best().is_some_and(|(_, score)| score < *settings.min_score) {
        return Sifted::LowScore;
    }
    let bounding_box = detection.bounding_box;
    let inside = bounding_box.sides_inside(camera.width, camera.height, *settings.border_px);
    if !settings.cut_sides.accepts(inside) {
        return Sifted::Cut;
    }
    let quantities = detection.quantities.clone();
    Sifted::View(ObjectBox { frame: detection.frame, bounding_box, inside, quantities })
}

impl Measured {
    fn new(id: ObjectId) -> Self {
        Self { id, prior: None, fusion: Fusion::default(), detections: 0, views: vec![] }
    }

    /// One that an earlier map has.
    fn known(object: &Arc<PriorObject>) -> Self {
        Self { fusion: object.classes.clone(), prior: Some(object.clone()), ..Self::new(object.id) }
    }

    /// Its box in a frame, if there is one.
    pub fn view(&self, frame: usize) -> Option<&ObjectBox> {
        let place = self.views.binary_search_by_key(&frame, |view| view.frame).ok()?;
        self.views.get(place)
    }

    /// Adds a box; whether it takes the place of another of its frame.
    fn see(&mut self, view: ObjectBox) -> bool {
        let place = self.views.binary_search_by_key(&view.frame, |view| view.frame);
        match place {
            Ok(place) => self.views[place] = view,
            Err(place) => self.views.insert(place, view),
        }
        place.is_ok()
    }

    /// What all its detections took it for.
    pub fn classes(&self) -> &Fusion {
        &self.fusion
    }

    /// The name of its class; `None` where no detection named one.
    pub fn class_name(&self) -> Option<&str> {
        self.fusion.leading().map(|(name, _)| name)
    }

    /// Its class; `None` where no detection named one.
    pub fn class(&self) -> Option<FusedClass> {
        self.fusion.best()
    }

    /// The smallest size at which it was ever seen, in pixels: the root of a box's area; `None` where that is not known.
    pub fn least_px(&self) -> Option<f64> {
        let seen = self.views.iter().map(|view| view.bounding_box.area().sqrt()).filter(|size| *size > 0.0);
        seen.chain(self.prior.as_ref().and_then(|prior| prior.least_px)).reduce(f64::min)
    }

    /// The larger of the standard deviations of the boxes' widths and heights, in pixels; 0 for no box.
    pub fn box_deviation(&self) -> f64 {
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
        Detection {
            frame,
            object: Some(ObjectId(object)).filter(|_| object > 0),
            scores: ClassScores::single(class, score),
            bounding_box: BoundingBox::new(bounds).unwrap(),
            quantities: Quantities::NONE,
        }
    }

    const INSIDE: [f64; 4] = [100.0, 100.0, 200.0, 150.0];
    const CUT: [f64; 4] = [10.0, 100.0, 200.0, 150.0];

    fn gather(detections: &[Detection], settings: &DetectionSettings) -> Measurements {
        let camera = sequence().camera;
        let mut all = Measurements::default();
        for detection in detections {
            all.add(detection, &camera, settings, &Aliases::default());
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
