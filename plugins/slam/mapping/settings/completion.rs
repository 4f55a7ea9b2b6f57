use super::{CutSides, DetectionSettings, ObjectSettings, RunSettings};
use manifactor_graph::checked::{NotNegative, Share};
use manifactor_quadric::BoxModel;
use manifactor_quadric::initialise::{Initialiser, RaysInitialiser};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// `[completion]`: the second stage of a run. The first stage estimates poses and the objects with consistent
/// boxes. The second stage keeps these poses, and estimates all objects from all their boxes, including boxes
/// that the image border cuts. It is skipped if the solver rejects factors as outliers.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CompletionSettings {
    /// Runs the second stage.
    pub enabled: bool,
    /// Sides this close to the image border count as cut: they bound only the visible part of the object.
    /// Unit: pixels.
    pub border_px: NotNegative,
    /// Objects are not mapped if the median overlap of their boxes with the estimated ellipsoid is smaller
    /// (intersection over union). Such boxes usually show several objects under one number.
    pub min_overlap: Share,
    /// Method that computes the initial value of an object from its boxes.
    pub initialiser: Arc<dyn Initialiser>,
}

impl Default for CompletionSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            border_px: NotNegative::literal(5.0),
            min_overlap: Share::literal(0.3),
            initialiser: Arc::new(RaysInitialiser::default()),
        }
    }
}

impl RunSettings {
    /// Returns the settings of the second stage: all boxes with the model of visible parts, all objects, and
    /// a weak `shape_prior`.
    pub fn of_completion(&self) -> Self {
        let CompletionSettings { border_px, initialiser, .. } = self.completion.clone();
        let (model, cut_sides) = (BoxModel::Truncated, CutSides::Keep);
        let detections = DetectionSettings { model, cut_sides, border_px, ..self.detections.clone() };
        let objects = ObjectSettings {
            initialiser,
            max_box_deviation_px: NotNegative::literal(f64::MAX),
            ..self.objects.clone()
        };
        Self { detections, objects, ..self.clone() }.for_stream()
    }
}
