//! Files of detections that a source names.
use super::SourceError;
use super::assemble::detection;
use crate::camera::MountedCamera;
use crate::sequence::Detection;
use manifactor_config::Value;
use manifactor_formats::detections::{self, DetectionFormat};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of detections: the path of a CSV file with named columns, or the `format` of another program.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum DetectionsFile {
    /// A CSV file.
    Csv(PathBuf),
    /// Files of another program.
    Format(DetectionFormat),
}

// serde's own untagged enum would only report that no variant fits, and not the error in a field
impl<'de> Deserialize<'de> for DetectionsFile {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        manifactor_config::deserialize_with(from, |node| {
            Ok(Box::new(match &node.value {
                Value::Table(_) => Self::Format(node.try_read()?),
                _ => Self::Csv(node.try_read()?),
            }))
        })
    }
}

impl DetectionsFile {
    /// Reads the detections in images of a camera, with their timestamps.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub(super) fn read(
        &self,
        folder: &Path,
        camera: &Arc<MountedCamera>,
    ) -> Result<Vec<(f64, Detection)>, SourceError> {
        let rows = match self {
            Self::Csv(file) => detections::read(folder.join(file))?,
            Self::Format(format) => format.read(folder, [camera.model.width, camera.model.height])?,
        };
        Ok(rows.iter().map(|row| (row.timestamp, detection(row, camera))).collect())
    }

    /// Returns the files and folders that have to exist.
    pub(super) fn files(&self) -> Vec<&Path> {
        match self {
            Self::Csv(file) => vec![file],
            Self::Format(format) => format.files(),
        }
    }

    /// Returns the path in messages.
    pub(super) fn path(&self, folder: &Path) -> PathBuf {
        folder.join(self.files().first().copied().unwrap_or(folder))
    }
}

impl From<&str> for DetectionsFile {
    fn from(file: &str) -> Self {
        Self::Csv(file.into())
    }
}
