//! Pinhole camera that agrees with a lens around one pixel.
use crate::{Camera, CameraModel, So3};
use nalgebra::{Matrix3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pinhole camera turned towards the direction of one pixel of a lens.
///
/// Around the pixel, its image is the image of the lens to first order, up to a shift. The noise of measurements there
/// is therefore the same. Each box in the image of a wide lens has its own view.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraView {
    /// Rotation from the view to the lens.
    pub lens_from_view: So3,
    /// The pinhole camera. Its principal point is the image of the pixel.
    pub camera: Camera,
}

impl CameraView {
    /// Creates the view at a pixel, with the pixel at the same place and the image size of the lens; `None` if the lens
    /// has no ray there.
    pub fn new(lens: &impl CameraModel, pixel: &Vector2<f64>) -> Option<Self> {
        let z = lens.unproject(pixel)?.try_normalize(0.0).filter(|ray| lens.sees(ray))?;
        // both gradients are orthogonal to the ray, since a projection does not depend on the distance
        let slope = lens.derivative(&z);
        let [by_u, by_v] = [slope.row(0).transpose(), slope.row(1).transpose()];
        // v does not depend on x
        let y = by_v.try_normalize(0.0)?;
        let x = y.cross(&z);
        let camera = Camera {
            fx: by_u.dot(&x),
            fy: by_v.norm(),
            skew: by_u.dot(&y),
            cx: pixel.x,
            cy: pixel.y,
            ..lens.pinhole()
        };
        let lens_from_view = So3::from_matrix(&Matrix3::from_columns(&[x, y, z]));
        (camera.fx > 0.0).then_some(Self { lens_from_view, camera })
    }

    /// Returns the pixel of a direction in the frame of the lens; `None` beyond 70° from the axis of the view.
    pub fn project(&self, direction: &Vector3<f64>) -> Option<Vector2<f64>> {
        super::camera_model::project_ahead(&self.camera, &self.lens_from_view.inverse().act(direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Distortion, DoubleSphere, KannalaBrandt, RadialTangential};
    use manifactor_graph::checked::Share;

    fn agrees(lens: &impl CameraModel, pixel: Vector2<f64>) {
        let view = CameraView::new(lens, &pixel).unwrap();
        let seen = |pixel: Vector2<f64>| view.project(&lens.unproject(&pixel).unwrap()).unwrap();
        assert!((seen(pixel) - pixel).norm() < 1e-9, "{pixel}");
        let step = 1e-3;
        for direction in [Vector2::x(), Vector2::y()] {
            let slope = (seen(pixel + step * direction) - seen(pixel - step * direction)) / (2.0 * step);
            assert!((slope - direction).norm() < 1e-6, "{pixel} {slope}");
        }
    }

    #[test]
    fn a_view_agrees_with_its_lens_to_first_order() {
        let pinhole = Camera::new([285.0, 290.0, 424.0, 400.0], 848, 800).unwrap();
        for pixel in [[424.0, 400.0], [20.0, 400.0], [700.0, 90.0], [424.0, 790.0], [130.0, 640.0]] {
            let pixel = Vector2::from(pixel);
            agrees(&pinhole, pixel);
            agrees(&KannalaBrandt::new(pinhole, [-0.005, 0.04, -0.037, 0.006]), pixel);
            agrees(&DoubleSphere::new(pinhole, -0.25, Share::literal(0.55)).unwrap(), pixel);
            let distortion = Distortion::from([-0.05, 0.01, 0.001, -0.002, 0.0]);
            agrees(&RadialTangential::new(pinhole, distortion), pixel);
        }
    }

    #[test]
    fn a_view_looks_behind_the_lens_and_not_beyond_its_image() {
        let pinhole = Camera::new([200.0, 200.0, 400.0, 400.0], 800, 800).unwrap();
        let lens = KannalaBrandt::new(pinhole, [0.0; 4]);
        let view = CameraView::new(&lens, &Vector2::new(750.0, 400.0)).unwrap();
        let axis = view.lens_from_view.act(&Vector3::z());
        assert!((axis.x.atan2(axis.z) - 1.75).abs() < 1e-9, "{axis}");
        assert_eq!(view.project(&Vector3::z()), None);
        assert_eq!(CameraView::new(&lens, &Vector2::new(1100.0, 400.0)), None);
    }
}
