//! Interface of rotations and poses for linear methods, shared by the plane and space.
use crate::groups::LieGroup;
use crate::{Se2, Se3, So2, So3, atan2, nearest_rotation};
use manifactor_graph::Variable;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};

/// A rotation of `D` dimensions, with or without a position.
pub(crate) trait Pose<const D: usize>: LieGroup + Variable + Copy {
    /// Index of the tangent direction that turns about x, y and z, if there is one.
    const ROTATION_DIRECTIONS: [Option<usize>; 3];
    /// First of the translational tangent directions; `None` for rotations.
    const FIRST_TRANSLATION: Option<usize>;
    fn rotation(&self) -> SMatrix<f64, D, D>;
    fn translation(&self) -> SVector<f64, D>;
    /// Creates the pose from an exact rotation.
    fn assemble(rotation: &SMatrix<f64, D, D>, translation: &SVector<f64, D>) -> Self;
    /// Returns the rotation closest to a matrix in the Frobenius norm; `None` if it is not unique.
    fn nearest(m: &SMatrix<f64, D, D>) -> Option<SMatrix<f64, D, D>>;
    /// Returns ω = Log(R), in the plane about z, and V⁻¹(ω), which maps the translation of a pose to the
    /// translation of its logarithm: Log(R, t) = (ω, V⁻¹t).
    fn logarithm(r: &SMatrix<f64, D, D>) -> (Vector3<f64>, SMatrix<f64, D, D>);
}

fn nearest_in_plane(m: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let (c, s) = (m[(0, 0)] + m[(1, 1)], m[(1, 0)] - m[(0, 1)]);
    let length = c.hypot(s);
    (length > 0.0 && length.is_finite()).then(|| Matrix2::new(c, -s, s, c) / length)
}

fn log_in_plane(r: &Matrix2<f64>) -> (Vector3<f64>, Matrix2<f64>) {
    let theta = atan2(r[(1, 0)], r[(0, 0)]);
    let inverse = Se2::inverse_right_jacobian(&Vector3::new(0.0, 0.0, theta));
    (Vector3::new(0.0, 0.0, theta), inverse.fixed_view::<2, 2>(0, 0).transpose())
}

/// Returns the closest rotation, of determinant 1.
fn nearest_in_space(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let found = nearest_rotation(m);
    let is_finite = found.singular_values.iter().all(|value| value.is_finite());
    (is_finite && found.singular_values[0] > 0.0).then(|| found.rotation.matrix())
}

fn log_in_space(r: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let omega = So3::from_matrix(r).log();
    // V is the left Jacobian, the transpose of the right one.
    (omega, So3::inverse_right_jacobian(&omega).transpose())
}

impl Pose<2> for So2 {
    const ROTATION_DIRECTIONS: [Option<usize>; 3] = [None, None, Some(0)];
    const FIRST_TRANSLATION: Option<usize> = None;
    fn rotation(&self) -> Matrix2<f64> {
        self.matrix()
    }
    fn translation(&self) -> SVector<f64, 2> {
        SVector::zeros()
    }
    fn assemble(r: &Matrix2<f64>, _: &SVector<f64, 2>) -> Self {
        So2::exp(atan2(r[(1, 0)], r[(0, 0)]))
    }
    fn nearest(m: &Matrix2<f64>) -> Option<Matrix2<f64>> {
        nearest_in_plane(m)
    }
    fn logarithm(r: &Matrix2<f64>) -> (Vector3<f64>, Matrix2<f64>) {
        log_in_plane(r)
    }
}

impl Pose<2> for Se2 {
    const ROTATION_DIRECTIONS: [Option<usize>; 3] = [None, None, Some(2)];
    const FIRST_TRANSLATION: Option<usize> = Some(0);
    fn rotation(&self) -> Matrix2<f64> {
        self.rotation.matrix()
    }
    fn translation(&self) -> SVector<f64, 2> {
        self.translation
    }
    fn assemble(r: &Matrix2<f64>, t: &SVector<f64, 2>) -> Self {
        Se2::new(So2::exp(atan2(r[(1, 0)], r[(0, 0)])), *t)
    }
    fn nearest(m: &Matrix2<f64>) -> Option<Matrix2<f64>> {
        nearest_in_plane(m)
    }
    fn logarithm(r: &Matrix2<f64>) -> (Vector3<f64>, Matrix2<f64>) {
        log_in_plane(r)
    }
}

impl Pose<3> for So3 {
    const ROTATION_DIRECTIONS: [Option<usize>; 3] = [Some(0), Some(1), Some(2)];
    const FIRST_TRANSLATION: Option<usize> = None;
    fn rotation(&self) -> Matrix3<f64> {
        self.matrix()
    }
    fn translation(&self) -> Vector3<f64> {
        SVector::zeros()
    }
    fn assemble(r: &Matrix3<f64>, _: &Vector3<f64>) -> Self {
        So3::from_matrix(r)
    }
    fn nearest(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        nearest_in_space(m)
    }
    fn logarithm(r: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        log_in_space(r)
    }
}

impl Pose<3> for Se3 {
    const ROTATION_DIRECTIONS: [Option<usize>; 3] = [Some(0), Some(1), Some(2)];
    const FIRST_TRANSLATION: Option<usize> = Some(3);
    fn rotation(&self) -> Matrix3<f64> {
        self.rotation.matrix()
    }
    fn translation(&self) -> Vector3<f64> {
        self.translation
    }
    fn assemble(r: &Matrix3<f64>, t: &Vector3<f64>) -> Self {
        Se3::new(So3::from_matrix(r), *t)
    }
    fn nearest(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        nearest_in_space(m)
    }
    fn logarithm(r: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        log_in_space(r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se2, any_se3};
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_logarithm_of_a_pose_is_linear_in_its_translation(x in any_se3(), y in any_se2()) {
            let (omega, inverse) = <Se3 as Pose<3>>::logarithm(&Pose::rotation(&x));
            let log = Se3::log(&x);
            prop_assert!((omega - log.fixed_rows::<3>(0)).norm() < 1e-7);
            prop_assert!((inverse * x.translation - log.fixed_rows::<3>(3)).norm() < 1e-6);
            let (omega, inverse) = <Se2 as Pose<2>>::logarithm(&Pose::rotation(&y));
            prop_assert!((omega.z - y.log().z).abs() < 1e-12);
            prop_assert!((inverse * y.translation - y.log().xy()).norm() < 1e-9);
        }

        #[test]
        fn no_rotation_is_closer_than_the_nearest(entries in vector::<9>(2.0), other in any_se3()) {
            let m = Matrix3::from_column_slice(entries.as_slice());
            let other = other.rotation.matrix();
            if let Some(r) = nearest_in_space(&m) {
                prop_assert!((r - m).norm() <= (other - m).norm() + 1e-6);
            }
            let flat = m.fixed_view::<2, 2>(0, 0).into_owned();
            if let Some(r) = nearest_in_plane(&flat) {
                let turned = r * So2::exp(0.1).matrix();
                prop_assert!((r - flat).norm() <= (turned - flat).norm());
            }
        }
    }

    #[test]
    fn a_reflection_is_turned_into_a_rotation_and_nothing_has_none() {
        let r = nearest_in_space(&Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, -0.5))).unwrap();
        assert!((r - Matrix3::identity()).norm() < 1e-6);
        assert_eq!(nearest_in_plane(&Matrix2::zeros()), None);
        assert_eq!(nearest_in_plane(&Matrix2::new(1.0, 0.0, 0.0, -1.0)), None);
    }
}
