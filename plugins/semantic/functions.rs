//! Functions of planes for formulas.
use crate::{Plane, PlaneOf};
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Scalar, register_functions, register_quantity};
use nalgebra::Vector3;

/// Storage order: the normal, then the offset.
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
    /// The unit normal of a plane.
    fn normal(plane: Plane) -> Vector3<f64> { plane.normal }

    /// The distance of a plane from the origin along its normal.
    fn offset(plane: Plane) -> f64 { plane.offset }

    /// The height of a point above a plane, along its normal.
    fn height(plane: Plane, p: Vector3<f64>) -> f64 { plane.height(&p) }
}
