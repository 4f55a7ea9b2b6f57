//! Outlines of ellipsoids in a parallel projection.
use crate::drawing::scale::FAR;
use crate::drawing::viewpoint::Plane;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Point2, Vector3};

/// An ellipsoid, the shape of a drawn object.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shape {
    /// Centre. Unit: metres.
    pub(crate) centroid: Vector3<f64>,
    /// One semi-axis per column: R diag(s). Unit: metres.
    pub(crate) axes: Matrix3<f64>,
}

/// Number of corners of the polygon that approximates an ellipse.
const CORNERS: usize = 48;

impl Shape {
    /// Returns the closed outline of its projection, the ellipse of Σ a_k a_kᵀ with the projected semi-axes
    /// a_k. `None` if no finite outline lies within the range of an axis.
    pub(crate) fn outline(&self, plane: &Plane) -> Option<Vec<Point2<f64>>> {
        let projected = self.axes.column_iter().map(|a| plane.project(&a.into_owned()).coords);
        let projected = Matrix2x3::from_columns(&projected.collect::<Vec<_>>());
        ellipse(&plane.project(&self.centroid), &(projected * projected.transpose()))
    }
}

/// Returns the closed polygon of an ellipse: centre + L (cos φ, sin φ) with L Lᵀ = Σ, and the first point
/// repeated at the end. `None` if no finite outline lies within the range of an axis.
pub(crate) fn ellipse(centre: &Point2<f64>, shape: &Matrix2<f64>) -> Option<Vec<Point2<f64>>> {
    // a hand-written Cholesky factorization, because degenerate ellipses are allowed
    let a = shape.m11.sqrt();
    let b = if a > 0.0 { shape.m21 / a } else { 0.0 };
    let c = (shape.m22 - b * b).max(0.0).sqrt();
    let point = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * (k % CORNERS) as f64 / CORNERS as f64).sin_cos();
        Point2::new(centre.x + a * cos, centre.y + b * cos + c * sin)
    };
    let is_drawable = |p: &Point2<f64>| p.iter().all(|x| x.abs() <= FAR);
    (0..=CORNERS).map(point).map(|p| is_drawable(&p).then_some(p)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::viewpoint::Viewpoint;
    use manifactor_graph::Direction;

    fn top() -> Plane {
        Viewpoint::Top.plane(&Direction::Z)
    }

    #[test]
    fn an_ellipse_touches_the_bounds_of_its_ellipsoid() {
        let axes = nalgebra::Rotation3::from_euler_angles(0.4, -0.3, 1.1).into_inner()
            * Matrix3::from_diagonal(&Vector3::new(0.5, 0.2, 0.1));
        let shape = Shape { centroid: Vector3::new(1.0, 2.0, 3.0), axes };
        let outline = shape.outline(&top()).unwrap();
        let widest = outline.iter().map(|p| p.x - 1.0).fold(0.0, f64::max);
        // the half width of an ellipsoid along x is the norm of that row of R diag(s)
        assert!((widest - axes.row(0).norm()).abs() < 1e-12);
        let highest = outline.iter().map(|p| p.y - 2.0).fold(0.0, f64::max);
        assert!(highest <= axes.row(1).norm() + 1e-12 && highest > 0.99 * axes.row(1).norm());
        assert_eq!(outline.first(), outline.last());
    }

    #[test]
    fn flat_and_broken_shapes_do_no_harm() {
        let flat = Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 0.0));
        let flat = Shape { centroid: Vector3::zeros(), axes: flat };
        assert!(flat.outline(&top()).is_some());
        let broken = Shape { centroid: Vector3::repeat(f64::NAN), axes: Matrix3::identity() };
        assert_eq!(broken.outline(&top()), None);
    }
}
