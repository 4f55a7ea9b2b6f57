//! SO(2): rotations in the plane, stored as an angle.
use crate::groups::LieGroup;
use manifactor_graph::prelude::*;
use manifactor_graph::quantity::Shape;
use nalgebra::Matrix1;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A rotation in the plane: tangent (theta), in radians, counter-clockwise.
///
/// The angle is in -π..π. The logarithm is this angle and jumps from one end to the other.
///
/// ```toml
/// [values]
/// r0 = { type = "so2", angle = 0.5 }
/// ```
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct So2<T: Scalar = f64> {
    angle: T,
    // Cached, so that rotating a vector needs no trigonometric function.
    cos: T,
    sin: T,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Angle in radians, counter-clockwise.
    angle: Angle,
}

/// An angle in radians, checked to be finite and wrapped when read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "f64", into = "f64")]
#[schemars(with = "f64")]
pub(crate) struct Angle(pub(crate) So2);

/// An angle that is infinite or not a number.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected a finite angle in radians, got {0}")]
pub struct AngleError(pub f64);

/// Number of turns above which subtracting turns · 2π loses digits of the angle.
const MANY_TURNS: f64 = 1000.0;

/// Returns the angle wrapped to -π..π. An angle already in this range is returned unchanged, bit for bit.
pub fn wrap<T: Scalar>(angle: T) -> T {
    let turns = (angle.re() / TAU).round();
    // An angle of exactly ±π could be rounded to either side, so angles within range are returned unchanged.
    if angle.re().abs() <= PI {
        return angle;
    }
    if turns.abs() <= MANY_TURNS {
        let wrapped = angle - T::from(turns * TAU);
        let is_out = wrapped.re().abs() > PI;
        return if is_out { wrapped - T::from(TAU.copysign(wrapped.re())) } else { wrapped };
    }
    // Sine and cosine reduce their argument exactly.
    let (sin, cos) = angle.re().sin_cos();
    angle - T::from(angle.re()) + T::from(sin.atan2(cos))
}

/// Returns the angle of the vector (x, y) within -π..π. The derivative exists at x = 0 too, at which
/// num-dual's `atan2` divides by zero.
pub fn atan2<T: Scalar>(y: T, x: T) -> T {
    let (re_y, re_x) = (y.re(), x.re());
    if re_x.abs() >= re_y.abs() {
        let turn = if re_x < 0.0 { PI.copysign(re_y) } else { 0.0 };
        (y / x).atan() + turn
    } else {
        -(x / y).atan() + FRAC_PI_2.copysign(re_y)
    }
}

impl<T: Scalar> So2<T> {
    /// Creates the rotation by an angle in radians.
    pub fn exp(angle: T) -> Self {
        // Cosine and sine come from the wrapped angle, which is the one written, so reading it back gives
        // identical bits.
        let angle = wrap(angle);
        let (sin, cos) = angle.sin_cos();
        Self { angle, cos, sin }
    }
    /// Returns the identity rotation.
    pub fn identity() -> Self {
        Self { angle: T::zero(), cos: T::one(), sin: T::zero() }
    }
    /// Returns the angle in radians, within -π..π.
    pub fn angle(&self) -> T {
        self.angle
    }
    /// Returns cosine and sine of the angle.
    pub fn cos_sin(&self) -> (T, T) {
        (self.cos, self.sin)
    }
    /// Returns the angle as a tangent vector.
    pub fn log(&self) -> Vector1<T> {
        Vector1::new(self.angle)
    }
    /// Returns self · other.
    pub fn compose(&self, other: &Self) -> Self {
        Self {
            angle: wrap(self.angle + other.angle),
            cos: self.cos * other.cos - self.sin * other.sin,
            sin: self.sin * other.cos + self.cos * other.sin,
        }
    }
    /// Returns self⁻¹.
    pub fn inverse(&self) -> Self {
        Self { angle: -self.angle, cos: self.cos, sin: -self.sin }
    }
    /// Returns self⁻¹ · other.
    pub fn between(&self, other: &Self) -> Self {
        self.inverse().compose(other)
    }
    /// Returns R v.
    pub fn act(&self, v: &Vector2<T>) -> Vector2<T> {
        self.matrix() * v
    }
    /// Returns the rotation matrix R.
    pub fn matrix(&self) -> Matrix2<T> {
        Matrix2::new(self.cos, -self.sin, self.sin, self.cos)
    }
}

/// Compares angles only: cosine and sine follow from them.
impl<T: Scalar> PartialEq for So2<T> {
    fn eq(&self, other: &Self) -> bool {
        self.angle == other.angle
    }
}

/// Storage order: angle, cosine and sine.
impl Quantity for So2 {
    const SHAPE: Shape = Shape { name: "so2", size: 3 };
    type Of<T: Scalar> = So2<T>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> So2<T> {
        So2 { angle: from[0], cos: from[1], sin: from[2] }
    }
    #[inline]
    fn write<T: Scalar>(x: &So2<T>, to: &mut [T]) {
        to.copy_from_slice(&[x.angle, x.cos, x.sin]);
    }
}

impl Manifold for So2 {
    type Dim = U1;
    type Of<T: Scalar> = So2<T>;
    const TANGENT: &'static [&'static str] = &["theta"];

    fn lift<T: Scalar>(&self) -> So2<T> {
        So2 { angle: self.angle.lift(), cos: self.cos.lift(), sin: self.sin.lift() }
    }
    fn seed(&self) -> So2<JetOf<U1>> {
        let jet = <JetOf<U1> as Jet>::with_gradient;
        So2 {
            angle: jet(self.angle, &[1.0]),
            cos: jet(self.cos, &[-self.sin]),
            sin: jet(self.sin, &[self.cos]),
        }
    }
    fn retract(&self, delta: &Vector1<f64>) -> Self {
        Self::exp(self.angle + delta.x)
    }
    fn local(&self, other: &Self) -> Vector1<f64> {
        self.between(other).log()
    }
    fn is_finite(&self) -> bool {
        self.angle.is_finite()
    }
}
register_manifold!("so2", So2);

impl LieGroup for So2 {
    const NAME: &'static str = "so2";
    const EXAMPLE: &'static str = "{ angle = 0.5 }";
    fn identity() -> So2 {
        So2::identity()
    }
    fn compose(x: &So2, y: &So2) -> So2 {
        x.compose(y)
    }
    fn inverse(x: &So2) -> So2 {
        x.inverse()
    }
    fn between<T: Scalar>(x: &So2<T>, y: &So2<T>) -> So2<T> {
        x.between(y)
    }
    fn log<T: Scalar>(x: &So2<T>) -> Vector1<T> {
        x.log()
    }
    fn inverse_right_jacobian(_: &Vector1<f64>) -> Matrix1<f64> {
        Matrix1::identity()
    }
    fn adjoint_of_inverse(_: &So2) -> Matrix1<f64> {
        Matrix1::identity()
    }
}

impl TryFrom<f64> for Angle {
    type Error = AngleError;
    fn try_from(angle: f64) -> Result<Self, AngleError> {
        if angle.is_finite() { Ok(Self(So2::exp(angle))) } else { Err(AngleError(angle)) }
    }
}
impl From<Angle> for f64 {
    fn from(angle: Angle) -> f64 {
        angle.0.angle
    }
}
impl From<Document> for So2 {
    fn from(document: Document) -> Self {
        document.angle.0
    }
}
impl From<So2> for Document {
    fn from(x: So2) -> Self {
        Self { angle: Angle(x) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_so2, so2_tangent};
    use manifactor_testing::manifold_laws;
    use proptest::prelude::*;

    manifold_laws! { retract_and_local_are_inverse: (any_so2(), any_so2(), so2_tangent()) }

    proptest! {
        #[test]
        fn wrapping_leaves_the_rotation(angle in -1e3..1e3) {
            let wrapped: f64 = wrap(angle);
            prop_assert!(wrapped.abs() <= PI);
            prop_assert!((wrapped.sin() - angle.sin()).abs() < 1e-12);
            prop_assert!((wrapped.cos() - angle.cos()).abs() < 1e-12);
        }

        #[test]
        fn a_rotation_by_any_angle_is_read_back_with_the_same_bits(angle in prop_oneof![-20.0..20.0f64, any::<f64>()]) {
            prop_assume!(angle.is_finite());
            let rotation: So2 = So2::exp(angle);
            let read: So2 = serde_json::from_str(&serde_json::to_string(&rotation).unwrap()).unwrap();
            let bits = |x: &So2| [x.angle, x.cos, x.sin].map(f64::to_bits);
            prop_assert_eq!(bits(&read), bits(&rotation));
            prop_assert!(rotation.angle.abs() <= PI && (rotation.sin - angle.sin()).abs() < 1e-9);
        }
    }

    #[test]
    fn atan2_is_the_one_of_f64_and_differentiable_on_the_axes() {
        for (y, x) in
            [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (3.0, -4.0), (-5.0, -2.0), (-0.0, -1.0)]
        {
            assert!((atan2::<f64>(y, x) - y.atan2(x)).abs() < 1e-15, "{y} {x}");
            let jet = |value, k| {
                JetOf::<nalgebra::U2>::with_gradient(value, if k == 0 { &[1.0, 0.0] } else { &[0.0, 1.0] })
            };
            let angle = atan2(jet(y, 0), jet(x, 1));
            let n2 = x * x + y * y;
            let expected = [x / n2, -y / n2];
            let found = angle.gradient().unwrap();
            assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-15), "{found:?} {expected:?}");
        }
    }

    #[test]
    fn angles_in_range_stay_as_they_are() {
        for angle in [PI, -PI, 3.0, 1e-300, 0.1] {
            assert_eq!(wrap(angle), angle);
        }
    }

    #[test]
    fn the_way_across_the_half_turn_is_the_short_one() {
        let way = So2::exp(3.0).local(&So2::exp(-3.0)).x;
        assert!((way - (TAU - 6.0)).abs() < 1e-12, "{way}");
    }

    #[test]
    fn an_angle_that_is_none_is_refused() {
        assert!(matches!(Angle::try_from(f64::NAN), Err(AngleError(_))));
        assert!(serde_json::from_str::<So2>(r#"{ "angle": "north" }"#).is_err());
        assert_eq!(serde_json::from_str::<So2>(r#"{ "angle": 7.0 }"#).unwrap(), So2::exp(7.0));
    }
}
