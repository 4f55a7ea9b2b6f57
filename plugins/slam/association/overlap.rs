//! Boxes go to the objects that they overlap with most: what others do, to compare with.
use super::{Association, Associator, Image, Learned, Map, assignment};
use crate::input::class::Aliases;
use crate::input::prior_map::PriorObject;
use crate::input::sequence::{Detection, ObjectId};
use manifactor_geometry::Se3;
use manifactor_graph::checked::Share;
use manifactor_graph::register;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// By overlap with the box before, or with the outline of the object in the map, whatever the class (as quadricslam does).
///
/// Objects that are matched best in sum get the boxes; a box that overlaps with none enough begins an object.
///
/// ```toml
/// association = { type = "iou", least = 0.2 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Iou {
    /// Intersection over union, at least.
    pub least: Share,
    /// A box is compared with the one before for so many frames.
    pub frames: usize,
}

/// By overlap with the box before or with the outline in the map, within a class (as OA-SLAM does, without its points).
///
/// ```toml
/// association = { type = "projection", least = 0.3, visible = 0.3 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Projection {
    /// Intersection over union with the outline in the map, at least.
    pub least: Share,
    /// The same with the box before.
    pub least_before: Share,
    /// A box is compared with the one before for so many frames.
    pub frames: usize,
    /// The share of the outline that is inside of the image, at least.
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
    fn begin(&self, camera: Camera, aliases: &Aliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        let Self { least, frames } = *self;
        let rule = Projection { least, least_before: least, frames, visible: Share::literal(0.0) };
        Box::new(Overlap::new(rule, false, camera, aliases, known))
    }
}
register!(dyn Association, "iou", Iou);

#[typetag::serialize(name = "projection")]
impl Association for Projection {
    fn begin(&self, camera: Camera, aliases: &Aliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        Box::new(Overlap::new(self.clone(), true, camera, aliases, known))
    }
}
register!(dyn Association, "projection", Projection);

/// What both share.
#[derive(Debug)]
struct Overlap {
    rule: Projection,
    by_class: bool,
    camera: Camera,
    aliases: Aliases,
    objects: BTreeMap<ObjectId, Last>,
    next: u32,
}

/// An object when it was seen last.
#[derive(Debug)]
struct Last {
    /// Where; `None` where an earlier map has it.
    seen: Option<(usize, BoundingBox)>,
    class: Option<String>,
}

impl Overlap {
    fn new(
        rule: Projection,
        by_class: bool,
        camera: Camera,
        aliases: &Aliases,
        known: &[Arc<PriorObject>],
    ) -> Self {
        let last = |object: &Arc<PriorObject>| {
            let class = object.classes.leading().map(|(class, _)| class.to_owned());
            (object.id, Last { seen: None, class })
        };
        let objects: BTreeMap<_, _> = known.iter().map(last).collect();
        let next = objects.last_key_value().map_or(1, |(id, _)| id.0.saturating_add(1));
        Self { rule, by_class, camera, aliases: aliases.clone(), objects, next }
    }

    fn class(&self, detection: &Detection) -> Option<String> {
        detection.scores.best().map(|(class, _)| self.aliases.canonical(class))
    }

    /// The outline of an object in the image, if enough of it is inside.
    fn outline(&self, pose: Option<Se3>, quadric: Option<DualQuadric>) -> Option<BoundingBox> {
        let (pose, quadric) = (pose?, quadric?);
        let predict = |model| {
            // what was measured makes no difference to what is predicted
            let bounding_box = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 0.0, ymax: 0.0 };
            BoundingBoxFactor { bounding_box, camera: self.camera, model }.predict(&pose, &quadric)
        };
        let (all, inside) = (predict(BoxModel::Standard)?, predict(BoxModel::Truncated)?);
        (inside.area() >= *self.rule.visible * all.area()).then_some(inside)
    }
}

impl Associator for Overlap {
    fn associate(&self, image: &Image<'_>, map: &dyn Map) -> Vec<Option<ObjectId>> {
        let (pose, rule) = (map.pose(image.frame), &self.rule);
        let classes: Vec<_> = image.detections.iter().map(|d| self.class(d)).collect();
        let mut overlaps = vec![];
        for (column, (id, last)) in self.objects.iter().enumerate() {
            let before = last.seen.filter(|(frame, _)| frame + rule.frames >= image.frame).map(|(_, b)| b);
            let outline = self.outline(pose, map.object(*id));
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
        let matched = assignment::best(image.detections.len(), self.objects.len(), &overlaps);
        let known: Vec<ObjectId> = self.objects.keys().copied().collect();
        let mut new = (self.next..).map(ObjectId);
        matched.into_iter().map(|column| column.map(|column| known[column]).or_else(|| new.next())).collect()
    }

    fn learn(&mut self, image: &Image<'_>, names: &[Option<ObjectId>], map: &dyn Map) -> Learned {
        for (detection, id) in image.detections.iter().zip(names) {
            if let Some(id) = *id {
                let seen = Some((image.frame, detection.bounding_box));
                let class = self.class(detection);
                self.objects.insert(id, Last { seen, class });
                self.next = self.next.max(id.0.saturating_add(1));
            }
        }
        // what is in no map, and was not seen lately, is never found again
        let since = image.frame.saturating_sub(self.rule.frames);
        let is_recent = |last: &Last| last.seen.is_some_and(|(frame, _)| frame >= since);
        self.objects.retain(|id, last| is_recent(last) || map.object(*id).is_some());
        Learned::default()
    }
}
