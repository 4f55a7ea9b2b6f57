//! Interpolation between two poses, with constant velocity in the frame of the body.
use crate::Se3;
use nalgebra::{Matrix6, Vector6};
use std::ops::RangeInclusive;

/// Largest rotation between the two poses, in radians: at π, the shortest rotation jumps.
const MAX_ROTATION: f64 = 3.1;

/// A pose on the way from one pose to a second one.
pub(super) struct Interpolation {
    /// ξ = Log(X₀⁻¹ X₁).
    twist: Vector6<f64>,
    /// s, the time as a fraction of the interval.
    fraction: f64,
    /// X₀ Exp(s ξ).
    pub(super) pose: Se3,
}

/// The derivatives of the interpolated pose.
pub(super) struct Derivatives {
    /// With respect to the two poses.
    pub(super) by_poses: [Matrix6<f64>; 2],
    /// With respect to the fraction.
    pub(super) by_fraction: Vector6<f64>,
}

impl Interpolation {
    /// Fractions at which the pose is defined: a time offset changes during a solve, and one interval on either side
    /// leaves room for that.
    pub(super) const FRACTIONS: RangeInclusive<f64> = -1.0..=2.0;

    pub(super) fn new(first: &Se3, second: &Se3, fraction: f64) -> Self {
        let twist = first.between(second).log();
        Self { twist, fraction, pose: first.compose(&Se3::exp(&(twist * fraction))) }
    }

    pub(super) fn is_defined(&self) -> bool {
        Self::FRACTIONS.contains(&self.fraction) && self.twist.fixed_rows::<3>(0).norm() <= MAX_ROTATION
    }

    /// Returns the derivatives of the pose.
    ///
    /// A step δ of X₀ changes ξ by -Jₗ⁻¹(ξ) δ, a step of X₁ changes it by Jᵣ⁻¹(ξ) δ, and Jₗ(ξ) = Jᵣ(-ξ). A change
    /// ε of ξ moves the pose by s Jᵣ(s ξ) ε, and X₀ Exp(δ) Exp(s ξ) = X₀ Exp(s ξ) Exp(Ad(Exp(-s ξ)) δ).
    pub(super) fn derivatives(&self) -> Derivatives {
        let part = self.twist * self.fraction;
        let by_twist = Se3::right_jacobian(&part) * self.fraction;
        let carried = Se3::exp(&-part).adjoint();
        let by_first = carried - by_twist * Se3::inverse_right_jacobian(&-self.twist);
        let by_second = by_twist * Se3::inverse_right_jacobian(&self.twist);
        Derivatives { by_poses: [by_first, by_second], by_fraction: self.twist }
    }
}
