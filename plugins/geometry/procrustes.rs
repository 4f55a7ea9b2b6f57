//! Orthogonal Procrustes problems: the rotation closest to a matrix, and the similarity closest to pairs of
//! points.
use crate::{Sim3, So3};
use nalgebra::{Matrix3, Vector3};

/// The rotation R that maximizes tr(Rᵀ M), and the singular values of M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestRotation {
    /// R. If `singular_values[1]` is zero, R is arbitrary about the first direction; if all are zero, R is
    /// arbitrary.
    pub rotation: So3,
    /// In descending order; the last one is negative if M has a negative determinant. Their sum is tr(Rᵀ M).
    pub singular_values: [f64; 3],
}

/// Maximum number of sweeps over the three pairs of columns; four or five are typical.
const MAX_SWEEPS: usize = 30;

/// Finds the rotation closest to a matrix (Kabsch, 1976; Umeyama, 1991, equation 40).
///
/// One-sided Jacobi rotations compute small singular values to full relative accuracy (Demmel and Veselić,
/// 1992). A decomposition by bidiagonalization resolves them only to the rounding error of the largest one. A
/// nearly straight trajectory would then be rotated about its direction by a wrong angle.
pub fn nearest_rotation(matrix: &Matrix3<f64>) -> NearestRotation {
    let (mut a, mut v) = (*matrix, Matrix3::identity());
    for _ in 0..MAX_SWEEPS {
        let mut is_done = true;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (alpha, beta) = (a.column(i).norm_squared(), a.column(j).norm_squared());
            let gamma = a.column(i).dot(&a.column(j));
            if gamma.abs() <= f64::EPSILON * (alpha * beta).sqrt() {
                continue;
            }
            is_done = false;
            let zeta = (beta - alpha) / (2.0 * gamma);
            let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            let sine = cosine * tangent;
            for columns in [&mut a, &mut v] {
                let (x, y) = (columns.column(i).clone_owned(), columns.column(j).clone_owned());
                columns.set_column(i, &(x * cosine - y * sine));
                columns.set_column(j, &(x * sine + y * cosine));
            }
        }
        if is_done {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|i, j| a.column(*j).norm().total_cmp(&a.column(*i).norm()));
    let [first, second, third] = order.map(|i| a.column(i).clone_owned());
    let [v0, v1, v2] = order.map(|i| v.column(i).clone_owned());
    let u0 = first.try_normalize(0.0).unwrap_or(v0);
    let u1 = (second - u0 * u0.dot(&second)).try_normalize(0.0).unwrap_or_else(|| across(&u0, &v1));
    let (u2, w2) = (u0.cross(&u1), v0.cross(&v1));
    let rotation = u0 * v0.transpose() + u1 * v1.transpose() + u2 * w2.transpose();
    let last = third.norm().copysign(third.dot(&u2) * v2.dot(&w2));
    NearestRotation {
        rotation: So3::from_matrix(&rotation),
        singular_values: [first.norm(), second.norm(), last],
    }
}

/// Returns a unit vector perpendicular to `direction`, close to `wanted` unless the two are parallel.
fn across(direction: &Vector3<f64>, wanted: &Vector3<f64>) -> Vector3<f64> {
    let candidates = [*wanted, Vector3::x(), Vector3::y()].map(|c| c - direction * direction.dot(&c));
    candidates.into_iter().find_map(|c| c.try_normalize(0.1)).unwrap_or_else(Vector3::z)
}

/// Sums over pairs of points (x, y), from which the similarity is computed that minimizes the mean squared
/// distance (Umeyama, Least-Squares Estimation of Transformation Parameters Between Two Point Patterns,
/// 1991).
#[derive(Debug, Clone, Copy)]
pub struct PointPairs {
    means: [Vector3<f64>; 2],
    /// Σ w (y - ȳ)(x - x̄)ᵀ
    products: Matrix3<f64>,
    /// Σ w ‖x - x̄‖²
    spread: f64,
}

impl PointPairs {
    /// Computes the sums over points x, y and their weights. Without a pair, no similarity is determined.
    pub fn new(pairs: impl Iterator<Item = (Vector3<f64>, Vector3<f64>, f64)> + Clone) -> Self {
        let zero = Vector3::zeros();
        let add = |(x, y, w): (_, _, f64), (a, b, v): (Vector3<f64>, Vector3<f64>, f64)| {
            (x + a * v, y + b * v, w + v)
        };
        let (x_sum, y_sum, weight) = pairs.clone().fold((zero, zero, 0.0), add);
        let means = [x_sum / weight, y_sum / weight];
        let mut all = Self { means, products: Matrix3::zeros(), spread: 0.0 };
        for (x, y, weight) in pairs {
            let (x, y) = (x - means[0], y - means[1]);
            all.products += y * x.transpose() * weight;
            all.spread += x.norm_squared() * weight;
        }
        all
    }

    /// Adds a direction that is x in the first frame and y in the second, with a share of the weight of all
    /// points.
    pub fn add_direction(&mut self, x: &Vector3<f64>, y: &Vector3<f64>, share: f64) {
        self.products += y * x.transpose() * (share * self.spread);
    }

    /// Returns the closest rotation and translation. `None` if the ratio of the second to the first singular
    /// value is at most `flat`: the points are on a line, and the rotation about it is arbitrary.
    pub fn rigid(&self, flat: f64) -> Option<Sim3> {
        self.closest(flat, |_| 1.0)
    }

    /// Returns the closest rotation, translation and scale, with the condition of [`rigid`](Self::rigid).
    pub fn similarity(&self, flat: f64) -> Option<Sim3> {
        self.closest(flat, |singular_values| singular_values.iter().sum::<f64>() / self.spread)
    }

    fn closest(&self, flat: f64, scale: impl Fn([f64; 3]) -> f64) -> Option<Sim3> {
        let NearestRotation { rotation, singular_values } = nearest_rotation(&self.products);
        // A comparison that is false for NaN, which occurs without pairs.
        let is_determined = singular_values[1] > flat * singular_values[0];
        if !is_determined {
            return None;
        }
        let scale = scale(singular_values);
        let translation = self.means[1] - rotation.act(&self.means[0]) * scale;
        Some(Sim3 { scale, rotation, translation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_so3;
    use manifactor_graph::Manifold;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    fn trace(rotation: &So3, matrix: &Matrix3<f64>) -> f64 {
        (rotation.matrix().transpose() * matrix).trace()
    }

    proptest! {
        #[test]
        fn no_rotation_nearby_is_closer(u in any_so3(), v in any_so3(), turn in vector::<3>(1.0), k in 0..12_i32, flip in any::<bool>()) {
            let least = 10.0_f64.powi(-k) * if flip { -1.0 } else { 1.0 };
            let matrix = u.matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, least.abs().sqrt(), least)) * v.matrix();
            let found = nearest_rotation(&matrix);
            let best = trace(&found.rotation, &matrix);
            prop_assert!((best - found.singular_values.iter().sum::<f64>()).abs() < 1e-12);
            let other = found.rotation.compose(&So3::exp(&(turn * 1e-3)));
            prop_assert!(trace(&other, &matrix) <= best + 1e-15);
        }

        #[test]
        fn small_singular_values_are_accurate(u in any_so3(), k in 2..14_i32) {
            let least = 10.0_f64.powi(-k);
            // Columns of very different lengths: each entry is exact to rounding, and so is each singular
            // value.
            let matrix = u.matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, least, least * least));
            let found = nearest_rotation(&matrix);
            prop_assert!((found.singular_values[1] / least - 1.0).abs() < 1e-12);
            prop_assert!((found.singular_values[2] / (least * least) - 1.0).abs() < 1e-12);
            prop_assert!(found.rotation.local(&u).norm() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn a_similarity_is_found_again(rotation in any_so3(), translation in vector::<3>(3.0), scale in 0.1..10.0, seed in prop::collection::vec((vector::<3>(1.0), 0.1..3.0), 1..6)) {
            let truth = Sim3 { scale, rotation, translation };
            // Corners keep the points apart: rounding decides about points that almost coincide.
            let corners = [Vector3::zeros(), Vector3::x(), Vector3::y()].map(|x| (x, 1.0));
            let points = corners.into_iter().chain(seed);
            let found = PointPairs::new(points.map(|(x, w)| (x, truth.act(&x), w))).similarity(1e-6).unwrap();
            prop_assert!((found.scale / scale - 1.0).abs() < 1e-9 && found.rotation.local(&rotation).norm() < 1e-6);
            prop_assert!((found.translation - translation).norm() < 1e-6 * (1.0 + scale));
        }
    }

    #[test]
    fn points_on_a_line_determine_a_rotation_with_a_direction_across_it() {
        let line = (0..4).map(|i| (Vector3::x() * f64::from(i), Vector3::x() * f64::from(i), 1.0));
        let mut pairs = PointPairs::new(line);
        assert_eq!(pairs.rigid(1e-12), None);
        assert_eq!(PointPairs::new(std::iter::empty()).rigid(1e-12), None);
        pairs.add_direction(&Vector3::z(), &Vector3::z(), 10.0);
        assert!(pairs.rigid(1e-3).unwrap().rotation.log().norm() < 1e-12);
    }

    #[test]
    fn a_rotation_comes_out_of_matrices_without_rank() {
        for matrix in [Matrix3::zeros(), Vector3::x() * Vector3::y().transpose(), Matrix3::identity() * -1.0]
        {
            let found = nearest_rotation(&matrix);
            let rotation = found.rotation.matrix();
            assert!((rotation * rotation.transpose() - Matrix3::identity()).norm() < 1e-12, "{matrix}");
            assert!(
                (trace(&found.rotation, &matrix) - found.singular_values.iter().sum::<f64>()).abs() < 1e-12
            );
        }
    }
}
