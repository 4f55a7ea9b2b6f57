use manifactor_graph::{Jet, JetOf, Manifold, Scalar, register_manifold};
use nalgebra::{U1, Vector1};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Number {
    x: f64,
}

impl Manifold for Number {
    type Dim = U1;
    type Of<T: Scalar> = T;
    const TANGENT: &'static [&'static str] = &["x"];
    fn lift<T: Scalar>(&self) -> T {
        T::from(self.x)
    }
    fn seed(&self) -> JetOf<U1> {
        Jet::with_gradient(self.x, &[1.0])
    }
    fn retract(&self, delta: &Vector1<f64>) -> Self {
        Self { x: self.x + delta.x }
    }
    fn local(&self, other: &Self) -> Vector1<f64> {
        Vector1::new(other.x - self.x)
    }
    fn is_finite(&self) -> bool {
        self.x.is_finite()
    }
}
register_manifold!("number", Number);
