//! Distance between two variables: r = ‖t₂ - t₁‖ - z.
//!
//! At distance zero the residual has no gradient, so the factor is not defined within a nanometre.
use crate::factors::Located;
use crate::{Point2, Point3, Se2, Se3};
use manifactor_graph::prelude::*;
use std::marker::PhantomData;

/// Distance, in metres, below which the direction between two points is meaningless.
pub(crate) const NEAREST: f64 = 1e-9;

/// A measurement of the distance between two variables, points or poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "")]
#[schemars(bound = "A: Located, B: Located", description = description::<A, B>())]
pub struct Range<A, B> {
    /// Measured distance, in metres.
    pub range: Positive,
    #[serde(skip)]
    between: PhantomData<fn() -> (A, B)>,
}

fn description<A: Located, B: Located>() -> String {
    format!(
        "Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.\n\nOne row, in metres. At distance zero there is \
         no direction to move in: within a nanometre the factor is not defined, and takes no part.\n\n```toml\n\
         [[factors]]\nkeys = [\"x0\", \"{}\"]\nfactor = {{ type = \"range_{}_{}\", range = 1.5 }}\n\
         noise = {{ sigma = 0.1 }}\n```",
        if B::NAME.starts_with("point") { "l0" } else { "x1" },
        A::NAME,
        B::NAME
    )
}

impl<A: Located, B: Located<Space = A::Space>> Range<A, B> {
    /// Creates the factor from a measured distance, in metres.
    pub fn new(range: Positive) -> Self {
        Self { range, between: PhantomData }
    }
    fn squared_distance<T: Scalar>(x: &A::Of<T>, y: &B::Of<T>) -> T {
        let (from, to) = (<A as Located>::position(x), <B as Located>::position(y));
        from.as_ref().iter().zip(to.as_ref()).fold(T::zero(), |sum, (a, b)| sum + (*b - *a) * (*b - *a))
    }
}

impl<A: Located, B: Located<Space = A::Space>> Residual for Range<A, B> {
    type Variables = (A, B);
    type Dim = U1;
    const ROWS: &'static [&'static str] = &["range"];

    fn residual<T: Scalar>(&self, (x, y): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(Self::squared_distance(&x, &y).sqrt() - self.range.get())
    }
    fn is_defined(&self, variables: Refs<'_, Self::Variables>) -> bool {
        let (x, y) = Self::Variables::lift::<f64>(&variables);
        Self::squared_distance(&x, &y) >= NEAREST * NEAREST
    }
}

register_factor!("range_se2_point2", Range<Se2, Point2>);
register_factor!("range_se2_se2", Range<Se2, Se2>);
register_factor!("range_se3_point3", Range<Se3, Point3>);
register_factor!("range_se3_se3", Range<Se3, Se3>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_point2, any_point3, any_se2, any_se3};
    use manifactor_graph::{Factor, Variable};
    use manifactor_testing::strategies::direction;
    use manifactor_testing::{JacobianLaw, LawError, check, invariance_law};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn any_range<A: Located, B: Located<Space = A::Space>>() -> impl Strategy<Value = Range<A, B>> {
        (0.01..10.0).prop_map(|range| Range::new(Positive::literal(range)))
    }
    /// Checks the law with steps shorter than the distance. Very short distances have a separate test.
    fn agrees<A, B>((factor, x, y): (Range<A, B>, A, B)) -> Result<(), LawError>
    where
        A: Located + Variable,
        B: Located<Space = A::Space> + Variable,
        Range<A, B>: Factor,
    {
        let distance = Range::<A, B>::squared_distance::<f64>(&x.lift(), &y.lift()).sqrt();
        let law = JacobianLaw { step: 1e-2 * distance.min(1.0), ..JacobianLaw::default() };
        if distance < 1e-3 { Ok(()) } else { law.check(&factor, &[&x, &y]) }
    }

    #[test]
    fn jacobians_agree_between_all_kinds_of_variables() {
        check((any_range(), any_se2(), any_point2()), agrees);
        check((any_range(), any_se2(), any_se2()), agrees);
        check((any_range(), any_se3(), any_point3()), agrees);
        check((any_range(), any_se3(), any_se3()), agrees);
    }

    #[test]
    fn jacobians_agree_next_to_distance_zero() {
        let distance = prop_oneof![Just(2e-9), Just(1e-6), 1e-5..1e-3];
        check((direction(), distance), |(direction, distance)| {
            let factor = Range::<Se3, Point3>::new(Positive::literal(distance * 1.5));
            let point = Point3::new(direction.into_inner() * distance);
            let law = JacobianLaw { step: distance * 0.1, ..JacobianLaw::default() };
            law.check(&factor, &[&Se3::identity(), &point])
        });
    }

    #[test]
    fn moving_and_turning_both_poses_changes_nothing() {
        check((any_range::<Se3, Se3>(), any_se3(), any_se3(), any_se3()), |(factor, x, y, m)| {
            invariance_law(&factor, &[&x, &y], &[&m.compose(&x), &m.compose(&y)])
        });
    }

    #[test]
    fn distance_zero_is_not_defined() {
        let factor = Range::<Se3, Point3>::new(Positive::literal(1.0));
        assert!(!factor.is_defined((&Se3::identity(), &Point3::new([0.0; 3]))));
        assert!(factor.is_defined((&Se3::identity(), &Point3::new([0.0, 2e-9, 0.0]))));
    }

    #[test]
    fn three_and_four_make_five() {
        let factor = Range::<Se3, Point3>::new(Positive::literal(1.0));
        assert_eq!(factor.residual::<f64>((Se3::identity(), Vector3::new(3.0, 4.0, 0.0))).x, 4.0);
    }
}
