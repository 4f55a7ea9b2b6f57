//! Files of detections that a source names.
use super::SourceError;
use super::assemble::detection;
use crate::camera::MountedCamera;
use crate::sequence::Detection;
use manifactor_config::Value;
use manifactor_formats::detections::{self, DetectionFormat, DetectionRow};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeSet;
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
        if let Some(class) = class_of_object_zero(&rows) {
            tracing::warn!(
                "{}: all boxes with object_key 0, which stands for no object, are of class `{class}` and in different images: \
                 if they show one object, number the objects from 1",
                self.path(folder).display()
            );
        }
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

/// Returns the class of the boxes with key 0 if they look like those of one object among others: all have one class, and
/// no image has two.
fn class_of_object_zero(rows: &[DetectionRow]) -> Option<&str> {
    const FEWEST: usize = 3;
    let of_zero: Vec<&DetectionRow> = rows.iter().filter(|row| row.object_key == Some(0)).collect();
    let class = of_zero.first()?.class_name.as_str();
    let images: BTreeSet<u64> = of_zero.iter().map(|row| row.timestamp.to_bits()).collect();
    let is_one = of_zero.iter().all(|row| row.class_name == class) && images.len() == of_zero.len();
    let has_others = rows.iter().any(|row| row.object_key.is_some_and(|key| key > 0));
    (of_zero.len() >= FEWEST && is_one && has_others).then_some(class)
}

impl From<&str> for DetectionsFile {
    fn from(file: &str) -> Self {
        Self::Csv(file.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_without_an_object_are_not_taken_for_one() {
        let row = |timestamp, class, key| DetectionRow {
            object_key: Some(key),
            ..DetectionRow::of_box(timestamp, class, 0.5, [0.0, 0.0, 9.0, 9.0])
        };
        let from_zero = [row(1.0, "cup", 0), row(2.0, "cup", 0), row(3.0, "cup", 0), row(3.0, "book", 1)];
        assert_eq!(class_of_object_zero(&from_zero), Some("cup"));
        // two classes, two boxes in one image, no named object, or too few
        let two_classes = [&from_zero[..], &[row(4.0, "book", 0)]].concat();
        let one_image = [&from_zero[..], &[row(3.0, "cup", 0)]].concat();
        for rows in [&two_classes[..], &one_image, &from_zero[..3], &from_zero[1..]] {
            assert_eq!(class_of_object_zero(rows), None, "{rows:?}");
        }
    }
}
