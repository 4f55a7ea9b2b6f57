//! Record of a run: all data to draw, in one frame.
//!
//! `record.json` contains the record, so that pictures can be drawn again from the folder of a run.
//! `frames.jsonl` contains its frames, one per line.
use manifactor_graph::Direction;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::settings::RunSettings;
use manifactor_mapping::settings::run_document::{RunVariant, slug};
use manifactor_metrics::Alignment;
use manifactor_quadric::Camera;
use nalgebra::Vector3;
use serde::{Deserialize, Deserializer, Serialize};
use std::path::{Path, PathBuf};

mod drawn;
mod factors;
mod frames;
mod objects;
mod variables;

pub use factors::{AppliedFactor, FactorResiduals};
pub use frames::{BoxRecord, FrameRecord, PoseRecord};
pub use objects::{ObjectRecord, TrueCuboid};
pub use variables::OwnVariable;

/// File of the record in the folder of the run.
pub(crate) const RECORD_FILE: &str = "record.json";

/// Error while reading a record.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The file does not exist or cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a record, or has different fields, for example from a different version.
    #[error("{} is not a record of a run, as this version writes them: {source}", path.display())]
    NotARecord {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: serde_json::Error,
    },
    /// Pictures would be written to a different folder.
    #[error("{}: the variant {variant:?} has the folder {folder:?}, which is not that of its name", path.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// Name of the variant.
        variant: String,
        /// Folder in the record.
        folder: String,
    },
}

/// Record of a run, variant by variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Version of the program.
    pub version: String,
    /// Title of the run.
    pub title: String,
    /// Variants in the order of the document.
    pub variants: Vec<VariantRecord>,
}

/// Record of one variant. Poses, objects and the up direction are in the ground-truth frame, or in the map
/// frame if there is no ground truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariantRecord {
    /// Name of the variant.
    pub name: String,
    /// Description in one sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Folder of the variant within the folder of the run.
    pub folder: String,
    /// Up direction. If it is unknown, the up direction of the first image.
    pub up: Direction,
    /// Camera, shared by all frames.
    pub camera: Camera,
    /// Alignment of the errors; `None` without ground truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment: Option<Alignment>,
    /// Number of frames that relative errors span.
    pub relative_over: usize,
    /// Frames, sorted by time.
    pub frames: Vec<FrameRecord>,
    /// Detected objects by number, then true ones that were never detected.
    pub objects: Vec<ObjectRecord>,
    /// Variables that the document declares itself.
    pub variables: Vec<OwnVariable>,
    /// Cost after each accepted step; the first entry is the initial cost.
    #[serde(deserialize_with = "finite_or_nan")]
    pub cost: Vec<f64>,
    /// Residuals at the estimate, by type of factor.
    pub residuals: Vec<FactorResiduals>,
    /// Number of images in the pictures of the run.
    pub images: usize,
}

impl RunRecord {
    /// Creates the record of these variants.
    pub fn new(title: &str, variants: Vec<VariantRecord>) -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), title: title.to_owned(), variants }
    }

    /// Reads the record in the folder of a run.
    ///
    /// # Errors
    /// If the file does not exist, cannot be read, or names a variant's folder outside the folder of the run.
    pub fn read(folder: &Path) -> Result<Self, RecordError> {
        let path = folder.join(RECORD_FILE);
        let text = std::fs::read_to_string(&path)
            .map_err(|source| RecordError::Io { path: path.clone(), source })?;
        let record: Self = match serde_json::from_str(&text) {
            Ok(record) => record,
            Err(source) => return Err(RecordError::NotARecord { path, source }),
        };
        match record.variants.iter().find(|variant| variant.folder != slug(&variant.name)) {
            Some(VariantRecord { name, folder, .. }) => {
                Err(RecordError::Folder { path, variant: name.clone(), folder: folder.clone() })
            }
            None => Ok(record),
        }
    }
}

impl VariantRecord {
    /// Creates the record of an estimate.
    pub fn new(variant: &RunVariant, estimate: &Estimate) -> Self {
        let settings: &RunSettings = &variant.settings;
        let within = *settings.evaluation.max_time_difference;
        let drawn = drawn::RecordFrames::of(estimate, within);
        let (frames, alignment) = frames::frames(estimate, &settings.evaluation, &drawn);
        Self {
            name: variant.name.clone(),
            about: variant.about.clone(),
            folder: slug(&variant.name),
            up: up(estimate, &drawn),
            camera: estimate.sequence.cameras.first().model,
            alignment,
            relative_over: settings.evaluation.relative_over.get(),
            frames,
            objects: objects::objects(estimate, &drawn, within),
            variables: variables::variables(&settings.own, estimate),
            cost: cost(estimate),
            residuals: factors::residuals(estimate),
            images: *settings.report.images,
        }
    }

    /// Returns the classes of the objects in alphabetical order.
    pub fn classes(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.objects.iter().map(|object| object.class.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// Reads numbers; null stands for a number that was not finite and becomes NaN.
fn finite_or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let numbers = Vec::<Option<f64>>::deserialize(from)?;
    Ok(numbers.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
}

/// Returns the up direction in the frame of the record. If it is unknown, it is guessed as up in the first
/// image.
fn up(estimate: &Estimate, drawn: &drawn::RecordFrames) -> Direction {
    let image_up = || estimate.trajectory().first().map(|p| p.pose.rotation.act(&-Vector3::y()));
    let known = estimate.mapping.frame.up.map(|up| *up);
    let up = known.or_else(image_up).and_then(|up| Direction::new(drawn.estimate.rotation.act(&up)).ok());
    up.unwrap_or_default()
}

fn cost(estimate: &Estimate) -> Vec<f64> {
    let outcome = &estimate.solution.outcome;
    let steps = outcome.history.iter().filter(|step| step.accepted).filter_map(|step| step.trial_cost);
    std::iter::once(outcome.initial_cost).chain(steps).collect()
}
