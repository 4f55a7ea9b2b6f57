//! All cameras of a source, with the rectification of their boxes.
use super::rectification::Rectification;
use super::{CameraChoice, CameraPose, SourceError};
use crate::camera::Cameras;
use crate::sequence::{Detection, Frame, Observation, UnusedInput};
use manifactor_geometry::Se3;
use std::path::Path;

/// All cameras of a source.
#[derive(Debug)]
pub(super) struct Rig {
    pub(super) cameras: Cameras,
    /// In the order of the cameras.
    lenses: Vec<Rectification>,
    /// Pose of the first camera on the body. `None`: it is the body.
    body_from_first: Option<Se3>,
}

impl Rig {
    /// Creates a rig with one camera, at a pose on the body whose poses the source gives.
    pub(super) fn new(lens: Rectification, body_from_first: Option<Se3>) -> Self {
        Self { cameras: Cameras::new(lens.camera), lenses: vec![lens], body_from_first }
    }

    /// Adds further cameras by name. Calibration files are relative to `folder`.
    ///
    /// # Errors
    /// If a name is not a word, or a calibration file cannot be read.
    pub(super) fn with<'a>(
        mut self,
        cameras: impl IntoIterator<Item = (&'a String, &'a CameraChoice, &'a CameraPose)>,
        folder: &Path,
    ) -> Result<Self, SourceError> {
        for (name, camera, body_from_camera) in cameras {
            if let (None, Some(file)) = (self.body_from_first, body_from_camera.file()) {
                return Err(SourceError::Calibration {
                    file: folder.join(file),
                    fault: format!(
                        "it gives the pose of `{name}` on the body of the file: give `source.body_from_camera` from it, too"
                    ),
                });
            }
            self.add(name, Rectification::new(camera, None, folder)?, body_from_camera.read(folder)?)?;
        }
        Ok(self)
    }

    /// Adds a camera at a pose on the body.
    ///
    /// # Errors
    /// If the name cannot be part of a file's name.
    pub(super) fn add(
        &mut self,
        name: &str,
        lens: Rectification,
        body_from_camera: Se3,
    ) -> Result<(), SourceError> {
        let first_from_body = self.body_from_first.map(|first| first.inverse());
        let first_from_camera =
            first_from_body.map_or(body_from_camera, |first| first.compose(&body_from_camera));
        self.cameras.add(name, lens.camera, first_from_camera)?;
        self.lenses.push(lens);
        Ok(())
    }

    /// Rectifies the boxes of a recording. Boxes of a wide lens that it cannot have seen are left out and returned.
    ///
    /// # Errors
    /// If a box of another lens has no place in the rectified image.
    pub(super) fn apply(
        &self,
        detections: &mut Vec<Detection>,
        frames: &[Frame],
    ) -> Result<Vec<UnusedInput>, SourceError> {
        let (mut rectified, mut unused, mut image) = (vec![], vec![], (usize::MAX, 0));
        for mut detection in detections.drain(..) {
            let frame = detection.frame;
            image = (frame, if image.0 == frame { image.1 + 1 } else { 1 });
            match self.rectify(&mut detection) {
                Ok(()) => rectified.push(detection),
                Err(fault) if self.lenses.get(detection.camera.index).is_some_and(Rectification::is_wide) => {
                    let timestamp = frames.get(frame).map_or(f64::NAN, |frame| frame.timestamp);
                    unused.push(UnusedInput::Box { timestamp, place: image.1, fault });
                }
                Err(fault) => return Err(SourceError::Distorted { frame, fault }),
            }
        }
        *detections = rectified;
        Ok(unused)
    }

    /// Rectifies the boxes of one frame. Boxes without a place in the rectified image are left out and
    /// reported.
    pub(super) fn apply_to_frame(&self, observation: &mut Observation) {
        let Observation { frame, detections, unused, .. } = observation;
        let mut place = 0;
        detections.retain_mut(|detection| {
            place += 1;
            let rectified = self.rectify(detection);
            let report = |fault| unused.push(UnusedInput::Box { timestamp: frame.timestamp, place, fault });
            rectified.map_err(report).is_ok()
        });
    }

    fn rectify(&self, detection: &mut Detection) -> Result<(), String> {
        let lens = self.lenses.get(detection.camera.index);
        lens.ok_or_else(|| format!("unknown camera {}", detection.camera.index))?.rectify(detection)
    }
}
