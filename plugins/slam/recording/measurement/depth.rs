//! Distance of an object along the optical axis.
use super::{Innovation, Measurement, MeasurementSigmas, ResidualRows, UsualDepth};
use crate::register_measurement;
use manifactor_geometry::Se3;
use manifactor_graph::checked::Positive;
use manifactor_graph::{Factor, Residual};
use manifactor_quadric::{CentroidDepth, DualQuadric};
use nalgebra::SMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// Distance of the object's centre along the optical axis, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct DepthMeasurement(pub Positive);

impl Measurement for DepthMeasurement {
    fn name(&self) -> &'static str {
        "depth"
    }

    fn to_value(&self) -> Value {
        self.0.get().into()
    }

    fn factor(&self) -> Arc<dyn Factor> {
        Arc::new(CentroidDepth { depth: self.0 })
    }

    fn rows(&self) -> usize {
        1
    }

    fn deviations(&self, errors: &MeasurementSigmas, residual: &ResidualRows) -> ResidualRows {
        ResidualRows::repeat(errors.depth * (self.0.get() + residual[0]))
    }

    fn cost_of_new(&self, usual: &UsualDepth) -> f64 {
        usual.cost(self.0.get())
    }

    fn depth(&self) -> Option<f64> {
        Some(self.0.get())
    }

    fn turned(&self, cosine: f64) -> Option<Arc<dyn Measurement>> {
        Some(Arc::new(Self(Positive::new(self.0.get() / cosine).ok()?)))
    }

    // avoids allocations: data association calls it for every pair of a box and an object
    fn innovation(&self, pose: &Se3, object: &DualQuadric) -> Option<Innovation> {
        let mut jacobians = (SMatrix::zeros(), SMatrix::zeros());
        let factor = CentroidDepth { depth: self.0 };
        let residual = factor.linearize((pose, object), &[true; 2], &mut jacobians);
        let mut innovation = Innovation::none(1);
        innovation.residual[0] = residual.x;
        innovation.by_pose.set_row(0, &jacobians.0);
        innovation.by_object.set_row(0, &jacobians.1);
        Some(innovation)
    }
}

register_measurement!("depth", DepthMeasurement);
