//! Functions of θ² from which the exponential and logarithmic maps are built, accurate at zero and close to
//! it.
//!
//! As functions of θ² they are smooth at zero; θ itself has no derivative there.
use manifactor_graph::Scalar;

/// Threshold on θ² below which the series is used: the closed forms lose digits to cancellation there, and
/// five terms of the series omit less than 1e-16.
const SERIES_LIMIT: f64 = 1e-2;

/// Evaluates c₀ + c₁x + c₂x² + ….
fn series<T: Scalar>(x: T, c: [f64; 5]) -> T {
    c.iter().rev().fold(T::zero(), |sum, c| sum * x + T::from(*c))
}

/// Coefficients of the exponential maps.
pub(crate) struct Exponential<T> {
    /// cos(θ/2)
    pub(crate) cos_half: T,
    /// sin(θ/2) / θ
    pub(crate) sin_half: T,
    /// (1 - cos θ) / θ²
    pub(crate) a: T,
    /// (θ - sin θ) / θ³
    pub(crate) b: T,
}

pub(crate) fn exponential<T: Scalar>(theta2: T) -> Exponential<T> {
    let (cos_half, sin_half, b) = if theta2 < T::from(SERIES_LIMIT) {
        (
            series(theta2, [1.0, -1.0 / 8.0, 1.0 / 384.0, -1.0 / 46080.0, 1.0 / 10321920.0]),
            series(theta2, [0.5, -1.0 / 48.0, 1.0 / 3840.0, -1.0 / 645120.0, 1.0 / 185794560.0]),
            series(theta2, [1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0, -1.0 / 362880.0, 1.0 / 39916800.0]),
        )
    } else {
        let theta = theta2.sqrt();
        let (s, c) = (theta * 0.5).sin_cos();
        (c, s / theta, (theta - s * c * 2.0) / (theta2 * theta))
    };
    Exponential { cos_half, sin_half, a: sin_half * sin_half * 2.0, b }
}

/// Returns (1/2 - (1 - cos θ) / θ²) / θ², with `a` from [`exponential`].
pub(crate) fn second_integral<T: Scalar>(theta2: T, a: T) -> T {
    if theta2 < T::from(SERIES_LIMIT) {
        series(theta2, [1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0, 1.0 / 479001600.0])
    } else {
        (T::from(0.5) - a) / theta2
    }
}

/// Returns k = (1 - (θ/2) cot(θ/2)) / θ² for the logarithmic maps. `half_cot` computes (θ/2) cot(θ/2) and is
/// called only away from zero.
pub(crate) fn k<T: Scalar>(theta2: T, half_cot: impl FnOnce() -> T) -> T {
    if theta2 < T::from(SERIES_LIMIT) {
        series(theta2, [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30240.0, 1.0 / 1209600.0, 1.0 / 47900160.0])
    } else {
        (T::one() - half_cot()) / theta2
    }
}

/// Returns k and k'(θ) / θ for the inverse right Jacobians.
pub(crate) fn k_and_slope(theta2: f64) -> (f64, f64) {
    if theta2 < SERIES_LIMIT {
        let slope = [1.0 / 360.0, 1.0 / 7560.0, 1.0 / 201600.0, 1.0 / 5987520.0, 691.0 / 130767436800.0];
        return (k(theta2, || 0.0), series(theta2, slope));
    }
    let theta = theta2.sqrt();
    let (s, c) = (0.5 * theta).sin_cos();
    let half_cot = 0.5 * theta * c / s;
    (k(theta2, || half_cot), (half_cot + theta2 / (4.0 * s * s) - 2.0) / (theta2 * theta2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_closed_forms_meet() {
        // At both sides of the switch, up to the change of the function itself.
        let (below, above) = (SERIES_LIMIT * (1.0 - 1e-12), SERIES_LIMIT * (1.0 + 1e-12));
        let (x, y) = (exponential(below), exponential(above));
        for (x, y) in [(x.cos_half, y.cos_half), (x.sin_half, y.sin_half), (x.a, y.a), (x.b, y.b)] {
            assert!((x - y).abs() < 1e-13, "{x} {y}");
        }
        let (x, y) = (second_integral(below, x.a), second_integral(above, y.a));
        assert!((x - y).abs() < 1e-13, "{x} {y}");
        let (x, y) = (k_and_slope(below), k_and_slope(above));
        assert!((x.0 - y.0).abs() < 1e-13 && (x.1 - y.1).abs() < 1e-11, "{x:?} {y:?}");
    }

    #[test]
    fn values_at_zero_are_the_limits() {
        let x = exponential(0.0);
        assert_eq!((x.cos_half, x.sin_half, x.a, x.b), (1.0, 0.5, 0.5, 1.0 / 6.0));
        assert_eq!(second_integral(0.0, 0.5), 1.0 / 24.0);
        assert_eq!(k_and_slope(0.0), (1.0 / 12.0, 1.0 / 360.0));
    }
}
