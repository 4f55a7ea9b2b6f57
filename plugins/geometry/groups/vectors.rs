//! Vectors with named parts, such as velocities: Rⁿ, with x ⊞ δ = x + δ.
use crate::groups::Coordinates;
use crate::groups::lie_group::additive_group;
use manifactor_graph::{Dimension, JetOf, Lift, Manifold, Scalar, register_manifold};
use nalgebra::{SVector, U3, U6, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// Defines and registers a manifold Rⁿ whose documents have named parts of three entries each.
macro_rules! vector {
    (
        $(#[doc = $doc:literal])+
        $name:ident, $registered:literal, $document:ident ($path:literal as $title:literal), $dim:ident = $n:literal, $tangent:expr;
        example $example:literal;
        $(#[doc = $part_doc:literal] $part:ident: $first:literal,)+
    ) => {
        $(#[doc = $doc])+
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(from = $path, into = $path)]
        #[schemars(with = $path)]
        pub struct $name(pub SVector<f64, $n>);

        $(#[doc = $doc])+
        #[derive(Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[schemars(rename = $title)]
        struct $document {
            $(#[doc = $part_doc] $part: Coordinates<3>,)+
        }

        impl $name {
            /// Returns the vector with all entries zero.
            pub fn zero() -> Self {
                Self(SVector::zeros())
            }
            $(#[doc = $part_doc]
            pub fn $part(&self) -> Vector3<f64> {
                Vector3::from_fn(|i, _| self.0[$first + i])
            })+
        }

        impl Deref for $name {
            type Target = SVector<f64, $n>;
            fn deref(&self) -> &Self::Target {
                &self.0
            }
        }

        impl From<$document> for $name {
            fn from(document: $document) -> Self {
                let mut x = Self::zero();
                $(x.0.fixed_rows_mut::<3>($first).copy_from(&document.$part.vector());)+
                x
            }
        }

        impl From<$name> for $document {
            fn from(x: $name) -> Self {
                Self { $($part: Coordinates::unchecked(x.$part())),+ }
            }
        }

        impl Manifold for $name {
            type Dim = $dim;
            type Of<T: Scalar> = SVector<T, $n>;
            const TANGENT: &'static [&'static str] = &$tangent;

            fn lift<T: Scalar>(&self) -> SVector<T, $n> {
                self.0.lift()
            }
            fn seed(&self) -> SVector<JetOf<$dim>, $n> {
                let jet = |i: usize| {
                    let unit = SVector::<f64, $n>::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
                    manifactor_graph::Jet::with_gradient(self.0[i], unit.as_slice())
                };
                <$dim as Dimension>::vector(jet)
            }
            fn retract(&self, delta: &SVector<f64, $n>) -> Self {
                Self(self.0 + delta)
            }
            fn local(&self, other: &Self) -> SVector<f64, $n> {
                other.0 - self.0
            }
            fn coordinate(&self, direction: usize) -> Option<f64> {
                self.0.get(direction).copied()
            }
            fn is_finite(&self) -> bool {
                self.0.iter().all(|x| x.is_finite())
            }
        }

        additive_group!($name, $n, $registered, $example);
        register_manifold!($registered, $name);
    };
}

vector! {
    /// The velocity of a rigid body in the body frame: angular in rad/s, then linear in m/s.
    ///
    /// Tangent (wx, wy, wz, vx, vy, vz); x ⊞ δ = x + δ.
    ///
    /// ```toml
    /// [values]
    /// v0 = { type = "twist", angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] }
    /// ```
    Twist, "twist", TwistDocument("TwistDocument" as "Twist"), U6 = 6, ["wx", "wy", "wz", "vx", "vy", "vz"];
    example "{ angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] }";
    /// Angular velocity about x, y and z, in rad/s.
    angular: 0,
    /// Linear velocity along x, y and z, in m/s.
    linear: 3,
}

vector! {
    /// The velocity of a point in the world frame, in m/s.
    ///
    /// Tangent (vx, vy, vz); x ⊞ δ = x + δ.
    ///
    /// ```toml
    /// [values]
    /// v0 = { type = "velocity", linear = [0.1, 0.0, 0.5] }
    /// ```
    Velocity, "velocity", VelocityDocument("VelocityDocument" as "Velocity"), U3 = 3, ["vx", "vy", "vz"];
    example "{ linear = [0.1, 0.0, 0.5] }";
    /// Velocity along x, y and z, in m/s.
    linear: 0,
}

vector! {
    /// The bias of an inertial measurement unit: the gyroscope's in rad/s, then the accelerometer's in m/s².
    /// A measurement is the true value, plus the bias, plus noise.
    ///
    /// Tangent (gx, gy, gz, ax, ay, az); x ⊞ δ = x + δ.
    ///
    /// ```toml
    /// [values]
    /// b0 = { type = "imu_bias", gyroscope = [0.0, 0.02, 0.08], accelerometer = [0.0, 0.1, 0.05] }
    /// ```
    ImuBias, "imu_bias", ImuBiasDocument("ImuBiasDocument" as "ImuBias"), U6 = 6, ["gx", "gy", "gz", "ax", "ay", "az"];
    example "{ gyroscope = [0.0, 0.02, 0.08], accelerometer = [0.0, 0.1, 0.05] }";
    /// Bias of the gyroscope about x, y and z, in rad/s.
    gyroscope: 0,
    /// Bias of the accelerometer along x, y and z, in m/s².
    accelerometer: 3,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_imu_bias, any_twist, any_velocity};
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;
    use nalgebra::Vector6;

    manifold_laws! {
        twists_are_a_manifold: (any_twist(), any_twist(), vector::<6>(10.0));
        velocities_are_a_manifold: (any_velocity(), any_velocity(), vector::<3>(10.0));
        biases_are_a_manifold: (any_imu_bias(), any_imu_bias(), vector::<6>(10.0));
    }

    #[test]
    fn a_document_reads_back() {
        let twist = Twist(Vector6::new(0.0, 0.1, 0.2, 0.3, 0.4, 0.5));
        let text = serde_json::to_string(&twist).unwrap();
        assert_eq!(text, r#"{"angular":[0.0,0.1,0.2],"linear":[0.3,0.4,0.5]}"#);
        assert_eq!(serde_json::from_str::<Twist>(&text).unwrap(), twist);
    }
}
