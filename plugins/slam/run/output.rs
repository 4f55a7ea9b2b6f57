//! Files that a run writes.
//!
//! The folder of the run contains `report.json`, and `record.json` with all data to draw. Each variant has a
//! folder with these files:
//! - `config.toml`: all settings, ready to run again
//! - `trajectory.txt`: the trajectory in TUM's format; `live.txt` for a stream, with each pose as estimated
//!   when its frame arrived; `body_trajectory.txt` with the poses of the body, if the source has
//!   `body_from_camera`
//! - `detections.csv`: the boxes with their objects, if data association was done; `detections_NAME.csv` for a further
//!   camera
//! - `objects.json`: the objects
//! - `frames.jsonl`: poses and boxes, one frame per line
//! - `graph.json`: the literal graph at the estimate
//! - `map.json`: the objects with their covariances, as prior map of a later run
//! - `iterations.csv` and `metrics.json`
//! - `covariances.json`, with `report.covariances`
//!
//! Each file is written completely or not at all, into an [`OutputFolder`].
use crate::output::record::{FrameRecord, RECORD_FILE, RunRecord, VariantRecord};
use crate::output::report::{RunReport, VariantReport};
use manifactor_config::{Format, WriteError, to_toml, write_graph};
use manifactor_formats::FormatError;
use manifactor_formats::table::TableError;
use manifactor_formats::tum;
use manifactor_formats::whole;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::frame_of;
use manifactor_mapping::settings::run_document::{RunDocument, RunVariant, absolute_path, slug};
use manifactor_recording::recording;
use manifactor_recording::source::format_line;
use manifactor_solve::{CovarianceError, IterationRecord};
use serde::Serialize;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

mod folder;
mod map;
mod own_map;
pub mod record;
pub mod report;
mod shapes;
mod truth_frame;

pub use folder::{FolderError, OutputFolder};
pub use map::{MapError, map_of};
pub use own_map::refuse_own_maps;

/// Name of the file with a variant's map.
const MAP_FILE: &str = "map.json";

/// Error while writing results.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A file or folder that cannot be written.
    #[error("{} cannot be written: {source}", path.display())]
    Io {
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Requested covariances that are infinite or cannot be computed.
    #[error("covariances.json: {0}")]
    Covariance(#[from] CovarianceError),
    /// Boxes that cannot be written.
    #[error(transparent)]
    Boxes(#[from] FormatError),
    /// A table that no format can represent.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: TableError,
    },
    /// A result that no document can represent.
    #[error("{}: {source}", path.display())]
    Document {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: WriteError,
    },
}

/// Returns the folder of a variant.
pub(crate) fn variant_folder(output: &Path, variant: &str) -> PathBuf {
    output.join(slug(variant))
}

/// Writes a file completely or not at all. Creates missing parent folders.
///
/// # Errors
/// If the folder or the file cannot be written.
pub fn write_whole(path: &Path, content: impl AsRef<[u8]>) -> Result<(), OutputError> {
    let fail = |source| OutputError::Io { path: path.to_owned(), source };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(fail)?;
    }
    whole::write_whole(path, content.as_ref()).map_err(fail)
}

/// Removes a file if it exists.
fn remove(path: &Path) -> Result<(), OutputError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(OutputError::Io { path: path.to_owned(), source })
        }
        _ => Ok(()),
    }
}

/// Writes the report and the record of a run.
///
/// # Errors
/// If a file cannot be written.
pub fn write_report(output: &Path, report: &RunReport, record: &RunRecord) -> Result<(), OutputError> {
    write_document(&output.join(RECORD_FILE), format_compact(record))?;
    write_document(&output.join("report.json"), format_results(report))
}

/// Writes all files of a variant into its folder, and returns the folder.
///
/// # Errors
/// If a file cannot be written; files written before it remain.
pub fn write_variant(
    run: &RunDocument,
    variant: &RunVariant,
    estimate: &Estimate,
    report: &VariantReport,
    record: &VariantRecord,
) -> Result<PathBuf, OutputError> {
    let folder = variant_folder(&run.output, &variant.name);
    let file = |name: &str| folder.join(name);
    write_document(&file("config.toml"), resolved(run, variant))?;
    write_whole(&file("trajectory.txt"), tum::format(&estimate.trajectory()))?;
    if let Some(body_from_camera) = estimate.sequence.body_from_camera {
        let camera_from_body = body_from_camera.inverse();
        let mut trajectory = estimate.trajectory();
        trajectory.iter_mut().for_each(|stamped| stamped.pose = stamped.pose.compose(&camera_from_body));
        write_whole(&file("body_trajectory.txt"), tum::format(&trajectory))?;
    }
    if let Some(online) = &report.online {
        write_whole(&file("live.txt"), tum::format(&online.live))?;
    }
    if report.association.is_some() {
        let (table, frames) = (file("detections"), file("detections.jsonl"));
        remove(&frames)?;
        match recording::missing_column(&estimate.sequence) {
            None => recording::write_detections(&estimate.sequence, &table)?,
            Some(_) => {
                remove(&file("detections.csv"))?;
                for camera in estimate.sequence.cameras.iter().skip(1) {
                    remove(&file(&format!("detections_{}.csv", camera.name)))?;
                }
                let lines = estimate.sequence.observations().map(|frame| format_line(&frame) + "\n");
                write_whole(&frames, lines.collect::<String>())?;
            }
        }
    }
    write_document(&file("objects.json"), format_results(&report.objects))?;
    write_document(&file("frames.jsonl"), lines(&record.frames))?;
    let graph = write_graph(&estimate.mapping.graph, &estimate.solution.values, Format::Json);
    write_document(&file("graph.json"), graph)?;
    match map_of(estimate, &variant.settings) {
        Ok(map) => write_document(&file(MAP_FILE), format_results(&map))?,
        Err(error) => {
            tracing::warn!("there is no {MAP_FILE}: {error}");
            // an old file would be mistaken for the map of these results
            remove(&file(MAP_FILE))?;
        }
    }
    write_whole(&file("iterations.csv"), iterations(&estimate.solution.outcome.history))?;
    write_document(&file("metrics.json"), format_results(report))?;
    if variant.settings.report.covariances {
        let mut marginals = estimate.solution.marginals(&estimate.mapping.graph, &[])?;
        if estimate.keeps_odometry() {
            tracing::warn!(
                "covariances.json has no poses: those of the odometry were kept, and their noise is unknown"
            );
            marginals.retain(|marginal| frame_of(&marginal.key).is_none());
        }
        write_document(&file("covariances.json"), format_results(&marginals))?;
    }
    Ok(folder)
}

/// Writes a document if it could be formatted.
pub fn write_document(path: &Path, text: Result<String, WriteError>) -> Result<(), OutputError> {
    let text = text.map_err(|source| OutputError::Document { path: path.to_owned(), source })?;
    write_whole(path, &text)
}

/// Returns the frames as JSON, one per line.
fn lines(frames: &[FrameRecord]) -> Result<String, WriteError> {
    frames.iter().map(|frame| Ok(format_compact(frame)? + "\n")).collect()
}

/// Returns results as readable JSON. Unlike documents, results may contain infinite numbers or NaN, such as a
/// cost that overflows; these become null.
pub fn format_results(value: &impl Serialize) -> Result<String, WriteError> {
    serde_json::to_string_pretty(value).map(|text| text + "\n").map_err(|error| inexpressible(&error))
}

/// Returns results as JSON on one line.
fn format_compact(value: &impl Serialize) -> Result<String, WriteError> {
    serde_json::to_string(value).map_err(|error| inexpressible(&error))
}

fn inexpressible(error: &serde_json::Error) -> WriteError {
    WriteError::Inexpressible { format: Format::Json, message: error.to_string() }
}

/// Returns the settings of one variant as a separate document.
fn resolved(run: &RunDocument, variant: &RunVariant) -> Result<String, WriteError> {
    #[derive(Serialize)]
    struct ResolvedDocument<'a> {
        title: &'a str,
        output: String,
        folder: String,
        #[serde(flatten)]
        settings: &'a manifactor_mapping::settings::RunSettings,
        variants: [NamedVariant<'a>; 1],
    }
    #[derive(Serialize)]
    struct NamedVariant<'a> {
        name: &'a str,
        #[serde(skip_serializing_if = "Option::is_none")]
        about: Option<&'a str>,
    }
    // a document cannot represent names that are not UTF-8
    let output = variant_folder(&run.output, &variant.name).display().to_string();
    let folder = absolute_path(&run.folder).display().to_string();
    let variants = [NamedVariant { name: &variant.name, about: variant.about.as_deref() }];
    let title = &run.title;
    to_toml(&ResolvedDocument { title, output, folder, settings: &variant.settings, variants })
}

fn iterations(history: &[IterationRecord]) -> String {
    let mut text =
        String::from("iteration,cost,trial_cost,gradient,step,control,accepted,inactive,seconds\n");
    for r in history {
        let trial = r.trial_cost.map_or(String::new(), |cost| cost.to_string());
        // writing to a String does not fail
        let _ = writeln!(
            text,
            "{},{},{trial},{},{},{},{},{},{}",
            r.iteration, r.cost, r.gradient, r.step, r.control, r.accepted, r.inactive, r.seconds
        );
    }
    text
}
