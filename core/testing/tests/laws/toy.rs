//! Correct variables and factors, and variants with one flaw each.
use manifactor_graph::{
    Jacobians, Jet, JetOf, Lifted, Manifold, Many, Refs, Residual, Scalar, register_factor,
    register_manifold, register_quantity,
};
use nalgebra::{Matrix2, U1, U2, Vector1, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) const SOUND: u8 = 0;
pub(crate) const LONG_STEPS: u8 = 1;
pub(crate) const DRIFTING: u8 = 2;
pub(crate) const UNEVEN_NAMES: u8 = 3;
pub(crate) const ROUNDED_DOCUMENT: u8 = 4;
pub(crate) const DOUBLED_SEED: u8 = 5;
pub(crate) const INFINITE: u8 = 6;
pub(crate) const WRONG_SIGN: u8 = 7;
pub(crate) const UNWRITTEN_BLOCK: u8 = 8;
pub(crate) const OTHER_RESIDUAL: u8 = 9;
pub(crate) const NEVER_DEFINED: u8 = 10;

/// A spot in the plane, with the flaw `F`.
///
/// ```toml
/// spot = { type = "spot", x = 1.0, y = 2.0 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub(crate) struct Spot<const F: u8 = SOUND>(pub(crate) Vector2<f64>);

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    x: f64,
    y: f64,
}
impl<const F: u8> From<Document> for Spot<F> {
    fn from(d: Document) -> Self {
        Spot(Vector2::new(d.x, if F == ROUNDED_DOCUMENT { (d.y * 1e3).round() / 1e3 } else { d.y }))
    }
}
impl<const F: u8> From<Spot<F>> for Document {
    fn from(x: Spot<F>) -> Self {
        Document { x: x.0.x, y: x.0.y }
    }
}

impl<const F: u8> Manifold for Spot<F> {
    type Dim = U2;
    type Of<T: Scalar> = Vector2<T>;
    const TANGENT: &'static [&'static str] = if F == UNEVEN_NAMES { &["x", "x"] } else { &["x", "y"] };

    fn lift<T: Scalar>(&self) -> Vector2<T> {
        self.0.map(T::from)
    }
    fn seed(&self) -> Vector2<JetOf<U2>> {
        let one = if F == DOUBLED_SEED { 2.0 } else { 1.0 };
        Vector2::new(Jet::with_gradient(self.0.x, &[1.0, 0.0]), Jet::with_gradient(self.0.y, &[0.0, one]))
    }
    fn retract(&self, delta: &Vector2<f64>) -> Self {
        Spot(match F {
            LONG_STEPS => self.0 + delta * 1.01,
            DRIFTING => self.0 + delta.add_scalar(1e-6),
            INFINITE if delta.norm() > 0.0 => self.0 / 0.0,
            _ => self.0 + delta,
        })
    }
    fn local(&self, other: &Self) -> Vector2<f64> {
        other.0 - self.0
    }
    fn is_finite(&self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}
register_manifold!("spot", Spot);
register_manifold!("spot_with_long_steps", Spot<LONG_STEPS>);
register_manifold!("drifting_spot", Spot<DRIFTING>);
register_manifold!("spot_with_uneven_names", Spot<UNEVEN_NAMES>);
register_manifold!("spot_with_rounded_document", Spot<ROUNDED_DOCUMENT>);
register_manifold!("spot_with_doubled_seed", Spot<DOUBLED_SEED>);
register_manifold!("infinite_spot", Spot<INFINITE>);
register_quantity!(Spot<SOUND> as Vector2<f64>);
register_quantity!(Spot<DOUBLED_SEED> as Vector2<f64>);

/// Twice the area of a triangle with the origin, and the distance of the first spot from an axis. The factor
/// has the flaw `F`, and its spots have the flaw `S`.
///
/// The second row ignores the second variable.
///
/// ```toml
/// factor = { type = "area", area = 2.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Area<const F: u8 = SOUND, const S: u8 = SOUND> {
    pub(crate) area: f64,
}

impl<const F: u8, const S: u8> Residual for Area<F, S> {
    type Variables = (Spot<S>, Spot<S>);
    type Dim = U2;

    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector2<T> {
        Vector2::new(a.x * b.y - a.y * b.x - self.area, a.y)
    }
    fn is_defined(&self, _: Refs<'_, Self::Variables>) -> bool {
        F != NEVER_DEFINED
    }
    fn linearize(
        &self,
        (a, b): Refs<'_, Self::Variables>,
        _: &[bool],
        j: &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let (a, b) = (a.0, b.0);
        j.0 = Matrix2::new(b.y, -b.x, 0.0, 1.0);
        match F {
            UNWRITTEN_BLOCK => {}
            WRONG_SIGN => j.1 = Matrix2::new(-a.y, -a.x, 0.0, 0.0),
            _ => j.1 = Matrix2::new(-a.y, a.x, 0.0, 0.0),
        }
        self.residual((a, b)) * if F == OTHER_RESIDUAL { 1.001 } else { 1.0 }
    }
}
register_factor!("area", Area);
register_factor!("area_of_wrong_sign", Area<WRONG_SIGN>);
register_factor!("area_with_unwritten_block", Area<UNWRITTEN_BLOCK>);
register_factor!("area_with_other_residual", Area<OTHER_RESIDUAL>);
register_factor!("area_that_is_never_defined", Area<NEVER_DEFINED>);
register_factor!("area_of_spots_with_doubled_seed", Area<SOUND, DOUBLED_SEED>);

/// Spread of any number of spots around the origin: Σ ‖xᵢ‖² with the weight i + 1.
///
/// ```toml
/// factor = { type = "spread" }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Spread {}

impl Residual for Spread {
    type Variables = Many<Spot>;
    type Dim = U1;

    fn residual<T: Scalar>(&self, spots: Lifted<Self::Variables, T>) -> Vector1<T> {
        let weighed = spots.iter().enumerate().map(|(i, x)| x.norm_squared() * (i as f64 + 1.0));
        Vector1::new(weighed.fold(T::zero(), |sum, x| sum + x))
    }
}
register_factor!("spread", Spread);

/// A residual that changes its formula beyond x = 2.
///
/// ```toml
/// factor = { type = "step" }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Step {}

impl Residual for Step {
    type Variables = (Spot,);
    type Dim = U2;

    fn residual<T: Scalar>(&self, (spot,): Lifted<Self::Variables, T>) -> Vector2<T> {
        let above = if spot.x.re() > 2.0 { 0.25 } else { 0.0 };
        Vector2::new(spot.x + above, spot.y)
    }
}
register_factor!("step", Step);
