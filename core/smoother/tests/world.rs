//! A second manifold with a different dimension, and factors between both manifolds.
use crate::toy::Plane;
use manifactor_graph::{
    Dimension, Jet, JetOf, Lifted, Manifold, Refs, Residual, Scalar, register_factor, register_manifold,
};
use nalgebra::{U2, U3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Space<T = f64> {
    pub(crate) at: [T; 3],
}

impl Manifold for Space {
    type Dim = U3;
    type Of<T: Scalar> = Space<T>;
    const TANGENT: &'static [&'static str] = &["x", "y", "z"];
    fn lift<T: Scalar>(&self) -> Space<T> {
        Space { at: self.at.map(T::from) }
    }
    fn seed(&self) -> Space<JetOf<U3>> {
        let jet = <U3 as Dimension>::Jet::with_gradient;
        let unit = |i: usize| std::array::from_fn::<f64, 3, _>(|k| f64::from(u8::from(i == k)));
        Space { at: std::array::from_fn(|i| jet(self.at[i], &unit(i))) }
    }
    fn retract(&self, delta: &Vector3<f64>) -> Self {
        Space { at: std::array::from_fn(|i| self.at[i] + delta[i]) }
    }
    fn local(&self, other: &Self) -> Vector3<f64> {
        Vector3::from_fn(|i, _| other.at[i] - self.at[i])
    }
    fn is_finite(&self) -> bool {
        self.at.iter().all(|x| x.is_finite())
    }
}
register_manifold!("toy_space", Space);

/// r = b − a − by.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Beyond {
    pub(crate) by: [f64; 3],
}
impl Residual for Beyond {
    type Variables = (Space, Space);
    type Dim = U3;
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector3<T> {
        Vector3::from_fn(|i, _| b.at[i] - a.at[i] - T::from(self.by[i]))
    }
}
register_factor!("toy_beyond", Beyond);

/// r = p − (first two coordinates of s) − by, with a share of the third coordinate.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Shadow {
    pub(crate) by: [f64; 2],
}
impl Residual for Shadow {
    type Variables = (Plane, Space);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (p, s): Lifted<Self::Variables, T>) -> Vector2<T> {
        let tilt = s.at[2] * 0.3;
        Vector2::new(p.x - s.at[0] - tilt - T::from(self.by[0]), p.y - s.at[1] - T::from(self.by[1]))
    }
}
register_factor!("toy_shadow", Shadow);

/// r = s − at.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Near {
    pub(crate) at: [f64; 3],
}
impl Residual for Near {
    type Variables = (Space,);
    type Dim = U3;
    fn residual<T: Scalar>(&self, (s,): Lifted<Self::Variables, T>) -> Vector3<T> {
        Vector3::from_fn(|i, _| s.at[i] - T::from(self.at[i]))
    }
}
register_factor!("toy_near", Near);

/// r = (ln(b.x − a.x) − ln by.x, b.y − a.y − by.y); not defined unless `b` is ahead of `a`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Ahead {
    pub(crate) by: [f64; 2],
}
impl Residual for Ahead {
    type Variables = (Plane, Plane);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector2<T> {
        Vector2::new((b.x - a.x).ln() - T::from(self.by[0].ln()), b.y - a.y - T::from(self.by[1]))
    }
    fn is_defined(&self, (a, b): Refs<'_, Self::Variables>) -> bool {
        b.x > a.x
    }
}
register_factor!("toy_ahead", Ahead);
