//! Orientation of an object: its major axis is vertical or horizontal.
use crate::DualQuadric;
use crate::shapes::move_and_scale;
use manifactor_graph::prelude::*;

/// Defines a factor of the major semi-axis m of an object and the world's up direction: its docs, name and
/// residual, and the axis of rotations that leave it unchanged.
macro_rules! orientation {
    ($(#[doc = $doc:literal])* $type:ident = $name:literal: $dim:ty = |$m:ident, $up:ident| $residual:expr;
     $free:literal: |$factor:ident, $quadric:ident| $axis:expr) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $type {
            /// The world's up direction, of any length but zero. Default: z.
            #[serde(default)]
            pub up: Up,
        }

        impl Residual for $type {
            type Variables = (DualQuadric,);
            type Dim = $dim;

            fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector<$dim, T> {
                let ($m, $up): (Vector3<T>, Vector3<T>) = (quadric.major_axis(), self.up.lift());
                $residual
            }
        }
        register_factor!($name, $type, up);
        register_invariance!($type, $free, |$factor, ($quadric,), random| {
            (move_and_scale($quadric, &$axis, random),)
        });
    };
}

orientation! {
    /// The major semi-axis m of an object is vertical: r = 1 - |m · up|   (Jablonsky et al., eq. 7).
    ///
    /// Invariant to rotation about `up`, to moving and scaling, and to turning the object upside down. Its
    /// derivative vanishes if m is vertical, so convergence slows down close to it;
    /// `vertical_orientation_smooth` avoids this. If m is exactly horizontal, |·| has a kink; the derivative
    /// for m · up > 0 is used. m is the longest semi-axis at the current estimate, the first of equal ones.
    /// If a different axis becomes the longest, the residual jumps to the angle of that axis, and a nearly
    /// round object is pulled by whichever axis is longest. Defined everywhere.
    ///
    /// ```toml
    /// [[factors]]
    /// keys   = ["q0"]
    /// factor = { type = "vertical_orientation", up = [0.0, 0.0, 1.0] }
    /// noise  = { sigma = 0.1 }
    /// ```
    VerticalOrientation = "vertical_orientation": U1 = |m, up| Vector1::new(T::one() - abs(m.dot(&up)));
    "turning about up, moving and growing": |factor, quadric| factor.up
}

orientation! {
    /// The major semi-axis m of an object is vertical: r = m × up, of length sin(tilt).
    ///
    /// The residual is the component of m perpendicular to `up`, turned by a quarter about it. Unlike
    /// `vertical_orientation` it has no kink and no vanishing derivative at the solution, so Gauss-Newton
    /// converges at its usual rate. σ is in radians of tilt, close to the vertical. The jump between axes of
    /// equal length is as in `vertical_orientation`. A horizontal m is a maximum, at which the derivative of
    /// the cost vanishes.
    ///
    /// ```toml
    /// [[factors]]
    /// keys   = ["q0"]
    /// factor = { type = "vertical_orientation_smooth" }
    /// noise  = { sigma = 0.1 }
    /// ```
    VerticalOrientationSmooth = "vertical_orientation_smooth": U3 = |m, up| m.cross(&up);
    "moving, growing and turning about the axis": |_factor, quadric| quadric.major_axis()
}

orientation! {
    /// The major semi-axis m of an object is horizontal: r = 0 - |m · up|   (Jablonsky et al., eq. 7).
    ///
    /// Invariant to rotation about `up` and about m, to moving and to scaling. If m is exactly horizontal,
    /// |·| has a kink, but its square has none. The derivative for m · up > 0 is used there, and it is not
    /// zero. If m is vertical, the derivative vanishes. m is the longest semi-axis at the current estimate,
    /// the first of equal ones. If a different axis becomes the longest, the residual jumps. Defined
    /// everywhere.
    ///
    /// ```toml
    /// [[factors]]
    /// keys   = ["q0"]
    /// factor = { type = "horizontal_orientation", up = [0.0, 0.0, 1.0] }
    /// noise  = { sigma = 0.1 }
    /// ```
    HorizontalOrientation = "horizontal_orientation": U1 = |m, up| Vector1::new(-abs(m.dot(&up)));
    "turning about up, moving and growing": |factor, quadric| factor.up
}

orientation! {
    /// The major semi-axis m of an object is horizontal: r = m · up, the sine of its elevation.
    ///
    /// `horizontal_orientation` without the absolute value: the cost is equal, the sign of m does not matter,
    /// and the residual has no kink. σ is in radians, close to the horizontal. The jump between axes of equal
    /// length is as in `horizontal_orientation`.
    ///
    /// ```toml
    /// [[factors]]
    /// keys   = ["q0"]
    /// factor = { type = "horizontal_orientation_smooth" }
    /// noise  = { sigma = 0.1 }
    /// ```
    HorizontalOrientationSmooth = "horizontal_orientation_smooth": U1 = |m, up| Vector1::new(m.dot(&up));
    "turning about up, moving and growing": |factor, quadric| factor.up
}

#[cfg(test)]
mod tests;
