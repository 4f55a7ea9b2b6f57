use super::{RunReport, VariantReport};
use serde::Serialize;

/// One variant on one line. What is not known is left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The variant.
    pub variant: String,
    /// Objects in the map.
    pub objects: usize,
    /// Boxes of these objects.
    pub boxes: usize,
    /// Semantic factors.
    pub semantic_factors: usize,
    /// ½ Σ ρ where the solve ended.
    pub final_cost: f64,
    /// Linearizations followed by a step.
    pub iterations: usize,
    /// Whether it ended in a minimum.
    pub converged: bool,
    /// The alignment under which the trajectories are compared: the first that is configured.
    pub alignment: Option<String>,
    /// RMSE of positions by odometry alone, in metres.
    pub odometry_ate: Option<f64>,
    /// RMSE of positions, in metres.
    pub ate: Option<f64>,
    /// RMSE of the landmarks' positions, in metres.
    pub position: Option<f64>,
    /// Mean Jaccard distance of the landmarks' shapes, 0 to 1.
    pub shape: Option<f64>,
    /// Mean Jaccard distance of the landmarks where they stand, 0 to 1.
    pub quality: Option<f64>,
    /// Of the solve, refinements included.
    pub seconds: f64,
}

impl RunReport {
    /// A line for each variant.
    pub fn table(&self) -> Vec<Row> {
        self.variants.iter().map(VariantReport::row).collect()
    }
}

impl VariantReport {
    /// This variant on one line.
    pub fn row(&self) -> Row {
        let trajectory = self.trajectory.first();
        let landmarks = self.landmarks.map(|landmarks| landmarks.estimate);
        Row {
            variant: self.name.clone(),
            objects: self.counts.objects,
            boxes: self.counts.boxes,
            semantic_factors: self.counts.semantic_factors,
            final_cost: self.solve.final_cost,
            iterations: self.solve.iterations,
            converged: self.solve.termination.is_converged(),
            alignment: trajectory.map(|t| super::trajectory::name(t.alignment)),
            odometry_ate: trajectory.map(|t| t.odometry.ate.rmse),
            ate: trajectory.map(|t| t.estimate.ate.rmse),
            position: landmarks.map(|l| l.rmse.position),
            shape: landmarks.map(|l| l.mean.shape),
            quality: landmarks.map(|l| l.mean.quality),
            seconds: self.solve.times.total + self.solve.refinement_seconds,
        }
    }
}
