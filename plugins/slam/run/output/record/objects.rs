//! Detections, estimate and ground truth of each object.
use super::drawn::RecordFrames;
use super::factors::{AppliedFactor, FactorStates};
use crate::output::report::object_errors;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::{MappedObject, Rejection};
use manifactor_metrics::Sim3;
use manifactor_quadric::{DualQuadric, LandmarkError};
use manifactor_recording::sequence::{ObjectId, TrueObject};
use serde::{Deserialize, Serialize};

/// One object: detected, true, or both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectRecord {
    /// Number of the object.
    pub id: ObjectId,
    /// Key in the graph.
    pub key: String,
    /// Class; `unknown` if no detection has one.
    pub class: String,
    /// Score of the class, averaged over the detections.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score: Option<f64>,
    /// Number of boxes that passed the filters.
    pub boxes: usize,
    /// Root mean square of the box residuals at the estimate. Unit: standard deviations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub box_rms: Option<f64>,
    /// Initial value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<DualQuadric>,
    /// Estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<DualQuadric>,
    /// True shape, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TrueCuboid>,
    /// Error of the estimate, if the true shape is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<LandmarkError>,
    /// Factors that semantic rules added.
    pub factors: Vec<AppliedFactor>,
    /// Rules of the object's class that were not applied, with the reason.
    pub left_out: Vec<String>,
    /// Reason why the object is not mapped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected: Option<String>,
}

/// Cuboid that encloses a true object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrueCuboid {
    /// Centre and axes.
    pub pose: Se3,
    /// Half extents along the axes. Unit: metres.
    pub half_extents: [f64; 3],
}

pub(super) fn objects(estimate: &Estimate, drawn: &RecordFrames, within: f64) -> Vec<ObjectRecord> {
    let truths = estimate.sequence.ground_truth.as_ref().map_or(&[][..], |truth| &truth.objects);
    let (errors, states) = (object_errors(estimate, within), FactorStates::of(estimate));
    let detected = estimate.mapping.objects.iter().map(|object| {
        let quadric = |values: &manifactor_graph::Values| {
            values.get::<DualQuadric>(&object.key).ok().map(|q| moved(q, &drawn.estimate))
        };
        ObjectRecord {
            id: object.id,
            key: object.key.to_string(),
            class: class(object),
            score: object.class.as_ref().map(|class| class.score),
            boxes: object.boxes,
            box_rms: states.box_rms(&object.key),
            initial: quadric(&estimate.mapping.values),
            estimate: quadric(&estimate.solution.values),
            truth: truths.iter().find(|truth| truth.id == object.id).map(TrueCuboid::of),
            error: errors.iter().find(|(id, _)| *id == object.id).map(|(_, error)| *error),
            factors: object.semantic_factors.iter().map(|a| states.applied(a, &object.key)).collect(),
            left_out: object.left_out.iter().map(|l| format!("{}: {}", l.factor, l.because)).collect(),
            rejected: object.rejected.as_ref().map(Rejection::to_string),
        }
    });
    // also true objects that were never detected
    let unseen = truths.iter().filter(|t| !estimate.mapping.objects.iter().any(|o| o.id == t.id));
    detected.chain(unseen.map(never_detected)).collect()
}

fn class(object: &MappedObject) -> String {
    object.class.as_ref().map_or("unknown", |class| class.name.as_str()).to_owned()
}

fn never_detected(truth: &TrueObject) -> ObjectRecord {
    ObjectRecord {
        id: truth.id,
        key: manifactor_mapping::mapping::object_key(truth.id).to_string(),
        class: truth.class.clone(),
        score: None,
        boxes: 0,
        box_rms: None,
        initial: None,
        estimate: None,
        truth: Some(TrueCuboid::of(truth)),
        error: None,
        factors: vec![],
        left_out: vec![],
        rejected: Some("it was never detected".to_owned()),
    }
}

fn moved(quadric: &DualQuadric, frame: &Sim3) -> DualQuadric {
    DualQuadric { pose: frame.act_on_pose(&quadric.pose), semi_axes: quadric.semi_axes * frame.scale }
}

impl TrueCuboid {
    fn of(truth: &TrueObject) -> Self {
        Self { pose: truth.world_from_object, half_extents: truth.half_extents.into() }
    }
}
