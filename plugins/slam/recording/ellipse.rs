//! Outline of an object in an image, measured as an ellipse.
use manifactor_graph::checked::Positive;
use manifactor_quadric::BoundingBox;
use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Smallest IoU of a box with the box around its ellipse. An ellipse with diameters in place of semi-axes has a quarter.
const MIN_IOU: f64 = 0.4;

/// The outline of an object as an ellipse, for example the one with the moments of a mask.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageEllipse {
    /// Centre, x right and y down. Unit: pixels.
    pub centre: [f64; 2],
    /// Semi-axes: half of the diameters. Unit: pixels.
    pub semi_axes: [Positive; 2],
    /// Angle from the x axis of the image to the first semi-axis, towards y (down). Default: 0. Unit: radians.
    #[serde(default)]
    pub angle: f64,
}

impl ImageEllipse {
    /// Creates the ellipse (x - μ)ᵀA⁻¹(x - μ) = 1 from its centre μ and A, in px²; `None` if A is not positive definite.
    pub fn from_shape(centre: Vector2<f64>, shape: Matrix2<f64>) -> Option<Self> {
        let SymmetricEigen { eigenvectors, eigenvalues } =
            SymmetricEigen::new(0.5 * (shape + shape.transpose()));
        let semi_axis = |i: usize| Positive::new(eigenvalues[i].sqrt()).ok();
        let (semi_axes, first) = ([semi_axis(0)?, semi_axis(1)?], eigenvectors.column(0));
        centre.iter().all(|x| x.is_finite()).then(|| Self {
            centre: centre.into(),
            semi_axes,
            angle: first.y.atan2(first.x),
        })
    }

    /// Returns the symmetric square root of A, in px.
    pub fn root(&self) -> Matrix2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        let axes = Matrix2::new(cos, -sin, sin, cos);
        axes * Matrix2::from_diagonal(&Vector2::from(self.semi_axes.map(Positive::get))) * axes.transpose()
    }

    /// Returns A, in px².
    pub fn shape(&self) -> Matrix2<f64> {
        self.root() * self.root()
    }

    /// Returns the box around the ellipse.
    fn bounds(&self) -> Option<BoundingBox> {
        let ([x, y], shape) = (self.centre, self.shape());
        let [width, height] = [shape.m11.sqrt(), shape.m22.sqrt()];
        BoundingBox::new([x - width, y - height, x + width, y + height]).ok()
    }

    /// Checks that the ellipse belongs to a box.
    ///
    /// # Errors
    /// If the box around it differs, with the usual mistakes.
    pub(crate) fn check(&self, bounding_box: &BoundingBox) -> Result<(), String> {
        let bounds = self.bounds().ok_or("the ellipse is not finite")?;
        let iou = bounds.iou(bounding_box);
        if iou >= MIN_IOU {
            return Ok(());
        }
        Err(format!(
            "the ellipse does not fit into its box: the box around it is {:.1?}, with an IoU of {iou:.2}; are `semi_axes` half of \
             the diameters, and `angle` in radians from x (right) to y (down)?",
            bounds.bounds()
        ))
    }

    /// Returns the ellipse in a different image, by the linear map at its centre. `None` if the centre has no place there.
    pub(crate) fn mapped(&self, map: impl Fn(&Vector2<f64>) -> Option<Vector2<f64>>) -> Option<Self> {
        let centre = Vector2::from(self.centre);
        let to = map(&centre)?;
        let column = |step: Vector2<f64>| Some((map(&(centre + step))? - map(&(centre - step))?) / 2.0);
        let linear = Matrix2::from_columns(&[column(Vector2::x())?, column(Vector2::y())?]);
        Self::from_shape(to, linear * self.shape() * linear.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipse(angle: f64) -> ImageEllipse {
        ImageEllipse {
            centre: [100.0, 80.0],
            semi_axes: [Positive::literal(40.0), Positive::literal(10.0)],
            angle,
        }
    }

    #[test]
    fn a_shape_gives_the_ellipse_again() {
        let found = ImageEllipse::from_shape(Vector2::new(100.0, 80.0), ellipse(0.4).shape()).unwrap();
        assert!((found.shape() - ellipse(0.4).shape()).norm() < 1e-9);
        assert!(ImageEllipse::from_shape(Vector2::zeros(), Matrix2::new(1.0, 0.0, 0.0, -1.0)).is_none());
    }

    #[test]
    fn an_ellipse_has_to_fit_its_box() {
        let seen = BoundingBox::new([60.0, 70.0, 140.0, 90.0]).unwrap();
        assert_eq!(ellipse(0.0).check(&seen), Ok(()));
        assert_eq!(ellipse(std::f64::consts::PI).check(&seen), Ok(()));
        let diameters = ImageEllipse {
            semi_axes: ellipse(0.0).semi_axes.map(|axis| Positive::literal(2.0 * axis.get())),
            ..ellipse(0.0)
        };
        for wrong in [diameters, ellipse(90.0)] {
            let fault = wrong.check(&seen).unwrap_err();
            assert!(fault.contains("half of the diameters"), "{fault}");
        }
    }

    #[test]
    fn a_linear_map_of_the_image_maps_the_ellipse() {
        let map = |p: &Vector2<f64>| Some(Vector2::new(2.0 * p.x + 5.0, p.y));
        let mapped = ellipse(0.0).mapped(map).unwrap();
        assert_eq!(mapped.centre, [205.0, 80.0]);
        assert!((mapped.shape() - Matrix2::new(6400.0, 0.0, 0.0, 100.0)).norm() < 1e-9);
        assert!(ellipse(0.0).mapped(|_| None).is_none());
    }
}
