//! The record of a run: all that there is to draw, in one frame.
//!
//! `record.json` holds it, so that pictures can be made again from a run's folder; `frames.jsonl` holds its frames, one a line.
use manifactor_graph::Direction;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::settings::Settings;
use manifactor_mapping::settings::run_document::{Variant, slug};
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
pub use frames::{FrameRecord, SeenBox, TrackedPose};
pub use objects::{ObjectRecord, Solid};
pub use variables::OwnVariable;

/// The file that holds it, in the folder of the run.
pub(crate) const RECORD: &str = "record.json";

/// Why a record could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// There is none, or it cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is not one, or one with other fields, as another version may have written.
    #[error("{} is not a record of a run, as this version writes them: {source}", path.display())]
    NotARecord {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// Pictures would be written somewhere else.
    #[error("{}: the variant {variant:?} has the folder {folder:?}, which is not that of its name", path.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// The variant.
        variant: String,
        /// What the file says.
        folder: String,
    },
}

/// A run, variant by variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Of the program that made it.
    pub version: String,
    /// What the run is called.
    pub title: String,
    /// In the order of the document.
    pub variants: Vec<VariantRecord>,
}

/// One variant. Poses, objects and up are in the frame of the truth where there is one, and in that of the map where
/// there is none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariantRecord {
    /// Its name.
    pub name: String,
    /// What it does, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Its folder in that of the run.
    pub folder: String,
    /// Up; in a map whose up is unknown, up in the first image.
    pub up: Direction,
    /// The camera; the same for all frames.
    pub camera: Camera,
    /// How errors were aligned; `None` where there is no truth to compare with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment: Option<Alignment>,
    /// Over how many frames relative errors are taken.
    pub relative_over: usize,
    /// By time.
    pub frames: Vec<FrameRecord>,
    /// Detected objects by number, then true ones that were never detected.
    pub objects: Vec<ObjectRecord>,
    /// Variables of the run's own.
    pub variables: Vec<OwnVariable>,
    /// The cost after each accepted step; the first is where the solve began.
    #[serde(deserialize_with = "finite_or_nan")]
    pub cost: Vec<f64>,
    /// Residuals at the estimate, by type of factor.
    pub residuals: Vec<FactorResiduals>,
    /// How many images the run's pictures show.
    pub images: usize,
}

impl RunRecord {
    /// The record of these variants.
    pub fn new(title: &str, variants: Vec<VariantRecord>) -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), title: title.to_owned(), variants }
    }

    /// Reads the record of a run's folder.
    ///
    /// # Errors
    /// If there is none, it cannot be read, or a variant's folder is not within that of the run.
    pub fn read(folder: &Path) -> Result<Self, RecordError> {
        let path = folder.join(RECORD);
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
    /// The record of an estimate.
    pub fn new(variant: &Variant, estimate: &Estimate) -> Self {
        let settings: &Settings = &variant.settings;
        let drawn = drawn::Frames::of(estimate, *settings.evaluation.max_time_difference);
        let (frames, alignment) = frames::frames(estimate, &settings.evaluation, &drawn);
        Self {
            name: variant.name.clone(),
            about: variant.about.clone(),
            folder: slug(&variant.name),
            up: up(estimate, &drawn),
            camera: estimate.sequence.camera,
            alignment,
            relative_over: settings.evaluation.relative_over.get(),
            frames,
            objects: objects::objects(estimate, &drawn),
            variables: variables::variables(&settings.own, estimate),
            cost: cost(estimate),
            residuals: factors::residuals(estimate),
            images: *settings.report.images,
        }
    }

    /// The classes of its objects, in alphabetical order.
    pub fn classes(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.objects.iter().map(|object| object.class.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// Numbers, of which those that are not finite were written as null.
fn finite_or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let numbers = Vec::<Option<f64>>::deserialize(from)?;
    Ok(numbers.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
}

/// Up in the frame of the record. If it is unknown, up in the first image is the best guess.
fn up(estimate: &Estimate, drawn: &drawn::Frames) -> Direction {
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
