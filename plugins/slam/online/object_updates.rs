//! Changes of the objects of a growing map, for programs that follow it.
use crate::Mapper;
use manifactor_graph::Manifold;
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use nalgebra::DMatrix;
use serde::Serialize;
use std::array::from_fn;
use std::collections::BTreeMap;

/// An object is reported again if its estimate moves by this tangent length: 1 mm, 1 mrad, or 0.1 % of a
/// semi-axis. Noise of the solver is far below.
const MIN_MOTION: f64 = 1e-3;

/// An object with its current state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectUpdate {
    /// Number of the object.
    pub id: ObjectId,
    /// State of the object.
    #[serde(flatten)]
    pub state: ObjectStatus,
    /// Class with the highest fused score.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// Number of boxes associated with it.
    pub boxes: usize,
}

/// The state of an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "state", rename_all = "lowercase")]
pub enum ObjectStatus {
    /// Detected, but without an estimate.
    Tentative,
    /// In the map.
    Mapped {
        /// Estimate in the map frame.
        quadric: DualQuadric,
        /// Covariance of the estimate in tangent order: rotation in rad and centre in m, both in the object's
        /// frame, then the logarithms of the semi-axes. `None` if a direction is undetermined.
        #[serde(skip_serializing_if = "Option::is_none")]
        covariance: Option<Box<[[f64; 9]; 9]>>,
    },
    /// One object together with an earlier or a later one. This number is not used again.
    Merged {
        /// Number of the object that has all boxes now.
        into: ObjectId,
    },
    /// No longer in the map.
    Removed,
}

/// Objects as they were reported last.
#[derive(Debug, Clone, Default)]
pub struct ObjectUpdates(BTreeMap<ObjectId, ReportedObject>);

#[derive(Debug, Clone, PartialEq)]
struct ReportedObject {
    class: Option<String>,
    /// `None` if the object was tentative.
    quadric: Option<DualQuadric>,
}

impl ReportedObject {
    fn differs_from(&self, now: &Self) -> bool {
        let is_moved = match (&self.quadric, &now.quadric) {
            (Some(before), Some(now)) => before.local(now).amax() > MIN_MOTION,
            (before, now) => before.is_some() != now.is_some(),
        };
        is_moved || self.class != now.class
    }
}

impl ObjectUpdates {
    /// Returns the objects that have changed since the last call, by number: new ones, those with a different
    /// class, state or estimate, and those that are gone.
    pub fn take(&mut self, mapper: &Mapper) -> Vec<ObjectUpdate> {
        let mut updates = vec![];
        let mut before = std::mem::take(&mut self.0);
        for (measured, quadric) in mapper.tracked_objects() {
            let now = ReportedObject { class: measured.class_name().map(str::to_owned), quadric };
            if before.remove(&measured.id).is_none_or(|before| before.differs_from(&now)) {
                updates.push(ObjectUpdate {
                    id: measured.id,
                    state: match quadric {
                        Some(quadric) => {
                            let covariance = mapper.object_covariance(measured.id);
                            let entries = |m: DMatrix<f64>| Box::new(from_fn(|r| from_fn(|c| m[(r, c)])));
                            ObjectStatus::Mapped { quadric, covariance: covariance.map(entries) }
                        }
                        None => ObjectStatus::Tentative,
                    },
                    class: now.class.clone(),
                    boxes: measured.views.len(),
                });
            }
            self.0.insert(measured.id, now);
        }
        for (id, ReportedObject { class, .. }) in before {
            let into = mapper.id_changes().current_id(id);
            let state = if into == id { ObjectStatus::Removed } else { ObjectStatus::Merged { into } };
            updates.push(ObjectUpdate { id, state, class, boxes: 0 });
        }
        updates.sort_by_key(|update| update.id);
        updates
    }
}
