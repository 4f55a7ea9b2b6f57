//! Smooth manifolds: the types of a graph's variables.
use crate::algebra::{Dimension, Vector};
use crate::algebra::{JetOf, Scalar};
use std::fmt::Debug;

/// A smooth manifold with a chart around each point.
///
/// `retract(x, δ)` maps a tangent vector at `x` to a point, and `local` is its inverse:
/// `x.retract(&x.local(&y)) == y`, and `x.retract(&0) == x`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be a variable: it is not a `Manifold`",
    label = "not a manifold",
    note = "implement `Manifold` for `{Self}`, or use a registered one such as `Se3`"
)]
pub trait Manifold: Clone + Debug + Send + Sync + 'static {
    /// Dimension of the tangent space, at most 32.
    type Dim: Dimension;
    /// The point type over the scalar `T`; `Of<f64>` need not be `Self`.
    type Of<T: Scalar>;
    /// A name for each tangent direction, in tangent order. `fixed = [...]` and reports use these names.
    const TANGENT: &'static [&'static str];

    /// Returns the point over `T`, with derivative zero.
    fn lift<T: Scalar>(&self) -> Self::Of<T>;

    /// Returns `retract(self, δ)` at δ = 0, with its derivative with respect to δ.
    ///
    /// Write the derivative of the chart directly: the exponential map on dual numbers costs more and is
    /// singular at zero.
    fn seed(&self) -> Self::Of<JetOf<Self::Dim>>;

    /// Returns the point that the tangent vector `delta` leads to.
    fn retract(&self, delta: &Vector<Self::Dim>) -> Self;

    /// Returns the tangent vector that leads to `other`.
    fn local(&self, other: &Self) -> Vector<Self::Dim>;

    /// Returns the coordinate to which steps along a direction add: `x.retract(&δ).coordinate(i)` is
    /// `x.coordinate(i) + δ[i]`, also in rounding. `None` along directions without one, such as rotations; those
    /// cannot have bounds. Default: `None`.
    fn coordinate(&self, _direction: usize) -> Option<f64> {
        None
    }

    /// Returns the place in space where pictures of a graph show the point, in the frame of the graph and in the
    /// unit of its lengths. `None` if it has none, such as a rotation. Default: `None`.
    fn position(&self) -> Option<[f64; 3]> {
        None
    }

    /// Returns the tangent vector along which the point moves if everything in the frame of the graph moves. `None` if
    /// it stays, such as the intrinsics of a camera. Default: `None`.
    ///
    /// A cost that does not change along it is reported as a free position, orientation or scale.
    fn moved(&self, _motion: Motion) -> Option<Vector<Self::Dim>> {
        None
    }

    /// Returns whether every coordinate is finite.
    fn is_finite(&self) -> bool;
}

/// A motion of everything in the frame of a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Along the axis with this index.
    Translation(usize),
    /// About the axis with this index, through the origin.
    Rotation(usize),
    /// Away from the origin, by one per unit of distance.
    Scale,
}

impl Motion {
    /// All motions.
    pub const ALL: [Self; 7] = [
        Self::Translation(0),
        Self::Translation(1),
        Self::Translation(2),
        Self::Rotation(0),
        Self::Rotation(1),
        Self::Rotation(2),
        Self::Scale,
    ];

    /// Returns the velocity of rotation, in the frame of the graph.
    pub fn rotation(self) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(self == Self::Rotation(axis)))
    }

    /// Returns the velocity of a place, in the frame of the graph.
    pub fn velocity(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Translation(moving) => std::array::from_fn(|axis| f64::from(axis == moving)),
            Self::Rotation(_) => {
                let [wx, wy, wz] = self.rotation();
                [wy * z - wz * y, wz * x - wx * z, wx * y - wy * x]
            }
            Self::Scale => [x, y, z],
        }
    }
}

/// A tangent vector of `M`.
pub type Tangent<M> = Vector<<M as Manifold>::Dim>;
