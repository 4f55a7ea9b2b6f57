//! Data association by overlap: each box is assigned to the object that it overlaps most, as in other
//! systems.
use manifactor::geometry::Se3;
use manifactor::graph::checked::Share;
use manifactor::quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric};
use manifactor::slam::association::{
    Association, Associator, Corrections, FrameDetections, MapEstimate, best_assignment,
};
use manifactor::slam::class::ClassAliases;
use manifactor::slam::prior_map::PriorObject;
use manifactor::slam::sequence::{Detection, ObjectId};
use manifactor::{register, typetag};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Association by overlap with the last box of an object or with its outline in the map, for any class (as
/// in quadricslam).
///
/// The assignment maximizes the sum of overlaps. A box that overlaps too little with all objects begins a
/// new one.
///
/// ```toml
/// association = { type = "iou", least = 0.2 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Iou {
    /// Smallest intersection over union of a match.
    pub least: Share,
    /// Number of frames for which the last box of an object is compared.
    pub frames: usize,
}

/// Association by overlap within a class (as in OA-SLAM, without its points).
///
/// ```toml
/// association = { type = "projection", least = 0.3, visible = 0.3 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Projection {
    /// Smallest intersection over union with the outline in the map.
    pub least: Share,
    /// Smallest intersection over union with the last box.
    pub least_before: Share,
    /// Number of frames for which the last box of an object is compared.
    pub frames: usize,
    /// Smallest share of the outline inside the image.
    pub visible: Share,
}

impl Default for Iou {
    fn default() -> Self {
        Self { least: Share::literal(0.2), frames: 30 }
    }
}

impl Default for Projection {
    fn default() -> Self {
        Self {
            least: Share::literal(0.3),
            least_before: Share::literal(0.2),
            frames: 30,
            visible: Share::literal(0.3),
        }
    }
}

#[typetag::serialize(name = "iou")]
impl Association for Iou {
    fn create_associator(&self, aliases: &ClassAliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        let Self { least, frames } = *self;
        let rule = Projection { least, least_before: least, frames, visible: Share::literal(0.0) };
        Box::new(Overlap::new(rule, false, aliases, known))
    }
}
register!(dyn Association, "iou", Iou);

#[typetag::serialize(name = "projection")]
impl Association for Projection {
    fn create_associator(&self, aliases: &ClassAliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        Box::new(Overlap::new(self.clone(), true, aliases, known))
    }
}
register!(dyn Association, "projection", Projection);

/// The associator of [`Iou`] and [`Projection`].
#[derive(Debug)]
struct Overlap {
    rule: Projection,
    by_class: bool,
    aliases: ClassAliases,
    objects: BTreeMap<ObjectId, Last>,
    next: u32,
}

/// The last detection of an object.
#[derive(Debug)]
struct Last {
    /// Frame and box; `None` for an object of the prior map that is not detected yet.
    seen: Option<(usize, BoundingBox)>,
    class: Option<String>,
}

impl Overlap {
    fn new(rule: Projection, by_class: bool, aliases: &ClassAliases, known: &[Arc<PriorObject>]) -> Self {
        let last = |object: &Arc<PriorObject>| {
            let class = object.classes.best().map(|class| class.name);
            (object.id, Last { seen: None, class })
        };
        let objects: BTreeMap<_, _> = known.iter().map(last).collect();
        let next = objects.last_key_value().map_or(1, |(id, _)| id.0.saturating_add(1));
        Self { rule, by_class, aliases: aliases.clone(), objects, next }
    }

    fn class(&self, detection: &Detection) -> Option<String> {
        detection.scores.best().map(|(class, _)| self.aliases.canonical(class))
    }

    /// Outline of an object, if enough of it is inside the image of a camera.
    fn outline(
        &self,
        camera: Camera,
        pose: Option<Se3>,
        quadric: Option<DualQuadric>,
    ) -> Option<BoundingBox> {
        let (pose, quadric) = (pose?, quadric?);
        let predict = |model| {
            // the prediction does not depend on the measured box
            let bounding_box = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 0.0, ymax: 0.0 };
            BoundingBoxFactor { bounding_box, camera, model }.predict(&pose, &quadric)
        };
        let (all, inside) = (predict(BoxModel::Standard)?, predict(BoxModel::Truncated)?);
        (inside.area() >= *self.rule.visible * all.area()).then_some(inside)
    }
}

impl Associator for Overlap {
    fn associate(&self, image: &FrameDetections<'_>, map: &dyn MapEstimate) -> Vec<Option<ObjectId>> {
        let (pose, rule) = (map.pose(image.frame), &self.rule);
        // the recordings of the benchmarks have one camera
        let camera = image.detections.first().map(|detection| detection.camera.model);
        let classes: Vec<_> = image.detections.iter().map(|d| self.class(d)).collect();
        let mut overlaps = vec![];
        for (column, (id, last)) in self.objects.iter().enumerate() {
            let before = last.seen.filter(|(frame, _)| frame + rule.frames >= image.frame).map(|(_, b)| b);
            let outline = camera.and_then(|camera| self.outline(camera, pose, map.object(*id)));
            for (row, detection) in image.detections.iter().enumerate() {
                if self.by_class && classes[row] != last.class {
                    continue;
                }
                let with = |other: &Option<BoundingBox>, least: f64| {
                    other.map(|other| other.iou(&detection.bounding_box)).filter(|iou| *iou >= least)
                };
                let (before, outline) = (with(&before, *rule.least_before), with(&outline, *rule.least));
                let most = before.into_iter().chain(outline).reduce(f64::max);
                overlaps.extend(most.map(|iou| (row, column, iou)));
            }
        }
        let matched = best_assignment(image.detections.len(), self.objects.len(), &overlaps);
        let known: Vec<ObjectId> = self.objects.keys().copied().collect();
        let mut new = (self.next..).map(ObjectId);
        matched.into_iter().map(|column| column.map(|column| known[column]).or_else(|| new.next())).collect()
    }

    fn learn_from_frame(
        &mut self,
        image: &FrameDetections<'_>,
        names: &[Option<ObjectId>],
        map: &dyn MapEstimate,
    ) -> Corrections {
        for (detection, id) in image.detections.iter().zip(names) {
            if let Some(id) = *id {
                let seen = Some((image.frame, detection.bounding_box));
                let class = self.class(detection);
                self.objects.insert(id, Last { seen, class });
                self.next = self.next.max(id.0.saturating_add(1));
            }
        }
        // without an estimate in the map or a recent box, an object cannot match any later box
        let since = image.frame.saturating_sub(self.rule.frames);
        let is_recent = |last: &Last| last.seen.is_some_and(|(frame, _)| frame >= since);
        self.objects.retain(|id, last| is_recent(last) || map.object(*id).is_some());
        Corrections::default()
    }
}
