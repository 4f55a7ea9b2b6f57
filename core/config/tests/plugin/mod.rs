//! A small plugin: two manifolds and three factors.
#![allow(unreachable_pub, reason = "a module of tests, written as a plugin would be")]
use manifactor_graph::{Jet, JetOf, register_factor, register_manifold};
use manifactor_graph::{Lifted, List, Manifold, Many, Residual, Scalar, Vector};
use nalgebra::{U1, U2, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A point of the plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    pub x: f64,
    pub y: f64,
}

impl Manifold for Plane {
    type Dim = U2;
    type Of<T: Scalar> = Vector2<T>;
    const TANGENT: &'static [&'static str] = &["x", "y"];
    fn lift<T: Scalar>(&self) -> Vector2<T> {
        Vector2::new(T::from(self.x), T::from(self.y))
    }
    fn seed(&self) -> Vector2<JetOf<U2>> {
        Vector2::new(Jet::with_gradient(self.x, &[1.0, 0.0]), Jet::with_gradient(self.y, &[0.0, 1.0]))
    }
    fn retract(&self, delta: &Vector2<f64>) -> Self {
        Plane { x: self.x + delta.x, y: self.y + delta.y }
    }
    fn local(&self, other: &Self) -> Vector2<f64> {
        Vector2::new(other.x - self.x, other.y - self.y)
    }
    fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}
register_manifold!("plane", Plane);

/// A number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Real {
    pub value: f64,
}

impl Manifold for Real {
    type Dim = U1;
    type Of<T: Scalar> = T;
    const TANGENT: &'static [&'static str] = &["value"];
    fn lift<T: Scalar>(&self) -> T {
        T::from(self.value)
    }
    fn seed(&self) -> JetOf<U1> {
        Jet::with_gradient(self.value, &[1.0])
    }
    fn retract(&self, delta: &Vector<U1>) -> Self {
        Real { value: self.value + delta[0] }
    }
    fn local(&self, other: &Self) -> Vector<U1> {
        Vector::<U1>::new(other.value - self.value)
    }
    fn is_finite(&self) -> bool {
        self.value.is_finite()
    }
}
register_manifold!("real", Real);

/// The position of the second point relative to the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Offset {
    pub measured: [f64; 2],
}
impl Residual for Offset {
    type Variables = (Plane, Plane);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector2<T> {
        b - a - Vector2::from(self.measured.map(T::from))
    }
}
register_factor!("offset", Offset);

/// The height of a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Height {
    #[serde(default)]
    pub unit: Unit,
}
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    #[default]
    Metre,
    Scaled(f64),
}
impl Residual for Height {
    type Variables = (Plane, Real);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (point, height): Lifted<Self::Variables, T>) -> Vector<U1, T> {
        Vector::<U1, T>::new(point.y - height)
    }
}
register_factor!("height", Height);

/// Numbers that sum to zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Balance {}
impl Residual for Balance {
    type Variables = Many<Real>;
    type Dim = U1;
    fn residual<T: Scalar>(&self, numbers: List<T>) -> Vector<U1, T> {
        Vector::<U1, T>::new(numbers.iter().fold(T::zero(), |sum, x| sum + *x))
    }
}
register_factor!("balance", Balance);
