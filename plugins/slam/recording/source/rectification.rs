//! Rectification of boxes to pinhole cameras.
//!
//! The outline of an ellipsoid is a conic only for a pinhole camera. All code after a source therefore uses
//! pinhole cameras: the one of the rectified image or, for a wide lens, one for each box.
use super::{CameraChoice, SourceError};
use crate::sequence::Detection;
use manifactor_geometry::{AnyCamera, Distortion, RadialTangential};
use manifactor_quadric::{BoundingBox, Camera};
use nalgebra::Vector2;
use std::path::Path;
use std::sync::Arc;

/// Mapping from the images of a camera to pinhole cameras.
#[derive(Debug)]
pub(super) struct Rectification {
    /// The pinhole camera of the rectified image.
    pub(super) camera: Camera,
    /// Model of the images; `None` if they come from the pinhole camera itself.
    model: Option<Arc<dyn AnyCamera>>,
    /// Whether each box gets a view of its own.
    is_wide: bool,
}

/// Largest stretch of a pixel in the rectified image, and of the noise of a box with it. Beyond it, a lens is wide.
const MAX_STRETCH: f64 = 1.5;

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
        Self { camera: model.pinhole(), is_wide: stretches(&*model), model: Some(model) }
    }

    /// Creates the rectification for a pinhole camera, with an optional distortion of its lens.
    pub(super) fn of_pinhole(camera: Camera, distortion: Option<Distortion>) -> Self {
        match distortion {
            Some(distortion) => Self::of_model(Arc::new(RadialTangential::new(camera, distortion))),
            None => Self { camera, model: None, is_wide: false },
        }
    }

    /// Returns whether each box gets a view of its own.
    pub(super) fn is_wide(&self) -> bool {
        self.is_wide
    }

    /// Rectifies the box and the ellipse of a detection. For a wide lens, its camera becomes the view around the box.
    ///
    /// # Errors
    /// If there is no such box.
    pub(super) fn rectify(&self, detection: &mut Detection) -> Result<(), String> {
        let Some(model) = self.model.as_ref().filter(|_| detection.camera.view().is_none()) else {
            return Ok(());
        };
        let seen = detection.bounding_box;
        let fault = || format!("{:?} has no place in the rectified image of the camera", seen.bounds());
        if !self.is_wide {
            let map = |pixel: &Vector2<f64>| model.rectify(pixel);
            let bounding_box = rectified(map, &seen).ok_or_else(fault)?;
            if let Some(ellipse) = &mut detection.ellipse {
                *ellipse = ellipse.mapped(map).ok_or_else(fault)?;
            }
            detection.bounding_box = bounding_box;
            return Ok(());
        }
        let mut view = model.view(&seen.centre()).ok_or_else(fault)?;
        let first = rectified(|pixel| view.project(&model.ray(pixel)?), &seen).ok_or_else(fault)?;
        // the distances of the sides from the border of the image stay
        let camera = &mut view.camera;
        (camera.cx, camera.cy) = (camera.cx + seen.xmin - first.xmin, camera.cy + seen.ymin - first.ymin);
        let grown = |size: u32, by: f64| (f64::from(size) + by).round().max(1.0) as u32;
        camera.width = grown(camera.width, first.width() - seen.width());
        camera.height = grown(camera.height, first.height() - seen.height());
        let map = |pixel: &Vector2<f64>| view.project(&model.ray(pixel)?);
        let bounding_box = rectified(map, &seen).ok_or_else(fault)?;
        if let Some(ellipse) = &mut detection.ellipse {
            *ellipse = ellipse.mapped(map).ok_or_else(fault)?;
        }
        detection.bounding_box = bounding_box;
        detection.quantities = detection.quantities.turned(view.lens_from_view.matrix()[(2, 2)]);
        detection.camera = Arc::new(detection.camera.viewed(&view));
        Ok(())
    }
}

/// Returns whether the rectified image stretches a pixel at the border of the image too much, or does not have it.
fn stretches(model: &dyn AnyCamera) -> bool {
    let [width, height] = model.pinhole().size().into();
    let border = [0.0, 0.5, 1.0].map(|x| [0.0, 0.5, 1.0].map(|y| Vector2::new(x * width, y * height)));
    let stretch = |pixel: &Vector2<f64>| {
        let from = model.rectify(pixel)?;
        let steps = [Vector2::x(), Vector2::y()].map(|step| {
            let near = model.rectify(&(pixel - step)).or_else(|| model.rectify(&(pixel + step)));
            near.map(|near| (near - from).norm())
        });
        Some(steps[0]?.max(steps[1]?))
    };
    border.iter().flatten().any(|pixel| stretch(pixel).is_none_or(|stretch| stretch > MAX_STRETCH))
}

/// Rectifies a box by the midpoints of its sides, where an upright or lying ellipse touches them.
fn rectified(map: impl Fn(&Vector2<f64>) -> Option<Vector2<f64>>, seen: &BoundingBox) -> Option<BoundingBox> {
    let [x, y] = seen.centre().into();
    let side = |u, v, axis: usize| Some(map(&Vector2::new(u, v))?[axis]);
    let bounds =
        [side(seen.xmin, y, 0)?, side(x, seen.ymin, 1)?, side(seen.xmax, y, 0)?, side(x, seen.ymax, 1)?];
    BoundingBox::new(bounds).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Cameras;
    use crate::measurement::{DepthMeasurement, Quantities};
    use crate::sequence::ClassScores;
    use manifactor_geometry::{CameraModel, KannalaBrandt, Se3};
    use manifactor_graph::checked::Positive;
    use nalgebra::Vector3;

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
            let seen = BoundingBox::new(bounds).unwrap();
            let free = rectified(|pixel| model.rectify(pixel), &seen).unwrap().bounds();
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
        let of = |lens: &Rectification| {
            let model = lens.model.clone().unwrap();
            rectified(|pixel| model.rectify(pixel), &seen)
        };
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
        let model = folds.model.unwrap();
        assert_eq!(rectified(|pixel| model.rectify(pixel), &seen), None);
    }

    /// Returns the boxes of a camera, all of one image.
    fn seen_by(lens: &Rectification, bounds: [f64; 4], depth: Option<f64>) -> Detection {
        let camera = Cameras::new(lens.camera).first().clone();
        let mut seen =
            Detection::new(camera, BoundingBox::new(bounds).unwrap(), ClassScores::single("cup", 0.9));
        if let Some(depth) = depth {
            seen.quantities = Quantities::one(DepthMeasurement(Positive::new(depth).unwrap()));
        }
        seen
    }

    #[test]
    fn only_lenses_that_stretch_their_image_are_wide() {
        assert!(!freiburg1(LENS).is_wide);
        assert!(Rectification::of_model(Arc::new(fisheye())).is_wide);
        let narrow =
            Camera { width: 200, height: 200, cx: 100.0, cy: 100.0, ..CameraModel::pinhole(&fisheye()) };
        assert!(!Rectification::of_model(Arc::new(KannalaBrandt::new(narrow, [0.0; 4]))).is_wide);
    }

    /// 180° over 800 pixels.
    fn fisheye() -> KannalaBrandt {
        let pinhole = Camera::new([254.6, 254.6, 400.0, 400.0], 800, 800).unwrap();
        KannalaBrandt::new(pinhole, [0.0; 4])
    }

    #[test]
    fn a_box_of_a_wide_lens_has_a_view_of_its_own() {
        let lens = Rectification::of_model(Arc::new(fisheye()));
        let bounds = [650.0, 380.0, 690.0, 420.0];
        let mut seen = seen_by(&lens, bounds, Some(1.0));
        lens.rectify(&mut seen).unwrap();
        let moved = seen.bounding_box.bounds().into_iter().zip(bounds).map(|(a, b)| (a - b).abs());
        assert!(moved.fold(0.0, f64::max) < 0.1, "{:?}", seen.bounding_box);
        // 270 pixels from the middle
        let angle = 270.0 / 254.6_f64;
        let axis = seen.camera.pose(&Se3::identity()).rotation.act(&Vector3::z());
        assert!((axis.x.atan2(axis.z) - angle).abs() < 1e-9, "{axis}");
        assert!((seen.quantities.depth().unwrap() - 1.0 / angle.cos()).abs() < 1e-9);
    }

    #[test]
    fn a_depth_behind_a_wide_lens_is_left_out() {
        let backwards = Camera { fx: 200.0, fy: 200.0, ..CameraModel::pinhole(&fisheye()) };
        let lens = Rectification::of_model(Arc::new(KannalaBrandt::new(backwards, [0.0; 4])));
        let mut seen = seen_by(&lens, [740.0, 380.0, 780.0, 420.0], Some(1.0));
        lens.rectify(&mut seen).unwrap();
        assert_eq!(seen.quantities.depth(), None);
        let axis = seen.camera.pose(&Se3::identity()).rotation.act(&Vector3::z());
        assert!(axis.z < 0.0, "{axis}");
    }

    #[test]
    fn a_box_of_a_wide_lens_keeps_its_distances_from_the_border() {
        let lens = Rectification::of_model(Arc::new(fisheye()));
        for bounds in
            [[150.0, 300.0, 650.0, 500.0], [530.0, 40.0, 770.0, 700.0], [100.0, 380.0, 140.0, 420.0]]
        {
            let mut seen = seen_by(&lens, bounds, None);
            lens.rectify(&mut seen).unwrap();
            let ([xmin, ymin, xmax, ymax], camera) = (seen.bounding_box.bounds(), seen.camera.model);
            let size = camera.size();
            let found = [xmin, ymin, size.x - xmax, size.y - ymax];
            let expected = [bounds[0], bounds[1], 800.0 - bounds[2], 800.0 - bounds[3]];
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.51), "{found:?}");
            // the view still sees the centre of the box ahead
            let axis = camera.ray(Vector2::new(camera.cx, camera.cy));
            assert!(axis.xy().norm() < 1e-12, "{axis}");
        }
    }
}
