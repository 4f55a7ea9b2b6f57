//! The cameras of a sequence.
use manifactor_geometry::{CameraView, OnBody, OnBodyError, Se3, So3};
use manifactor_graph::Factor;
use manifactor_quadric::Camera;
use nalgebra::Vector3;
use std::sync::Arc;

/// A camera of a sequence, or the view of a wide lens around one box.
#[derive(Debug, Clone, PartialEq)]
pub struct MountedCamera {
    /// Name in the document; empty for the first camera.
    pub name: String,
    /// Position among the cameras of the sequence, 0 for the first.
    pub index: usize,
    /// The camera model.
    pub model: Camera,
    /// Pose of the lens in the frame of the first camera; `None` for the first camera itself.
    pub first_from_camera: Option<Se3>,
    /// Rotation of a view, in the frame of its lens; `None` for the camera itself.
    pub lens_from_view: Option<So3>,
}

impl MountedCamera {
    /// Returns the setting of the camera in a run document.
    pub fn setting(&self) -> String {
        match self.index {
            0 => "source.camera".to_owned(),
            _ => format!("source.cameras.{}.camera", self.name),
        }
    }

    /// Returns the view of this camera around a box.
    pub(crate) fn viewed(&self, view: &CameraView) -> Self {
        let CameraView { lens_from_view, camera } = *view;
        Self { model: camera, lens_from_view: Some(lens_from_view), ..self.clone() }
    }

    /// Returns the view, if this is one.
    pub(crate) fn view(&self) -> Option<CameraView> {
        self.lens_from_view.map(|lens_from_view| CameraView { lens_from_view, camera: self.model })
    }

    /// Returns the pose of this camera, or of its view, from the pose of the first camera.
    pub fn pose(&self, world_from_first: &Se3) -> Se3 {
        self.view_pose(
            &self.first_from_camera.map_or(*world_from_first, |pose| world_from_first.compose(&pose)),
        )
    }

    /// Returns the pose of the view from the pose of its lens; the same for the camera itself.
    pub fn view_pose(&self, world_from_lens: &Se3) -> Se3 {
        self.lens_from_view.map_or(*world_from_lens, |view| world_from_lens.compose(&turn(view)))
    }

    /// Returns a factor on the pose of the first camera, from a factor whose first variable is the pose of this one.
    ///
    /// # Errors
    /// If the first variable is not a pose.
    pub fn on_first(&self, factor: Arc<dyn Factor>) -> Result<Arc<dyn Factor>, OnBodyError> {
        let of_lens = match self.lens_from_view {
            None => factor,
            Some(view) => on_camera(factor, &turn(view))?,
        };
        match self.first_from_camera {
            None => Ok(of_lens),
            Some(pose) => on_camera(of_lens, &pose),
        }
    }
}

/// Returns a factor whose first variable is a camera, from a factor on the pose of another camera in its frame.
fn on_camera(factor: Arc<dyn Factor>, camera_from_other: &Se3) -> Result<Arc<dyn Factor>, OnBodyError> {
    Ok(Arc::new(OnBody::new(factor, camera_from_other.inverse(), Some(vec![0]))?))
}

fn turn(rotation: So3) -> Se3 {
    Se3::new(rotation, Vector3::zeros())
}

/// Returns whether the name of a further camera may have this character.
pub fn is_name_character(c: char) -> bool {
    c.is_alphanumeric() || ['_', '-'].contains(&c)
}

/// Error for the name of a further camera that cannot be part of a file's name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`source.cameras` has the name {name:?}: expected letters, digits, `_` and `-`")]
pub struct CameraNameError {
    /// The name.
    pub name: String,
}

/// All cameras of a sequence, at fixed poses on one body. The poses of frames are those of the first camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Cameras {
    first: Arc<MountedCamera>,
    others: Vec<Arc<MountedCamera>>,
}

impl Cameras {
    /// Creates the first camera.
    pub fn new(model: Camera) -> Self {
        let first = MountedCamera {
            name: String::new(),
            index: 0,
            model,
            first_from_camera: None,
            lens_from_view: None,
        };
        Self { first: Arc::new(first), others: vec![] }
    }

    /// Adds a camera at a pose in the frame of the first one.
    ///
    /// # Errors
    /// If the name cannot be part of a file's name.
    pub fn add(&mut self, name: &str, model: Camera, first_from_camera: Se3) -> Result<(), CameraNameError> {
        if name.is_empty() || !name.chars().all(is_name_character) {
            return Err(CameraNameError { name: name.to_owned() });
        }
        let (name, index) = (name.to_owned(), self.others.len() + 1);
        let camera = MountedCamera {
            name,
            index,
            model,
            first_from_camera: Some(first_from_camera),
            lens_from_view: None,
        };
        self.others.push(Arc::new(camera));
        Ok(())
    }

    /// Returns the first camera.
    pub fn first(&self) -> &Arc<MountedCamera> {
        &self.first
    }

    /// Iterates over all cameras, the first one first.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<MountedCamera>> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// Returns the camera with this name; `None` selects the first one.
    ///
    /// # Errors
    /// If there is no such camera. The message lists the names.
    pub fn named(&self, name: Option<&str>) -> Result<&Arc<MountedCamera>, String> {
        let Some(name) = name else { return Ok(&self.first) };
        self.others.iter().find(|camera| camera.name == name).ok_or_else(|| {
            let names: Vec<String> = self.others.iter().map(|camera| format!("`{}`", camera.name)).collect();
            match &names[..] {
                [] => format!("unknown camera `{name}`: `source.cameras` declares none"),
                _ => format!("unknown camera `{name}`, expected one of {}", names.join(", ")),
            }
        })
    }
}

impl From<Camera> for Cameras {
    fn from(model: Camera) -> Self {
        Self::new(model)
    }
}
