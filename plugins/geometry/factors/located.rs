//! Variables that have a position: points and poses.
use crate::{Point2, Point3, Se2, Se3};
use manifactor_graph::{Dimension, Manifold, Scalar, Vector};
use nalgebra::{U2, U3, Vector2, Vector3};

/// A variable with a position in the plane or in space.
pub trait Located: Manifold {
    /// Number of coordinates.
    type Space: Dimension;
    /// Name in documents.
    const NAME: &'static str;
    /// Returns the position.
    fn position<T: Scalar>(x: &Self::Of<T>) -> Vector<Self::Space, T>;
}

impl Located for Point2 {
    type Space = U2;
    const NAME: &'static str = "point2";
    fn position<T: Scalar>(x: &Vector2<T>) -> Vector2<T> {
        *x
    }
}

impl Located for Point3 {
    type Space = U3;
    const NAME: &'static str = "point3";
    fn position<T: Scalar>(x: &Vector3<T>) -> Vector3<T> {
        *x
    }
}

impl Located for Se2 {
    type Space = U2;
    const NAME: &'static str = "se2";
    fn position<T: Scalar>(x: &Se2<T>) -> Vector2<T> {
        x.translation
    }
}

impl Located for Se3 {
    type Space = U3;
    const NAME: &'static str = "se3";
    fn position<T: Scalar>(x: &Se3<T>) -> Vector3<T> {
        x.translation
    }
}
