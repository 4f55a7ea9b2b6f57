//! Strategies for rotations, poses and points, including the cases that tend to break formulas.
use crate::{
    BalCamera, Camera, CameraModel, ImuBias, Intrinsics, KannalaBrandt, Point2, Point3, Radial,
    RadialTangential, Rn, Se2, Se3, Sim3, So2, So3, Twist, Velocity,
};
use manifactor_testing::register_points;
use manifactor_testing::strategies::{rotation_vector, signed_angle, vector};
use nalgebra::{SVector, Vector1, Vector2, Vector3, Vector6};
use proptest::prelude::*;
use std::f64::consts::PI;

/// Largest coordinate of points and poses, in metres.
const SIZE: f64 = 10.0;

// Samples for the checks of all factors. The singular cases are the identity and half a turn.
register_points!(So2, any_so2(), [So2::identity(), So2::exp(PI)]);
register_points!(So3, any_so3(), [So3::identity(), half_a_turn()]);
register_points!(Se2, any_se2(), [Se2::identity(), Se2::new(So2::exp(PI), Vector2::zeros())]);
register_points!(Se3, any_se3(), [Se3::identity(), Se3::new(half_a_turn(), Vector3::zeros())]);
register_points!(
    Sim3,
    any_sim3(),
    [Sim3::identity(), Sim3::rigid(Se3::new(half_a_turn(), Vector3::zeros()))]
);
register_points!(Rn<1>, any_point::<1>(), [Rn::<1>(Vector1::zeros())]);
register_points!(Point2, any_point2(), [Rn::<2>(Vector2::zeros())]);
register_points!(Point3, any_point3(), [Rn::<3>(Vector3::zeros())]);
register_points!(Twist, any_twist(), [Twist::zero()]);
register_points!(Velocity, any_velocity(), [Velocity::zero()]);
register_points!(ImuBias, any_imu_bias(), [ImuBias::zero()]);
register_points!(BalCamera, any_bal_camera(), []);
register_points!(Intrinsics<Camera>, any_pinhole(), []);
register_points!(Intrinsics<Radial>, any_radial(), []);
register_points!(Intrinsics<RadialTangential>, any_radial_tangential(), []);
register_points!(Intrinsics<KannalaBrandt>, any_kannala_brandt(), []);

/// Rotation by π about an axis that is not a coordinate axis.
fn half_a_turn() -> So3 {
    So3::exp(&(Vector3::new(2.0, -1.0, 2.0) * (PI / 3.0)))
}

/// Points with coordinates up to 10 m; sometimes the origin, or close to it.
pub fn any_point<const N: usize>() -> impl Strategy<Value = Rn<N>> + Clone {
    vector(SIZE).prop_map(Rn)
}

/// Velocities of a body, up to 10 rad/s and 10 m/s.
pub fn any_twist() -> impl Strategy<Value = Twist> + Clone {
    vector(SIZE).prop_map(Twist)
}
/// Returns a strategy for velocities up to 10 m/s.
pub fn any_velocity() -> impl Strategy<Value = Velocity> + Clone {
    vector(SIZE).prop_map(Velocity)
}
/// Returns a strategy for biases of up to 1 rad/s and m/s².
pub fn any_imu_bias() -> impl Strategy<Value = ImuBias> + Clone {
    vector(1.0).prop_map(ImuBias)
}

/// Points in the plane.
pub fn any_point2() -> impl Strategy<Value = Point2> + Clone {
    any_point()
}

/// Points in space.
pub fn any_point3() -> impl Strategy<Value = Point3> + Clone {
    any_point()
}

/// Rotations in the plane.
pub fn any_so2() -> impl Strategy<Value = So2> + Clone {
    signed_angle().prop_map(So2::exp)
}

/// Rotations in space: the identity, tiny ones, any, nearly half a turn.
pub fn any_so3() -> impl Strategy<Value = So3> + Clone {
    rotation_vector().prop_map(|omega| So3::exp(&omega))
}

/// Poses in the plane.
pub fn any_se2() -> impl Strategy<Value = Se2> + Clone {
    (any_so2(), vector::<2>(SIZE)).prop_map(|(r, t)| Se2::new(r, t))
}

/// Poses in space.
pub fn any_se3() -> impl Strategy<Value = Se3> + Clone {
    (any_so3(), vector::<3>(SIZE)).prop_map(|(r, t)| Se3::new(r, t))
}

/// Poses in space with a scale from 0.1 to 10, often close to 1.
pub fn any_sim3() -> impl Strategy<Value = Sim3> + Clone {
    (any_se3(), log_scale()).prop_map(|(x, log)| Sim3::new(x.rotation, x.translation, log.exp()))
}

/// Logarithms of scales from 0.1 to 10, often close to zero.
fn log_scale() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![1 => Just(0.0), 1 => -1e-6..1e-6f64, 1 => -0.2..0.2f64, 2 => -2.3..2.3f64]
}

/// Cameras of bundle adjustment, with some distortion.
pub fn any_bal_camera() -> impl Strategy<Value = BalCamera> + Clone {
    let distortion = vector::<2>(0.1);
    (any_se3(), 100.0..2000.0f64, distortion).prop_map(|(world_from_camera, focal_length, distortion)| {
        BalCamera { world_from_camera, focal_length, distortion }
    })
}

fn any_camera() -> impl Strategy<Value = Camera> + Clone {
    ([300.0..900.0f64, 300.0..900.0], [300.0..340.0f64, 220.0..260.0])
        .prop_map(|([fx, fy], [cx, cy])| Camera { fx, fy, cx, cy, skew: 0.0, width: 640, height: 480 })
}

/// Intrinsics of a pinhole camera.
pub fn any_pinhole() -> impl Strategy<Value = Intrinsics<Camera>> + Clone {
    any_camera().prop_map(Intrinsics)
}

/// Intrinsics of a camera with some radial distortion.
pub fn any_radial() -> impl Strategy<Value = Intrinsics<Radial>> + Clone {
    (any_camera(), vector::<2>(0.1)).prop_filter_map("a camera", |(camera, k)| {
        let numbers = [camera.fx, camera.cx, camera.cy, k.x, k.y];
        Radial::new(numbers, camera.width, camera.height).ok().map(Intrinsics)
    })
}

/// Intrinsics of a camera with some radial and tangential distortion.
pub fn any_radial_tangential() -> impl Strategy<Value = Intrinsics<RadialTangential>> + Clone {
    (any_camera(), vector::<2>(0.1), vector::<2>(0.01))
        .prop_map(|(camera, k, p)| Intrinsics(RadialTangential::new(camera, [k.x, k.y, p.x, p.y, 0.02])))
}

/// Intrinsics of a fisheye camera by Kannala and Brandt.
pub fn any_kannala_brandt() -> impl Strategy<Value = Intrinsics<KannalaBrandt>> + Clone {
    (any_camera(), vector::<4>(0.02)).prop_map(|(camera, k)| Intrinsics(KannalaBrandt::new(camera, k.into())))
}

/// Points in front of a camera that looks along +z, in the camera's frame: near and far, central and
/// off-axis.
pub fn in_front() -> impl Strategy<Value = Vector3<f64>> + Clone {
    let depth = prop_oneof![4 => 0.5..10.0f64, 1 => 100.0..1000.0f64];
    (vector::<2>(1.5), depth).prop_map(|(side, depth)| Vector3::new(side.x, side.y, 1.0) * depth)
}

/// Checks a camera model at a point that it sees: the pixel of the point unprojects to its direction.
///
/// # Errors
/// If it does not.
pub fn camera_law<M: CameraModel>(camera: &M, point: &Vector3<f64>) -> Result<(), String> {
    if !camera.sees(point) {
        return Err(format!("{camera:?} does not see {point:?}"));
    }
    let pixel = camera.project(point);
    match camera.unproject(&pixel) {
        Some(direction) if direction.angle(point) < 1e-7 => Ok(()),
        direction => Err(format!("{camera:?} has {direction:?} at the pixel of {point:?}")),
    }
}

/// Returns the direction at an angle to the optical axis, turned about it.
pub fn ray(angle: f64, turn: f64) -> Vector3<f64> {
    Vector3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos())
}

/// Tangent vectors of SO(2) inside its chart.
pub fn so2_tangent() -> impl Strategy<Value = Vector1<f64>> + Clone {
    signed_angle().prop_map(Vector1::new)
}

/// Tangent vectors of SE(2) inside its chart.
pub fn se2_tangent() -> impl Strategy<Value = Vector3<f64>> + Clone {
    (vector::<2>(SIZE), signed_angle()).prop_map(|(v, theta): (Vector2<f64>, _)| v.push(theta))
}

/// Tangent vectors of SE(3) inside its chart.
pub fn se3_tangent() -> impl Strategy<Value = Vector6<f64>> + Clone {
    (rotation_vector(), vector::<3>(SIZE)).prop_map(|(w, v)| Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z))
}

/// Tangent vectors of Sim(3) inside its chart.
pub fn sim3_tangent() -> impl Strategy<Value = SVector<f64, 7>> + Clone {
    (se3_tangent(), log_scale()).prop_map(|(xi, log)| xi.push(log))
}
