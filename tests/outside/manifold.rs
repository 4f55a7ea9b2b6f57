//! A type of variable, a positive number with a logarithmic tangent space, and a factor on it.
use crate::solve_document;
use manifactor::graph::catalogue;
use manifactor::prelude::*;
use manifactor_testing::catalogue::{factor_law, manifold_law};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A positive number, x·exp(δ): tangent (log).
///
/// ```toml
/// value = { type = "test_scale", factor = 2.0 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Scale {
    /// The number.
    factor: Positive,
}

impl Manifold for Scale {
    type Dim = U1;
    type Of<T: Scalar> = T;
    const TANGENT: &'static [&'static str] = &["log"];

    fn lift<T: Scalar>(&self) -> T {
        T::from(self.factor.get())
    }
    fn seed(&self) -> JetOf<U1> {
        // x·exp(δ) at δ = 0 has the derivative x
        Jet::with_gradient(self.factor.get(), &[self.factor.get()])
    }
    fn retract(&self, delta: &Vector1<f64>) -> Self {
        let x = self.factor.get() * delta.x.clamp(-50.0, 50.0).exp();
        Self { factor: Positive::new(x).unwrap_or(self.factor) }
    }
    fn local(&self, other: &Self) -> Vector1<f64> {
        Vector1::new((other.factor.get() / self.factor.get()).ln())
    }
    fn is_finite(&self) -> bool {
        true
    }
}
register_manifold!("test_scale", Scale);

// its type in formulas, and a function of it
register_quantity!(Scale as f64);
register_functions! {
    /// Doubles a number.
    fn test_doubled(x: f64) -> f64 { x * 2.0 }
}

/// Two lengths, one measured in a scaled unit: r = x·a - b.
///
/// ```toml
/// factor = { type = "test_ratio", a = 2.0, b = 3.0 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Ratio {
    /// The length in the scaled unit.
    a: f64,
    /// The length in the unit of reference.
    b: f64,
}

impl Residual for Ratio {
    type Variables = (Scale,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (x,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(x * self.a - self.b)
    }
}
register_factor!("test_ratio", Ratio);

#[test]
fn it_obeys_the_laws() {
    manifold_law(catalogue::find("variable", "test_scale").unwrap(), 256).unwrap();
    assert_eq!(factor_law(catalogue::find("factor", "test_ratio").unwrap(), 256).unwrap().defined, 256);
}

#[test]
fn a_graph_names_it() {
    let solution = solve_document(
        "variables = [{ key = \"s\", value = { type = \"test_scale\", factor = 1.0 } }]\n\
         factors = [{ keys = [\"s\"], factor = { type = \"test_ratio\", a = 2.0, b = 3.0 } }]\n",
    );
    let s: &Scale = solution.values.get("s").unwrap();
    assert!((s.factor.get() - 1.5).abs() < 1e-9);
}

#[test]
fn a_formula_computes_with_it() {
    let solution = solve_document(
        "variables = [{ key = \"s\", value = { type = \"test_scale\", factor = 1.0 } }]\n\
         factors = [{ keys = [\"s\"], factor = { type = \"expression\", variables = { s = \"test_scale\" }, \
         residual = [\"test_doubled(s) - 3\"] } }]\n",
    );
    let s: &Scale = solution.values.get("s").unwrap();
    assert!((s.factor.get() - 1.5).abs() < 1e-9);
}
