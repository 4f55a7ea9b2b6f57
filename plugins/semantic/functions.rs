//! What formulas know of planes.
use crate::{Plane, PlaneOf};
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Scalar, register_functions, register_quantity};
use nalgebra::Vector3;

/// The normal, then the offset.
impl Quantity for Plane {
    const SHAPE: Shape = Shape { name: "plane", size: 4 };
    type Of<T: Scalar> = PlaneOf<T>;
    fn read<T: Scalar>(from: &[T]) -> PlaneOf<T> {
        PlaneOf { normal: Vector3::<f64>::read(from), offset: from[3] }
    }
    fn write<T: Scalar>(x: &PlaneOf<T>, to: &mut [T]) {
        Vector3::<f64>::write(&x.normal, &mut to[..3]);
        to[3] = x.offset;
    }
}
register_quantity!(Plane);

register_functions! {
    /// The normal of a plane, a unit vector.
    fn normal(plane: Plane) -> Vector3<f64> { plane.normal }

    /// How far a plane is from the origin along its normal.
    fn offset(plane: Plane) -> f64 { plane.offset }

    /// How far a point is above a plane, along its normal.
    fn height(plane: Plane, p: Vector3<f64>) -> f64 { plane.height(&p) }
}
