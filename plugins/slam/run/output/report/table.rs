use super::{RunReport, VariantReport};
use serde::Serialize;

/// One variant as one row. Unknown values are left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VariantRow {
    /// Name of the variant.
    pub variant: String,
    /// Number of objects in the map.
    pub objects: usize,
    /// Number of boxes of these objects.
    pub boxes: usize,
    /// Number of semantic factors.
    pub semantic_factors: usize,
    /// Final cost ½ Σ ρ.
    pub final_cost: f64,
    /// Number of linearizations followed by a step.
    pub iterations: usize,
    /// True if the solve ended in a minimum.
    pub converged: bool,
    /// Alignment of the trajectories: the first that is configured.
    pub alignment: Option<String>,
    /// RMSE of positions from odometry alone. Unit: metres.
    pub odometry_ate: Option<f64>,
    /// RMSE of positions. Unit: metres.
    pub ate: Option<f64>,
    /// RMSE of the landmarks' positions. Unit: metres.
    pub position: Option<f64>,
    /// Mean Jaccard distance of the landmarks' shapes, 0 to 1.
    pub shape: Option<f64>,
    /// Mean Jaccard distance of the landmarks at their estimated poses, 0 to 1.
    pub quality: Option<f64>,
    /// Mean Jaccard distance of oriented cuboids around the landmarks and around the true objects, 0 to 1.
    pub volume: Option<f64>,
    /// Duration of the solve, including refinements. Unit: seconds.
    pub seconds: f64,
}

impl RunReport {
    /// Returns a row for each variant.
    pub fn table(&self) -> Vec<VariantRow> {
        self.variants.iter().map(VariantReport::row).collect()
    }
}

impl VariantReport {
    /// Returns this variant as a row.
    pub fn row(&self) -> VariantRow {
        let trajectory = self.trajectory.first();
        let landmarks = self.landmarks.map(|landmarks| landmarks.estimate);
        VariantRow {
            variant: self.name.clone(),
            objects: self.counts.objects,
            boxes: self.counts.boxes,
            semantic_factors: self.counts.semantic_factors,
            final_cost: self.solve.final_cost,
            iterations: self.solve.iterations,
            converged: self.solve.termination.is_converged(),
            alignment: trajectory.map(|t| super::trajectory::alignment_name(t.alignment)),
            odometry_ate: trajectory.map(|t| t.odometry.ate.rmse),
            ate: trajectory.map(|t| t.estimate.ate.rmse),
            position: landmarks.map(|l| l.rmse.position),
            shape: landmarks.map(|l| l.mean.shape),
            quality: landmarks.map(|l| l.mean.quality),
            volume: landmarks.map(|l| l.mean.volume),
            seconds: self.solve.times.total + self.solve.refinement_seconds,
        }
    }
}
