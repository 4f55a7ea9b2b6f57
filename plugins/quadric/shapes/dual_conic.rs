//! Dual conics: outlines of quadrics in an image, of whatever kind they are.
use crate::shapes::BoundingBox;
use crate::shapes::Ellipse;
use nalgebra::{Matrix3, Vector2};

/// C*, up to scale: its lines l with lᵀC*l = 0 touch the conic. An ellipse, a hyperbola, or nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DualConic(pub Matrix3<f64>);

impl DualConic {
    /// C*/C*₃₃; `None` where the centre is at infinity.
    pub fn unit_corner(&self) -> Option<Matrix3<f64>> {
        let c = self.0 / self.0[(2, 2)];
        c.iter().all(|x| x.is_finite()).then_some(c)
    }
    /// The conic as an ellipse; `None` where it is not a real one, which the outline of an object is
    /// only where the object is wholly in front of the camera, or wholly behind it.
    pub fn ellipse(&self) -> Option<Ellipse> {
        let c = self.unit_corner()?;
        let centre = Vector2::new(c[(0, 2)], c[(1, 2)]);
        let shape = centre * centre.transpose() - c.fixed_view::<2, 2>(0, 0);
        let determinant = shape.determinant();
        let real = shape[(0, 0)] > 0.0 && shape[(1, 1)] > 0.0 && determinant > 0.0;
        real.then_some(Ellipse {
            centre,
            xx: shape[(0, 0)],
            xy: shape[(0, 1)],
            yy: shape[(1, 1)],
            determinant,
        })
    }
    /// Returns whether it is a real ellipse.
    pub fn is_ellipse(&self) -> bool {
        self.ellipse().is_some()
    }
    /// Returns whether it is less than a conic: a point or two, to within rounding.
    pub fn is_degenerate(&self) -> bool {
        let scale: f64 = self.0.row_iter().map(|row| row.norm()).product();
        let determinant = self.0.determinant().abs();
        determinant <= f64::EPSILON * scale || !determinant.is_finite()
    }
    /// The box around the ellipse; `None` where it is none.
    pub fn bounds(&self) -> Option<BoundingBox> {
        self.ellipse().map(|e| BoundingBox::from_bounds(e.bounds()))
    }
    /// The box around the part of the ellipse that is inside of the image, exactly; `None` where
    /// nothing of it is, or it is no ellipse.
    pub fn truncated_bounds(&self, width: u32, height: u32) -> Option<BoundingBox> {
        let size = Vector2::new(f64::from(width), f64::from(height));
        self.ellipse()?.truncated_bounds(size).map(BoundingBox::from_bounds)
    }
}
