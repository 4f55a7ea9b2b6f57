//! Functions of rotations, poses and points for formulas.
use crate::{Point1, Point2, Point3, Se2, Se3, Sim3, So2, So3, atan2, wrap};
use manifactor_graph::{register_functions, register_quantity};
use nalgebra::{Vector2, Vector3, Vector6};

register_quantity!(Point1 as f64, |p| p.x);
register_quantity!(Point2 as Vector2<f64>);
register_quantity!(Point3 as Vector3<f64>);
register_quantity!(So2);
register_quantity!(So3);
register_quantity!(Se2);
register_quantity!(Se3);
register_quantity!(Sim3);

register_functions! {
    /// The position of a pose.
    fn position(x: Se3) -> Vector3<f64> { x.translation }

    /// The position of a pose.
    fn position(x: Se2) -> Vector2<f64> { x.translation }

    /// The rotation of a pose.
    fn rotation(x: Se3) -> So3 { x.rotation }

    /// The position of a pose with a scale.
    fn position(x: Sim3) -> Vector3<f64> { x.translation }

    /// The rotation of a pose with a scale.
    fn rotation(x: Sim3) -> So3 { x.rotation }

    /// The scale: the length in the outer frame of a unit of the local one.
    fn scale(x: Sim3) -> f64 { x.scale }

    /// The pose y, given in the frame of x and with its scale, in the outer frame.
    "*" fn compose(x: Sim3, y: Sim3) -> Sim3 { x.compose(&y) }

    /// The point p, given in the frame of x and with its scale, in the outer frame: s R p + t.
    "*" fn act(x: Sim3, p: Vector3<f64>) -> Vector3<f64> { x.act(&p) }

    /// The inverse: `inverse(x) * p` is the point p in the frame of x.
    fn inverse(x: Sim3) -> Sim3 { x.inverse() }

    /// The pose y in the frame of x: x⁻¹y.
    fn between(x: Sim3, y: Sim3) -> Sim3 { x.between(&y) }

    /// The rotation of a pose.
    fn rotation(x: Se2) -> So2 { x.rotation }

    /// The rotation about the vector `omega` by its length, in radians.
    fn rotation(omega: Vector3<f64>) -> So3 { So3::exp(&omega) }

    /// The rotation by `angle`, in radians, counter-clockwise.
    fn rotation(angle: f64) -> So2 { So2::exp(angle) }

    /// The pose with this rotation and this position.
    fn pose(rotation: So3, position: Vector3<f64>) -> Se3 { Se3::new(rotation, position) }

    /// The pose with this rotation and this position.
    fn pose(rotation: So2, position: Vector2<f64>) -> Se2 { Se2::new(rotation, position) }

    /// The composition of two rotations; y is applied first.
    "*" fn compose(x: So3, y: So3) -> So3 { x.compose(&y) }

    /// The rotated vector.
    "*" fn act(x: So3, v: Vector3<f64>) -> Vector3<f64> { x.act(&v) }

    /// The inverse rotation.
    fn inverse(x: So3) -> So3 { x.inverse() }

    /// The rotation y in the frame of x: x⁻¹y.
    fn between(x: So3, y: So3) -> So3 { x.between(&y) }

    /// The pose y, given in the frame of x, in the outer frame.
    "*" fn compose(x: Se3, y: Se3) -> Se3 { x.compose(&y) }

    /// The point p, given in the frame of x, in the outer frame.
    "*" fn act(x: Se3, p: Vector3<f64>) -> Vector3<f64> { x.act(&p) }

    /// The inverse pose: `inverse(x) * p` is the point p in the frame of x.
    fn inverse(x: Se3) -> Se3 { x.inverse() }

    /// The pose y in the frame of x: x⁻¹y.
    fn between(x: Se3, y: Se3) -> Se3 { x.between(&y) }

    /// The composition of two rotations; y is applied first.
    "*" fn compose(x: So2, y: So2) -> So2 { x.compose(&y) }

    /// The rotated vector.
    "*" fn act(x: So2, v: Vector2<f64>) -> Vector2<f64> { x.act(&v) }

    /// The inverse rotation.
    fn inverse(x: So2) -> So2 { x.inverse() }

    /// The rotation y in the frame of x: x⁻¹y.
    fn between(x: So2, y: So2) -> So2 { x.between(&y) }

    /// The pose y, given in the frame of x, in the outer frame.
    "*" fn compose(x: Se2, y: Se2) -> Se2 { x.compose(&y) }

    /// The point p, given in the frame of x, in the outer frame.
    "*" fn act(x: Se2, p: Vector2<f64>) -> Vector2<f64> { x.act(&p) }

    /// The inverse pose: `inverse(x) * p` is the point p in the frame of x.
    fn inverse(x: Se2) -> Se2 { x.inverse() }

    /// The pose y in the frame of x: x⁻¹y.
    fn between(x: Se2, y: Se2) -> Se2 { x.between(&y) }

    /// The shortest rotation vector, of length π at most, in radians.
    fn log(x: So3) -> Vector3<f64> { x.log() }

    /// The tangent vector (ω, v) from the identity to the pose.
    fn log(x: Se3) -> Vector6<f64> { x.log() }

    /// The tangent vector (v, θ) from the identity to the pose.
    fn log(x: Se2) -> Vector3<f64> { x.log() }

    /// The angle within -π..π, in radians.
    fn angle(x: So2) -> f64 { x.angle() }

    /// The x axis of the rotated frame.
    fn x_axis(x: So3) -> Vector3<f64> { x.act(&Vector3::x()) }

    /// The y axis of the rotated frame.
    fn y_axis(x: So3) -> Vector3<f64> { x.act(&Vector3::y()) }

    /// The z axis of the rotated frame.
    fn z_axis(x: So3) -> Vector3<f64> { x.act(&Vector3::z()) }

    /// The x axis of the rotated frame.
    fn x_axis(x: So2) -> Vector2<f64> { x.act(&Vector2::x()) }

    /// The y axis of the rotated frame.
    fn y_axis(x: So2) -> Vector2<f64> { x.act(&Vector2::y()) }

    /// The angle of the vector (x, y) within -π..π, in radians.
    fn atan2(y: f64, x: f64) -> f64 { atan2(y, x) }

    /// The angle wrapped to -π..π, in radians.
    fn wrap(angle: f64) -> f64 { wrap(angle) }

    /// The angle between two vectors, 0 to π. It has a kink at both ends; the derivative returned there is
    /// zero.
    fn angle(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
        let across = a.cross(&b).norm_squared();
        atan2(if across > T::zero() { across.sqrt() } else { across }, a.dot(&b))
    }

    /// The angle from a to b, counter-clockwise, within -π..π.
    fn angle(a: Vector2<f64>, b: Vector2<f64>) -> f64 { atan2(a.x * b.y - a.y * b.x, a.dot(&b)) }
}
