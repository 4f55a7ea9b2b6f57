//! Position of a pose, as GPS or a total station measures it: r = R l + t - z, in the map or in a frame of its own.
use crate::groups::quarter_turn;
use crate::{Coordinates, Se2, Se3, So3};
use manifactor_graph::prelude::*;

/// A measurement of the position of an antenna on the pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(description = description(N))]
pub struct Position<const N: usize> {
    /// Measured position of the antenna in the outer frame, in metres.
    pub position: Coordinates<N>,
    /// Position of the antenna in the frame of the pose, in metres. Default: the origin of that frame.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub lever_arm: Coordinates<N>,
}

fn is_zero<const N: usize>(x: &Coordinates<N>) -> bool {
    *x == Coordinates::default()
}

fn description(n: usize) -> String {
    let position = ["1.0", "0.5", "0.0"].get(..n).unwrap_or_default().join(", ");
    format!(
        "The pose, or an antenna on it, is at `position`: r = R l + t - z.\n\nOne row for each coordinate, in \
         metres, along the axes of the outer frame. Without a lever arm l it says nothing of the rotation.\n\n\
         ```toml\n[[factors]]\nkeys = [\"x0\"]\nfactor = {{ type = \"position_se{n}\", position = [{position}] }}\n\
         noise = {{ sigma = 2.0 }}\n```"
    )
}

impl Residual for Position<2> {
    type Variables = (Se2,);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["x", "y"];

    fn residual<T: Scalar>(&self, (x,): Lifted<Self::Variables, T>) -> Vector2<T> {
        x.act(&self.lever_arm.lift()) - self.position.lift::<T>()
    }
    fn linearize(
        &self,
        (x,): Refs<'_, Self::Variables>,
        _: &[bool],
        j: &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let r = x.rotation.matrix();
        j.0.fixed_columns_mut::<2>(0).copy_from(&r);
        j.0.set_column(2, &(r * quarter_turn(&self.lever_arm)));
        self.residual((*x,))
    }
}
register_factor!("position_se2", Position<2>);

impl Residual for Position<3> {
    type Variables = (Se3,);
    type Dim = U3;
    const ROWS: &'static [&'static str] = &["x", "y", "z"];

    fn residual<T: Scalar>(&self, (x,): Lifted<Self::Variables, T>) -> Vector3<T> {
        x.act(&self.lever_arm.lift()) - self.position.lift::<T>()
    }
    fn linearize(
        &self,
        (x,): Refs<'_, Self::Variables>,
        _: &[bool],
        j: &mut Jacobians<Self>,
    ) -> Vector3<f64> {
        let r = x.rotation.matrix();
        j.0.fixed_columns_mut::<3>(0).copy_from(&(-r * self.lever_arm.cross_matrix()));
        j.0.fixed_columns_mut::<3>(3).copy_from(&r);
        self.residual((*x,))
    }
}
register_factor!("position_se3", Position<3>);

/// An antenna on the pose is at `position` in an external frame: r = E (R l + t) - z.
///
/// E is the first variable, the pose of the map in the external frame, such as east, north and up of a satellite
/// receiver, or the frame of a total station. The second variable is the pose, in the map. Three rows in metres, along the axes of
/// the external frame. Three positions that are not on a line determine E; otherwise it needs a prior. Invariant to a new
/// frame of the map. Source: as the GPS factors of GTSAM, with the frame as a variable.
///
/// ```toml
/// [[factors]]
/// keys = ["enu_from_map", "x0"]
/// factor = { type = "external_position_se3", position = [1.0, 0.5, 0.0], lever_arm = [0.0, 0.0, 1.2] }
/// noise = { sigma = 2.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExternalPosition {
    /// Measured position of the antenna in the external frame, in metres.
    pub position: Coordinates<3>,
    /// Position of the antenna in the frame of the pose, in metres. Default: the origin of that frame.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub lever_arm: Coordinates<3>,
}

impl Residual for ExternalPosition {
    type Variables = (Se3, Se3);
    type Dim = U3;
    const ROWS: &'static [&'static str] = &["x", "y", "z"];

    fn residual<T: Scalar>(&self, (external, x): Lifted<Self::Variables, T>) -> Vector3<T> {
        external.act(&x.act(&self.lever_arm.lift())) - self.position.lift::<T>()
    }
    fn linearize(
        &self,
        (external, x): Refs<'_, Self::Variables>,
        _: &[bool],
        j: &mut Jacobians<Self>,
    ) -> Vector3<f64> {
        let (outer, inner) = (external.rotation.matrix(), x.rotation.matrix());
        let antenna = x.act(&self.lever_arm);
        j.0.fixed_columns_mut::<3>(0).copy_from(&(-outer * antenna.cross_matrix()));
        j.0.fixed_columns_mut::<3>(3).copy_from(&outer);
        let both = outer * inner;
        j.1.fixed_columns_mut::<3>(0).copy_from(&(-both * self.lever_arm.cross_matrix()));
        j.1.fixed_columns_mut::<3>(3).copy_from(&both);
        external.act(&antenna) - *self.position
    }
}
register_factor!("external_position_se3", ExternalPosition);
register_invariance!(ExternalPosition, "a new frame of the map", |_, (external, x), random| {
    let [a, b] = [(); 2].map(|()| Vector3::new(random(3.0), random(3.0), random(3.0)));
    let new_from_map = Se3::new(So3::exp(&a), b);
    (external.compose(&new_from_map.inverse()), new_from_map.compose(x))
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se2, any_se3, any_so3};
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    fn any_position<const N: usize>() -> impl Strategy<Value = Position<N>> {
        (vector(10.0), vector(1.0)).prop_map(|(position, arm)| position_at(position, arm))
    }
    fn position_at<const N: usize>(
        position: nalgebra::SVector<f64, N>,
        arm: nalgebra::SVector<f64, N>,
    ) -> Position<N> {
        Position { position: Coordinates::new(position).unwrap(), lever_arm: Coordinates::new(arm).unwrap() }
    }

    jacobian_laws! {
        jacobians_agree_in_the_plane: (any_position::<2>(), any_se2());
        jacobians_agree_in_space: (any_position::<3>(), any_se3());
        jacobians_agree_in_an_external_frame: (any_external(), any_se3(), any_se3());
    }

    fn any_external() -> impl Strategy<Value = ExternalPosition> {
        any_position::<3>()
            .prop_map(|Position { position, lever_arm }| ExternalPosition { position, lever_arm })
    }

    proptest! {
        #[test]
        fn in_the_frame_of_the_map_an_external_position_is_a_position(external in any_external(), x in any_se3()) {
            let ExternalPosition { position, lever_arm } = external.clone();
            let plain = Position { position, lever_arm };
            let (a, b) =
                (external.residual::<f64>((Se3::identity(), x)), plain.residual::<f64>((x,)));
            prop_assert!((a - b).norm() < 1e-12);
        }
    }

    #[test]
    fn without_an_arm_the_rotation_is_free() {
        check((any_position::<3>(), any_se3(), any_so3()), |(mut factor, x, turn)| {
            factor.lever_arm = Coordinates::default();
            invariance_law(&factor, &[&x], &[&Se3::new(turn, x.translation)])
        });
    }

    #[test]
    fn an_arm_turns_with_the_pose() {
        let quarter_turn = So3::exp(&(Vector3::z() * std::f64::consts::FRAC_PI_2));
        let pose = Se3::new(quarter_turn, Vector3::new(1.0, 0.0, 0.0));
        let r = position_at(Vector3::zeros(), Vector3::x()).residual::<f64>((pose,));
        assert!((r - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn a_document_need_not_mention_the_arm() {
        let bare: Position<2> = serde_json::from_str(r#"{ "position": [0.1, 0.2] }"#).unwrap();
        assert_eq!(*bare.lever_arm, Vector2::zeros());
        assert!(serde_json::from_str::<Position<2>>(r#"{ "position": [0.1] }"#).is_err());
    }
}
