//! An object stands, or lies.
use crate::DualQuadric;
use crate::shapes::turned;
use manifactor_graph::prelude::*;

/// A factor on the major semi-axis m of an object and the world's up: its docs, its name, its residual, and about which
/// axis an object may turn without a change of it.
macro_rules! orientation {
    ($(#[doc = $doc:literal])* $type:ident = $name:literal: $dim:ty = |$m:ident, $up:ident| $residual:expr;
     $free:literal: |$factor:ident, $quadric:ident| $axis:expr) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $type {
            /// The world's up, of any length but zero. Default: z.
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
            (turned($quadric, &$axis, random),)
        });
    };
}

orientation! {
    /// The major semi-axis m of an object is vertical: r = 1 - |m · up|   (Jablonsky et al., eq. 7).
    ///
    /// Turning about `up`, moving, growing and turning upside down leave it unchanged. Its derivative
    /// vanishes where m is vertical, so the last digits come slowly there;
    /// `vertical_orientation_smooth` has no such place. Where m is exactly horizontal, |·| has a kink;
    /// the derivative is that of m · up > 0. m is the longest semi-axis at the current estimate, the first
    /// of equals: where another becomes the longest, the residual jumps to the angle of that axis, and a
    /// nearly round object is pulled by whichever axis leads. It is defined everywhere.
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
    /// The components of m perpendicular to `up`, turned by a quarter about it: `vertical_orientation`
    /// without its kink and without its flat place, so that Gauss-Newton converges at its usual speed.
    /// σ is in radians of tilt, near the vertical. The jump between axes of equal length is the same.
    /// A horizontal m is a maximum, where the derivative of the cost vanishes.
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
    /// Turning about `up`, about m, moving and growing leave it unchanged. Where m is exactly horizontal,
    /// |·| has a kink, its square has none: the derivative taken there is that of m · up > 0, and it is
    /// not zero. Where m is vertical, the derivative vanishes. m is the longest semi-axis at the current
    /// estimate, the first of equals: where another becomes the longest, the residual jumps. It is defined
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
    /// `horizontal_orientation` without the absolute value: its square is the same, the sign of m does not
    /// matter, and the residual has no kink. σ is in radians, near the horizontal. The jump between axes of
    /// equal length is the same.
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
