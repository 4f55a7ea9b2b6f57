//! Rectification of boxes to a pinhole camera of equal focal lengths.
//!
//! The outline of an ellipsoid is a conic only for a pinhole camera. All code after a source therefore uses
//! the rectified image, and camera models appear only in this module.
use super::{CameraChoice, SourceError};
use crate::sequence::Detection;
use manifactor_geometry::{AnyCamera, Distortion, RadialTangential};
use manifactor_quadric::{BoundingBox, Camera};
use nalgebra::Vector2;
use std::path::Path;
use std::sync::Arc;

/// Mapping from the images of a camera to the images of its pinhole camera.
#[derive(Debug)]
pub(super) struct Rectification {
    /// The pinhole camera.
    pub(super) camera: Camera,
    /// Model of the images; `None` if they come from the pinhole camera itself.
    model: Option<Arc<dyn AnyCamera>>,
}

impl Rectification {
    /// Creates the rectification for a source's camera, with an optional distortion of its lens. A calibration file is
    /// relative to `folder`.
    ///
    /// # Errors
    /// If a model that has its own distortion is combined with a second one, or a file cannot be read.
    pub(super) fn new(
        choice: &CameraChoice,
        distortion: Option<Distortion>,
        folder: &Path,
    ) -> Result<Self, SourceError> {
        match (choice.read(folder)?, distortion) {
            ((_, Some(_)), Some(_)) => Err(SourceError::DistortedTwice),
            ((_, Some(model)), None) => Ok(Self::of_model(model)),
            ((camera, None), distortion) => Ok(Self::of_pinhole(camera, distortion)),
        }
    }

    /// Creates the rectification for a camera model.
    pub(super) fn of_model(model: Arc<dyn AnyCamera>) -> Self {
        Self { camera: model.pinhole(), model: Some(model) }
    }

    /// Creates the rectification for a pinhole camera, with an optional distortion of its lens.
    pub(super) fn of_pinhole(camera: Camera, distortion: Option<Distortion>) -> Self {
        let model = distortion.map(|distortion| {
            let model: Arc<dyn AnyCamera> = Arc::new(RadialTangential::new(camera, distortion));
            model
        });
        Self { camera, model }
    }

    /// Rectifies the box and the ellipse of a detection. Returns `None`, and leaves them unchanged, if they have no place in
    /// the rectified image.
    pub(super) fn rectify(&self, detection: &mut Detection) -> Option<()> {
        if let Some(model) = &self.model {
            let bounding_box = rectified(&**model, &detection.bounding_box)?;
            if let Some(ellipse) = &mut detection.ellipse {
                *ellipse = ellipse.mapped(|point| model.rectify(point))?;
            }
            detection.bounding_box = bounding_box;
        }
        Some(())
    }
}

/// Rectifies a box by the midpoints of its sides, where an upright or lying ellipse touches them.
fn rectified(model: &dyn AnyCamera, seen: &BoundingBox) -> Option<BoundingBox> {
    let [x, y] = [0.5 * (seen.xmin + seen.xmax), 0.5 * (seen.ymin + seen.ymax)];
    let side = |u, v, axis: usize| Some(model.rectify(&Vector2::new(u, v))?[axis]);
    let bounds =
        [side(seen.xmin, y, 0)?, side(x, seen.ymin, 1)?, side(seen.xmax, y, 0)?, side(x, seen.ymax, 1)?];
    BoundingBox::new(bounds).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the calibration of freiburg1, as the benchmark publishes it.
    fn freiburg1(distortion: [f64; 5]) -> Rectification {
        let named = serde_json::from_value::<CameraChoice>("freiburg1".into()).unwrap();
        Rectification::new(&named, Some(distortion.into()), Path::new("")).unwrap()
    }

    const LENS: [f64; 5] = [0.2624, -0.9531, -0.0054, 0.0026, 1.1633];

    #[test]
    fn a_box_in_the_middle_stays_and_one_at_the_side_moves_by_pixels() {
        let moved = |bounds: [f64; 4]| {
            let lens = freiburg1(LENS);
            let model = lens.model.unwrap();
            let free = rectified(&*model, &BoundingBox::new(bounds).unwrap()).unwrap().bounds();
            free.iter().zip(bounds).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        assert!(moved([310.0, 245.0, 330.0, 265.0]) < 0.1);
        let at_the_side = moved([20.0, 30.0, 120.0, 200.0]);
        assert!((2.0..12.0).contains(&at_the_side), "{at_the_side}");
    }

    #[test]
    fn a_model_is_named_in_a_document_and_is_not_distorted_twice() {
        let lens = freiburg1(LENS);
        let mut numbers = serde_json::to_value(lens.camera).unwrap();
        numbers["type"] = "radial_tangential".into();
        numbers["distortion"] = LENS.to_vec().into();
        let named: CameraChoice = serde_json::from_value(numbers).unwrap();
        let seen = BoundingBox::new([20.0, 30.0, 120.0, 200.0]).unwrap();
        let model = Rectification::new(&named, None, Path::new("")).unwrap();
        let of = |lens: &Rectification| rectified(&**lens.model.as_ref().unwrap(), &seen);
        assert_eq!(of(&model), of(&lens));
        assert_eq!(model.camera, lens.camera);
        assert!(matches!(
            Rectification::new(&named, Some(LENS.into()), Path::new("")),
            Err(SourceError::DistortedTwice)
        ));
    }

    #[test]
    fn a_lens_that_folds_the_image_leaves_no_box() {
        let folds = freiburg1([-9.0, 0.0, 0.0, 0.0, 0.0]);
        let seen = BoundingBox::new([20.0, 30.0, 120.0, 200.0]).unwrap();
        assert_eq!(rectified(&*folds.model.unwrap(), &seen), None);
    }
}
