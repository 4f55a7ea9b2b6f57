//! A manifold and factors that are simple enough to solve by hand.
#![allow(dead_code, missing_docs, unreachable_pub)]
use manifactor_graph::{
    Dimension, Jacobians, Jet, JetOf, Lifted, List, Manifold, Many, Refs, Residual, Scalar, register_factor,
    register_manifold,
};
use nalgebra::{Matrix2, U1, U2, U3, Vector1, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A point in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Plane<T = f64> {
    pub x: T,
    pub y: T,
}

impl Manifold for Plane {
    type Dim = U2;
    type Of<T: Scalar> = Plane<T>;
    const TANGENT: &'static [&'static str] = &["x", "y"];
    fn lift<T: Scalar>(&self) -> Plane<T> {
        Plane { x: T::from(self.x), y: T::from(self.y) }
    }
    fn seed(&self) -> Plane<JetOf<U2>> {
        let jet = <U2 as Dimension>::Jet::with_gradient;
        Plane { x: jet(self.x, &[1.0, 0.0]), y: jet(self.y, &[0.0, 1.0]) }
    }
    fn retract(&self, delta: &Vector2<f64>) -> Self {
        Plane { x: self.x + delta.x, y: self.y + delta.y }
    }
    fn local(&self, other: &Self) -> Vector2<f64> {
        Vector2::new(other.x - self.x, other.y - self.y)
    }
    fn coordinate(&self, direction: usize) -> Option<f64> {
        [self.x, self.y].get(direction).copied()
    }
    fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}
register_manifold!("toy_plane", Plane);

/// Rosenbrock's valley.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Valley {}
impl Residual for Valley {
    type Variables = (Plane,);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector2<T> {
        Vector2::new((p.y - p.x * p.x) * 10.0, T::one() - p.x)
    }
}
register_factor!("toy_valley", Valley);

/// r = p - at.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct At {
    pub at: [f64; 2],
}
impl Residual for At {
    type Variables = (Plane,);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector2<T> {
        Vector2::new(p.x - T::from(self.at[0]), p.y - T::from(self.at[1]))
    }
}
register_factor!("toy_at", At);

/// r = b - a - by.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Apart {
    pub by: [f64; 2],
}
impl Residual for Apart {
    type Variables = (Plane, Plane);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector2<T> {
        Vector2::new(b.x - a.x - T::from(self.by[0]), b.y - a.y - T::from(self.by[1]))
    }
}
register_factor!("toy_apart", Apart);

/// Distance minus `by`. Nonlinear, so that threads could produce different results.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Distance {
    pub by: f64,
}
impl Residual for Distance {
    type Variables = (Plane, Plane);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector1<T> {
        let (x, y) = (b.x - a.x, b.y - a.y);
        Vector1::new((x * x + y * y).sqrt() - T::from(self.by))
    }
}
register_factor!("toy_distance", Distance);

/// Centre of any number of points.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Centre {
    pub at: [f64; 2],
}
impl Residual for Centre {
    type Variables = Many<Plane>;
    type Dim = U2;
    fn residual<T: Scalar>(&self, points: List<Plane<T>>) -> Vector2<T> {
        let n = T::from(points.len() as f64);
        let sum = points.iter().fold((T::zero(), T::zero()), |s, p| (s.0 + p.x, s.1 + p.y));
        Vector2::new(sum.0 / n - T::from(self.at[0]), sum.1 / n - T::from(self.at[1]))
    }
}
register_factor!("toy_centre", Centre);

/// r = ln x - ln to; undefined for x ≤ 0.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Logarithm {
    pub to: f64,
}
impl Residual for Logarithm {
    type Variables = (Plane,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(p.x.ln() - T::from(self.to.ln()))
    }
    fn is_defined(&self, (p,): Refs<'_, Self::Variables>) -> bool {
        p.x > 0.0
    }
}
register_factor!("toy_logarithm", Logarithm);

/// r = √x, which is NaN for negative x, without `is_defined`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Careless {}
impl Residual for Careless {
    type Variables = (Plane,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(p.x.sqrt())
    }
}
register_factor!("toy_careless", Careless);

/// r = √x − less, whose derivative is not finite at 0.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Root {
    pub less: f64,
}
impl Residual for Root {
    type Variables = (Plane,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(p.x.sqrt() - T::from(self.less))
    }
}
register_factor!("toy_root", Root);

/// r = x − at, with a Jacobian of the wrong sign.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct WrongSign {
    pub at: f64,
}
impl Residual for WrongSign {
    type Variables = (Plane,);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector2<T> {
        Vector2::new(p.x - T::from(self.at), p.y)
    }
    fn linearize(
        &self,
        (p,): Refs<'_, Self::Variables>,
        _: &[bool],
        (jacobian,): &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        *jacobian = Matrix2::new(-1.0, 0.0, 0.0, 1.0);
        Vector2::new(p.x - self.at, p.y)
    }
}
register_factor!("toy_wrong_sign", WrongSign);

/// r = (atan(2.5 x) + 2.1, x / 10 - 2.1): from x = -1.8, Gauss-Newton goes to a local minimum above its start.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct TwoMinima {}
impl Residual for TwoMinima {
    type Variables = (Plane,);
    type Dim = U3;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector3<T> {
        Vector3::new((p.x * 2.5).atan() + T::from(2.1), p.x * 0.1 - T::from(2.1), p.y)
    }
}
register_factor!("toy_two_minima", TwoMinima);

/// r = x + 1, and NaN for x ≤ 0, without `is_defined`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Cliff {}
impl Residual for Cliff {
    type Variables = (Plane,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let beyond = p.x <= T::zero();
        Vector1::new(if beyond { T::from(f64::NAN) } else { p.x + T::one() })
    }
}
register_factor!("toy_cliff", Cliff);

/// r = 500 (x − from) / y − pixel: a camera on the x axis that looks along y. Undefined behind it.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct View {
    pub from: f64,
    pub pixel: f64,
}
impl Residual for View {
    type Variables = (Plane,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new((p.x - T::from(self.from)) * 500.0 / p.y - T::from(self.pixel))
    }
    fn is_defined(&self, (p,): Refs<'_, Self::Variables>) -> bool {
        p.y > 0.0
    }
}
register_factor!("toy_view", View);
