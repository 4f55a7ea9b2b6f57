//! A relative pose with the chordal distance between rotations: ‖R_b - R_a Z‖ instead of |Log(Zᵀ R_aᵀ R_b)|.
use crate::groups::LieGroup;
use crate::{Se2, Se3};
use manifactor_graph::prelude::*;
use nalgebra::SVector;
use std::f64::consts::FRAC_1_SQRT_2;

/// A measurement of the second pose in the frame of the first, with the chordal distance between rotations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(bound = "G: LieGroup + JsonSchema", description = description::<G>())]
pub struct ChordalBetween<G> {
    /// The second pose in the frame of the first.
    pub relative: G,
}

fn description<G: LieGroup>() -> String {
    format!(
        "The second pose is at `relative` in the frame of the first, with the chordal distance of rotations: \
         r = ((R_b - R_a Z)/√2, R_aᵀ(t_b - t_a) - z).\n\nRows: the entries of the rotation's difference, by \
         columns, then the translation's in metres. The norm of the first entries is 2 sin(θ/2) for an angle θ: \
         close to the angle if it is small, and smooth everywhere. The certificate of global optimality refers \
         to this factor.\n\n```toml\n[[factors]]\n\
         keys = [\"x0\", \"x1\"]\nfactor = {{ type = \"chordal_between_{}\", relative = {} }}\n\
         noise = {{ sigma = 0.1 }}\n```",
        G::NAME,
        G::EXAMPLE
    )
}

impl Residual for ChordalBetween<Se2> {
    type Variables = (Se2, Se2);
    type Dim = U6;

    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector<U6, T> {
        let predicted = a.compose(&self.relative.lift());
        let turn = (b.rotation.matrix() - predicted.rotation.matrix()) * T::from(FRAC_1_SQRT_2);
        let shift = a.rotation.inverse().act(&(b.translation - predicted.translation));
        SVector::from_iterator(turn.iter().chain(shift.iter()).copied())
    }
}
register_factor!("chordal_between_se2", ChordalBetween<Se2>);

impl Residual for ChordalBetween<Se3> {
    type Variables = (Se3, Se3);
    type Dim = nalgebra::U12;

    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector<nalgebra::U12, T> {
        let predicted = a.compose(&self.relative.lift());
        let turn = (b.rotation.matrix() - predicted.rotation.matrix()) * T::from(FRAC_1_SQRT_2);
        let shift = a.rotation.inverse().act(&(b.translation - predicted.translation));
        SVector::from_iterator(turn.iter().chain(shift.iter()).copied())
    }
}
register_factor!("chordal_between_se3", ChordalBetween<Se3>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se2, any_se3, se3_tangent};
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    jacobian_laws! {
        jacobians_agree_on_se2: (any_se2(), any_se2(), any_se2())
            .prop_map(|(relative, a, b)| (ChordalBetween { relative }, a, b));
        jacobians_agree_on_se3: (any_se3(), any_se3(), any_se3())
            .prop_map(|(relative, a, b)| (ChordalBetween { relative }, a, b));
    }

    #[test]
    fn moving_both_poses_changes_no_distance() {
        check((any_se3(), any_se3(), any_se3(), any_se3()), |(relative, x, y, m)| {
            let factor = ChordalBetween { relative };
            let length = |x: Se3, y: Se3| {
                let r = factor.residual::<f64>((x, y));
                nalgebra::Vector2::new(r.fixed_rows::<9>(0).norm(), r.fixed_rows::<3>(9).norm())
            };
            let moved = length(m.compose(&x), m.compose(&y)) - length(x, y);
            if moved.norm() < 1e-9 { Ok(()) } else { invariance_law(&factor, &[&x, &y], &[&x, &m]) }
        });
    }

    proptest! {
        #[test]
        fn its_rotation_is_as_long_as_the_chord_of_the_angle(x in any_se3(), xi in se3_tangent()) {
            let angle = xi.fixed_rows::<3>(0).norm();
            let r = ChordalBetween { relative: Se3::identity() }.residual::<f64>((x, x.compose(&Se3::exp(&xi))));
            prop_assert!((r.fixed_rows::<9>(0).norm() - 2.0 * (0.5 * angle).sin().abs()).abs() < 1e-9);
        }
    }
}
