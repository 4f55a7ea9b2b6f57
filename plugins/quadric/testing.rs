//! Strategies for quadrics and their views, including the cases that tend to break formulas.
use crate::{AxisOrder, Camera, DualQuadric, Ellipsoid, SemiAxes};
use manifactor_geometry::testing::{any_se3, any_so3, se3_tangent};
use manifactor_geometry::{Se3, So3};
use manifactor_testing::register_points;
use nalgebra::{SVector, Vector3};
use proptest::prelude::*;

// Samples for the checks of all factors. The singular cases: aligned with the axes, lying, and two or all
// semi-axes equal.
register_points!(
    DualQuadric,
    any_quadric(),
    [
        shaped([0.3, 0.2, 0.1]),
        shaped([0.1, 0.2, 0.3]),
        shaped([0.3, 0.3, 0.1]),
        shaped([0.1, 0.3, 0.3]),
        shaped([0.2, 0.2, 0.2]),
    ]
);

/// A quadric at the origin, aligned with the coordinate axes.
fn shaped(semi_axes: [f64; 3]) -> DualQuadric {
    DualQuadric { pose: Se3::identity(), semi_axes: semi_axes.into() }
}

/// Semi-axes from 1 cm to 10 m; sometimes two or all of them are equal.
pub fn any_semi_axes() -> impl Strategy<Value = Vector3<f64>> + Clone {
    let lengths = proptest::array::uniform3(-4.6..2.3f64).prop_map(|s| Vector3::from(s).map(f64::exp));
    (lengths, 0..10).prop_map(|(s, kind)| match kind {
        0 => Vector3::new(s.x, s.x, s.y),
        1 => Vector3::repeat(s.x),
        _ => s,
    })
}

/// Quadrics anywhere.
pub fn any_quadric() -> impl Strategy<Value = DualQuadric> + Clone {
    (any_se3(), any_semi_axes()).prop_map(|(pose, semi_axes)| DualQuadric { pose, semi_axes })
}

/// Quadrics whose semi-axes differ by more than 5 %, so that small steps do not change their order.
pub fn unequal_quadric() -> impl Strategy<Value = DualQuadric> + Clone {
    any_quadric().prop_filter("equal semi-axes", |q| {
        let s = &q.semi_axes;
        [(0, 1), (1, 2), (0, 2)].iter().all(|&(a, b)| (s[a] / s[b]).ln().abs() > 0.05)
    })
}

/// Usual semi-axes of a class, and the order of the comparison.
pub fn typical_quadric() -> impl Strategy<Value = (SemiAxes, AxisOrder)> {
    let lengths =
        prop::array::uniform3(0.01..2.0).prop_filter_map("semi-axes", |s| SemiAxes::new(s.into()).ok());
    (lengths, prop_oneof![Just(AxisOrder::Sorted), Just(AxisOrder::AsGiven)])
}

/// A bottle, one metre long, whose major axis, the local z, leans by an angle in radians from the vertical.
pub fn tilted(tilt: f64) -> DualQuadric {
    let rotation = So3::exp(&Vector3::new(tilt, 0.0, 0.0));
    DualQuadric {
        pose: Se3::new(rotation, Vector3::new(1.0, 2.0, 0.5)),
        semi_axes: Vector3::new(0.1, 0.15, 0.5),
    }
}

/// Tangent vectors inside the chart.
pub fn quadric_tangent() -> impl Strategy<Value = SVector<f64, 9>> + Clone {
    (se3_tangent(), proptest::array::uniform3(-2.0..2.0f64))
        .prop_map(|(xi, log)| SVector::from_fn(|i, _| if i < 6 { xi[i] } else { log[i - 6] }))
}

/// Cameras of common images, one in five with skew.
pub fn any_camera() -> impl Strategy<Value = Camera> + Clone {
    let sizes = prop_oneof![Just((640u32, 480u32)), Just((752, 480)), Just((1280, 720))];
    let skew = prop_oneof![4 => Just(0.0), 1 => -20.0..20.0];
    (sizes, 300.0..900.0, 0.9..1.1, -30.0..30.0, skew).prop_map(|((width, height), fx, aspect, off, skew)| {
        let [cx, cy] = [f64::from(width) / 2.0 + off, f64::from(height) / 2.0 - off];
        Camera { fx, fy: fx * aspect, cx, cy, skew, width, height }
    })
}

/// An object in front of a camera: most are desk-sized, some nearly touch the camera's plane, some are flat,
/// some tiny.
pub fn any_view() -> impl Strategy<Value = (Camera, Se3, DualQuadric)> + Clone {
    let at = (-0.7..0.7, -0.6..0.6, 0.3..20.0)
        .prop_map(|(x, y, z): (f64, f64, f64)| Vector3::new(x * z, y * z, z));
    let shape = (proptest::array::uniform3(0.2..1.0f64), 0..8).prop_map(|(s, kind)| match kind {
        0 => Vector3::repeat(s[0]),
        1 => Vector3::new(s[0], s[1], 1e-3),
        _ => Vector3::from(s),
    });
    // Largest possible depth of the object, as a share of its distance.
    let share = prop_oneof![6 => 0.01..0.6, 1 => Just(0.999), 1 => Just(1e-4)];
    (any_camera(), any_se3(), any_so3(), at, shape, share).prop_map(
        |(camera, pose, rotation, at, shape, share)| {
            let unit = DualQuadric { pose: Se3::new(rotation, at), semi_axes: shape };
            let depth = Ellipsoid::in_camera_frame(&Se3::identity(), &unit).axes.row(2).norm();
            let pose_of_object = pose.compose(&unit.pose);
            (camera, pose, DualQuadric { pose: pose_of_object, semi_axes: shape * (share * at.z / depth) })
        },
    )
}
