//! Strategies for numbers and vectors, including values at which formulas often fail.
use nalgebra::{SVector, Unit, UnitVector3, Vector3};
use proptest::prelude::*;
use std::f64::consts::PI;

/// Returns a strategy for vectors with entries up to `size`, sometimes zero or tiny.
pub fn vector<const N: usize>(size: f64) -> impl Strategy<Value = SVector<f64, N>> + Clone {
    let entries = proptest::array::uniform::<_, N>(-1.0..1.0).prop_map(SVector::<f64, N>::from);
    let scale = prop_oneof![8 => Just(size), 1 => Just(0.0), 1 => Just(size * 1e-9)];
    (entries, scale).prop_map(|(v, scale)| v * scale)
}

/// Returns a strategy for directions in space.
pub fn direction() -> impl Strategy<Value = UnitVector3<f64>> + Clone {
    // include the axes, because many formulas are singular there
    let oblique = proptest::array::uniform3(-1.0..1.0f64)
        .prop_map(Vector3::from)
        .prop_filter("too short to point anywhere", |v| v.norm() > 1e-3);
    let axis = (0..3usize, any::<bool>()).prop_map(|(i, up)| Vector3::ith(i, if up { 1.0 } else { -1.0 }));
    prop_oneof![7 => oblique, 1 => axis].prop_map(Unit::new_normalize)
}

/// Returns a strategy for angles of rotation from 0 to almost π: also zero, tiny angles, the limits of series
/// expansions, and almost half a turn.
pub fn angle() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![
        8 => 0.0..PI - 1e-2,
        1 => Just(0.0),
        1 => Just(1e-9),
        1 => 0.5e-4..2e-4,
        1 => 0.099..0.101,
        1 => (1e-5..1e-2).prop_map(|d| PI - d),
    ]
}

/// Returns a strategy for signed angles, from almost -π to almost π.
pub fn signed_angle() -> impl Strategy<Value = f64> + Clone {
    (angle(), any::<bool>()).prop_map(|(angle, left)| if left { angle } else { -angle })
}

/// Returns a strategy for rotation vectors shorter than π.
pub fn rotation_vector() -> impl Strategy<Value = Vector3<f64>> + Clone {
    (direction(), angle()).prop_map(|(axis, angle)| axis.into_inner() * angle)
}
