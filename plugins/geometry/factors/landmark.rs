//! Position of a point in the frame of a pose: r = Rᵀ(p - t) - z.
use crate::groups::quarter_turn;
use crate::{Coordinates, Point2, Point3, Se2, Se3};
use manifactor_graph::prelude::*;

/// A pose measures the position of a point in its frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(description = description(N))]
pub struct Landmark<const N: usize> {
    /// Measured position of the point in the frame of the pose, in metres.
    pub position: Coordinates<N>,
}

fn description(n: usize) -> String {
    let position = ["1.0", "0.5", "0.0"].get(..n).unwrap_or_default().join(", ");
    format!(
        "The point is at `position`, seen from the pose: r = Rᵀ(p - t) - z.\n\nOne row for each coordinate, in \
         metres, along the axes of the pose.\n\n```toml\n[[factors]]\nkeys = [\"x0\", \"l0\"]\n\
         factor = {{ type = \"landmark_se{n}\", position = [{position}] }}\nnoise = {{ sigma = 0.1 }}\n```"
    )
}

impl Residual for Landmark<2> {
    type Variables = (Se2, Point2);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["x", "y"];

    fn residual<T: Scalar>(&self, (x, p): Lifted<Self::Variables, T>) -> Vector2<T> {
        x.inverse_act(&p) - self.position.lift::<T>()
    }
    fn linearize(
        &self,
        (x, p): Refs<'_, Self::Variables>,
        _: &[bool],
        j: &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let seen = x.inverse_act(p);
        j.0.fixed_columns_mut::<2>(0).copy_from(&-Matrix2::identity());
        j.0.set_column(2, &-quarter_turn(&seen));
        j.1 = x.rotation.matrix().transpose();
        seen - *self.position
    }
}
register_factor!("landmark_se2", Landmark<2>);

impl Residual for Landmark<3> {
    type Variables = (Se3, Point3);
    type Dim = U3;
    const ROWS: &'static [&'static str] = &["x", "y", "z"];

    fn residual<T: Scalar>(&self, (x, p): Lifted<Self::Variables, T>) -> Vector3<T> {
        x.inverse_act(&p) - self.position.lift::<T>()
    }
    fn linearize(
        &self,
        (x, p): Refs<'_, Self::Variables>,
        _: &[bool],
        j: &mut Jacobians<Self>,
    ) -> Vector3<f64> {
        let seen = x.inverse_act(p);
        j.0.fixed_columns_mut::<3>(0).copy_from(&seen.cross_matrix());
        j.0.fixed_columns_mut::<3>(3).copy_from(&-Matrix3::identity());
        j.1 = x.rotation.matrix().transpose();
        seen - *self.position
    }
}
register_factor!("landmark_se3", Landmark<3>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_point2, any_point3, any_se2, any_se3};
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    fn any_landmark<const N: usize>() -> impl Strategy<Value = Landmark<N>> {
        vector(10.0).prop_map(|position| Landmark { position: Coordinates::new(position).unwrap() })
    }

    jacobian_laws! {
        jacobians_agree_in_the_plane: (any_landmark::<2>(), any_se2(), any_point2());
        jacobians_agree_in_space: (any_landmark::<3>(), any_se3(), any_point3());
    }

    #[test]
    fn moving_pose_and_point_together_changes_nothing() {
        check((any_landmark::<3>(), any_se3(), any_point3(), any_se3()), |(factor, x, p, m)| {
            invariance_law(&factor, &[&x, &p], &[&m.compose(&x), &Point3::new(m.act(&p))])
        });
        check((any_landmark::<2>(), any_se2(), any_point2(), any_se2()), |(factor, x, p, m)| {
            invariance_law(&factor, &[&x, &p], &[&m.compose(&x), &Point2::new(m.act(&p))])
        });
    }

    #[test]
    fn what_is_ahead_of_a_pose_that_looks_along_y_is_on_its_x_axis() {
        let pose = Se2::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let factor = Landmark::<2> { position: Coordinates::default() };
        let r = factor.residual::<f64>((pose, Vector2::new(0.0, 2.0)));
        assert!((r - Vector2::new(2.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn a_document_reads_back() {
        let factor = Landmark { position: Coordinates::new(Vector3::new(0.1, 0.2, 0.3)).unwrap() };
        let text = serde_json::to_string(&factor).unwrap();
        assert_eq!(serde_json::from_str::<Landmark<3>>(&text).unwrap(), factor);
        assert!(serde_json::from_str::<Landmark<2>>(&text).is_err());
    }
}
