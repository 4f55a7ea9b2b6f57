//! Held-out boxes, compared with the boxes that the estimate predicts.
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::measurements::{FilteredDetection, ObjectBox, filter_detection};
use manifactor_mapping::mapping::{object_key, pose_key};
use manifactor_mapping::settings::{Holdout, RunSettings};
use manifactor_quadric::{BoundingBoxFactor, DualQuadric};
use manifactor_recording::sequence::{Detection, ObjectId};
use serde::Serialize;
use std::collections::BTreeMap;

/// Prediction errors of held-out boxes that pass the filters and show a mapped object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutReport {
    /// The holdout.
    pub holdout: Holdout,
    /// Number of boxes of objects that are not in the map.
    pub unmapped: usize,
    /// Mean intersection over union if boxes of objects that are not in the map count as 0. A map cannot
    /// improve it by leaving out difficult objects.
    pub iou_unmapped_as_zero: ClusteredMean,
    /// Result of all predicted boxes.
    pub all: Prediction,
    /// Results by class.
    pub classes: BTreeMap<String, Prediction>,
    /// Results by object, for paired comparisons of runs with the same holdout.
    pub objects: BTreeMap<ObjectId, ObjectPrediction>,
}

/// Predicted boxes of one object.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ObjectPrediction {
    /// Number of boxes.
    pub boxes: usize,
    /// Mean intersection over union; 0 if the object is not in the map.
    pub iou: f64,
}

/// Predicted boxes, compared with detected boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Prediction {
    /// Number of boxes.
    pub boxes: usize,
    /// Number of objects that the boxes show.
    pub objects: usize,
    /// Number of boxes without a predicted outline in view. Their intersection over union is 0, and they have
    /// no error in pixels.
    pub out_of_view: usize,
    /// Mean intersection over union, 0 to 1.
    pub iou: ClusteredMean,
    /// Mean over boxes of the root mean square error of their sides. Unit: pixels.
    pub pixels: ClusteredMean,
}

/// A mean with its standard error. Boxes of one object have similar errors, so objects are the independent
/// samples. `None` for a single object.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClusteredMean {
    /// The mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub error: Option<f64>,
}

/// Prediction of one box.
struct PredictedBox {
    object: ObjectId,
    iou: f64,
    pixels: Option<f64>,
}

impl HeldOutReport {
    pub(crate) fn new(estimate: &Estimate, held_out: &[Detection], settings: &RunSettings) -> Option<Self> {
        let holdout = settings.evaluation.holdout?;
        let (mut unmapped, mut all) = (vec![], vec![]);
        let mut classes: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for detection in held_out {
            let FilteredDetection::View(view) = filter_detection(detection, &estimate.detections) else {
                continue;
            };
            let Some(object) = detection.object else { continue };
            match predict_box(estimate, object, &view) {
                Some(predicted) => {
                    let class = estimate.mapping.measurements.object(object).and_then(|own| own.class_name());
                    classes.entry(class.unwrap_or("unknown").to_owned()).or_default().push(all.len());
                    all.push(predicted);
                }
                None => unmapped.push(PredictedBox { object, iou: 0.0, pixels: None }),
            }
        }
        let of_class = |places: Vec<usize>| Prediction::of(places.iter().filter_map(|i| all.get(*i)));
        let classes = classes.into_iter().map(|(class, places)| (class, of_class(places))).collect();
        let mut objects: BTreeMap<ObjectId, ObjectPrediction> = BTreeMap::new();
        for predicted in all.iter().chain(&unmapped) {
            let ObjectPrediction { boxes, iou } = objects.entry(predicted.object).or_default();
            *boxes += 1;
            *iou += (predicted.iou - *iou) / *boxes as f64;
        }
        Some(Self {
            holdout,
            objects,
            unmapped: unmapped.len(),
            iou_unmapped_as_zero: Prediction::of(all.iter().chain(&unmapped)).iou,
            all: Prediction::of(all.iter()),
            classes,
        })
    }
}

/// Predicts a box; `None` if the object is not in the map.
fn predict_box(estimate: &Estimate, object: ObjectId, view: &ObjectBox) -> Option<PredictedBox> {
    let values = &estimate.solution.values;
    let quadric = values.get::<DualQuadric>(object_key(object).as_str()).ok()?;
    let pose = values.get::<Se3>(pose_key(view.frame).as_str()).ok()?;
    let (bounding_box, model, camera) = (view.bounding_box, estimate.detections.model, view.camera.model);
    let pose = &view.camera_pose(pose);
    let outline = BoundingBoxFactor { bounding_box, camera, model }.predict(pose, quadric);
    let outline = outline.filter(|_| quadric.is_in_front_of(pose));
    let pixels = outline.map(|outline| {
        let off = outline.bounds().into_iter().zip(bounding_box.bounds()).map(|(a, b)| (a - b).powi(2));
        (off.sum::<f64>() / 4.0).sqrt()
    });
    Some(PredictedBox { object, iou: outline.map_or(0.0, |outline| outline.iou(&bounding_box)), pixels })
}

impl Prediction {
    fn of<'a>(boxes: impl Iterator<Item = &'a PredictedBox>) -> Self {
        let boxes: Vec<&PredictedBox> = boxes.collect();
        let by_object = |of: &dyn Fn(&PredictedBox) -> Option<f64>| {
            let mut objects: BTreeMap<ObjectId, Vec<f64>> = BTreeMap::new();
            for predicted in &boxes {
                objects.entry(predicted.object).or_default().extend(of(predicted));
            }
            objects.into_values().collect::<Vec<_>>()
        };
        let ious = by_object(&|predicted| Some(predicted.iou));
        Self {
            boxes: boxes.len(),
            objects: ious.len(),
            out_of_view: boxes.iter().filter(|predicted| predicted.pixels.is_none()).count(),
            iou: ClusteredMean::of(&ious),
            pixels: ClusteredMean::of(&by_object(&|predicted| predicted.pixels)),
        }
    }
}

impl ClusteredMean {
    /// Returns the mean of values that are grouped by object.
    fn of(objects: &[Vec<f64>]) -> Self {
        let n = objects.iter().map(Vec::len).sum::<usize>() as f64;
        let mean = objects.iter().flatten().sum::<f64>() / n;
        let squares: f64 = objects.iter().map(|own| own.iter().map(|x| x - mean).sum::<f64>().powi(2)).sum();
        let m = objects.len() as f64;
        Self { mean, error: (m > 1.0).then(|| (squares * m / (m - 1.0)).sqrt() / n) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_mean_counts_objects_and_not_boxes() {
        let alone = ClusteredMean::of(&[vec![0.5, 0.7]]);
        assert!((alone.mean - 0.6).abs() < 1e-12 && alone.error.is_none());
        let (few, many) =
            (ClusteredMean::of(&[vec![0.4], vec![0.8]]), ClusteredMean::of(&[vec![0.4; 50], vec![0.8; 50]]));
        assert!((few.mean - many.mean).abs() < 1e-12);
        assert!((few.error.unwrap() - many.error.unwrap()).abs() < 1e-12);
        // the standard error of a mean of two values
        assert!((few.error.unwrap() - 0.2).abs() < 1e-12);
    }
}
