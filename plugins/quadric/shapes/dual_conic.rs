//! Dual conics: outlines of quadrics in an image, of any type.
use crate::shapes::BoundingBox;
use crate::shapes::Ellipse;
use nalgebra::{Matrix3, Vector2};

/// Dual conic C*, up to scale: lines l with lᵀC*l = 0 touch the conic. It is an ellipse, a hyperbola or
/// empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DualConic(pub Matrix3<f64>);

impl DualConic {
    /// Returns C*/C*₃₃; `None` if the centre is at infinity.
    pub fn unit_corner(&self) -> Option<Matrix3<f64>> {
        let c = self.0 / self.0[(2, 2)];
        c.iter().all(|x| x.is_finite()).then_some(c)
    }
    /// Returns the conic as an ellipse, or `None` if it is not a real ellipse. The outline of an object is a
    /// real ellipse only if the object is completely in front of the camera or completely behind it.
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
    /// Returns whether the conic is a real ellipse.
    pub fn is_ellipse(&self) -> bool {
        self.ellipse().is_some()
    }
    /// Returns whether the conic degenerates to one or two points, up to rounding.
    pub fn is_degenerate(&self) -> bool {
        let scale: f64 = self.0.row_iter().map(|row| row.norm()).product();
        let determinant = self.0.determinant().abs();
        determinant <= f64::EPSILON * scale || !determinant.is_finite()
    }
    /// Returns the box around the ellipse; `None` if the conic is not an ellipse.
    pub fn bounds(&self) -> Option<BoundingBox> {
        self.ellipse().map(|e| BoundingBox::from_bounds(e.bounds()))
    }
    /// Returns the exact box around the part of the ellipse inside the image. `None` if no part is inside, or
    /// if the conic is not an ellipse.
    pub fn truncated_bounds(&self, width: u32, height: u32) -> Option<BoundingBox> {
        let size = Vector2::new(f64::from(width), f64::from(height));
        self.ellipse()?.truncated_bounds(size).map(BoundingBox::from_bounds)
    }
}
