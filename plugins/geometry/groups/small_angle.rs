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

/// Coefficients of W = ∫ e^{λs} Exp(sω) ds = A + B ω^ + C (ω^)² for s from 0 to 1, and of its inverse.
pub(crate) struct ScaledIntegral<T> {
    /// A, B, C.
    pub(crate) forward: [T; 3],
    /// Those of W⁻¹.
    pub(crate) inverse: [T; 3],
}

/// Terms of the power series below the limit: they omit less than 1e-16.
const SCALED_TERMS: i32 = 10;

/// Returns the coefficients for θ² and λ. With z = λ + iθ, W turns a vector in the plane of rotation by the factor
/// (e^z - 1)/z, and scales the axis by (e^λ - 1)/λ.
pub(crate) fn scaled_integral<T: Scalar>(theta2: T, lambda: T) -> ScaledIntegral<T> {
    let size = theta2 + lambda * lambda;
    let of_axis = |lambda: T| {
        if lambda * lambda < T::from(SERIES_LIMIT) {
            (2..=SCALED_TERMS).rev().fold(T::one(), |sum, n| sum * lambda / f64::from(n) + T::one())
        } else {
            lambda.exp_m1() / lambda
        }
    };
    let a = of_axis(lambda);
    let (b, c) = if size < T::from(SERIES_LIMIT) {
        // z^n = p + iθq and λ^n = p + θ²d, each divided by (n + 1)!
        let (mut p, mut q, mut d) = (T::one(), T::zero(), T::zero());
        let (mut b, mut c) = (T::zero(), T::zero());
        for n in 1..=SCALED_TERMS {
            (p, q, d) = (p * lambda - theta2 * q, p + q * lambda, d * lambda + q);
            let factor = 1.0 / f64::from(n + 1);
            (p, q, d) = (p * factor, q * factor, d * factor);
            b += q;
            c += d;
        }
        (b, c)
    } else {
        let e = exponential(theta2);
        let (sinc, cos) = (e.sin_half * e.cos_half * 2.0, T::one() - theta2 * e.a);
        let growth = lambda.exp();
        let over = |numerator: T| numerator / size;
        (over(growth * (lambda * sinc - cos) + T::one()), over(growth * (lambda * e.a - sinc) + a))
    };
    let p = a - theta2 * c;
    let norm2 = p * p + theta2 * b * b;
    ScaledIntegral { forward: [a, b, c], inverse: [a.recip(), -b / norm2, (b * b - p * c) / (a * norm2)] }
}

/// Returns a'(θ) / θ and b'(θ) / θ for `a` and `b` of [`exponential`].
pub(crate) fn exponential_slopes(theta2: f64, e: &Exponential<f64>) -> (f64, f64) {
    if theta2 < SERIES_LIMIT {
        let a = [-1.0 / 12.0, 1.0 / 180.0, -1.0 / 6720.0, 1.0 / 453600.0, -1.0 / 47900160.0];
        let b = [-1.0 / 60.0, 1.0 / 1260.0, -1.0 / 60480.0, 1.0 / 4989600.0, -1.0 / 622702080.0];
        (series(theta2, a), series(theta2, b))
    } else {
        ((1.0 - theta2 * e.b - 2.0 * e.a) / theta2, (e.a - 3.0 * e.b) / theta2)
    }
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
        let (below_slopes, above_slopes) = (exponential_slopes(below, &x), exponential_slopes(above, &y));
        assert!((below_slopes.0 - above_slopes.0).abs() < 1e-12, "{below_slopes:?} {above_slopes:?}");
        assert!((below_slopes.1 - above_slopes.1).abs() < 1e-11, "{below_slopes:?} {above_slopes:?}");
        let (x, y) = (second_integral(below, x.a), second_integral(above, y.a));
        assert!((x - y).abs() < 1e-13, "{x} {y}");
        let (x, y) = (k_and_slope(below), k_and_slope(above));
        assert!((x.0 - y.0).abs() < 1e-13 && (x.1 - y.1).abs() < 1e-11, "{x:?} {y:?}");
    }

    #[test]
    fn scaled_integrals_are_those_of_a_quadrature() {
        // composite Simpson's rule
        let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
            let n = 2000;
            let weight = |i: usize| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            (0..=n).map(|i| weight(i) * f(i as f64 / n as f64)).sum::<f64>() / (3 * n) as f64
        };
        for theta in [1e-9, 1e-3, 0.0999, 0.1001, 1.0, 3.1] {
            for lambda in [-4.0, -0.1001, -0.0999, -1e-9, 0.0, 1e-4, 0.05, 0.2, 3.0] {
                let w = scaled_integral(theta * theta, lambda);
                let exp = |s: f64| f64::exp(lambda * s);
                let sinc = |s: f64| {
                    if theta * s < 1e-3 {
                        s - theta * theta * s.powi(3) / 6.0
                    } else {
                        (theta * s).sin() / theta
                    }
                };
                let versine = |s: f64| 2.0 * ((theta * s / 2.0).sin() / theta).powi(2);
                let expected =
                    [integral(&exp), integral(&|s| exp(s) * sinc(s)), integral(&|s| exp(s) * versine(s))];
                for (x, expected) in w.forward.iter().zip(expected) {
                    assert!(
                        (x - expected).abs() < 1e-9 * expected.abs().max(1.0),
                        "{theta} {lambda}: {x} {expected}"
                    );
                }
                // (A + Bi θ - Cθ²) is the factor in the plane
                let [factor, inverse] =
                    [w.forward, w.inverse].map(|[a, b, c]| (a - c * theta * theta, b * theta));
                let one = (
                    factor.0 * inverse.0 - factor.1 * inverse.1,
                    factor.0 * inverse.1 + factor.1 * inverse.0,
                );
                assert!((one.0 - 1.0).abs() < 1e-12 && one.1.abs() < 1e-12, "{theta} {lambda}: {one:?}");
                assert!((w.forward[0] * w.inverse[0] - 1.0).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn scaled_integrals_meet_at_the_switch() {
        for turn in [0.0, 0.5, 1.0, 1.5] {
            let at = |size: f64| scaled_integral((f64::sin(turn) * size).powi(2), f64::cos(turn) * size);
            let [below, above] = [at(0.1 * (1.0 - 1e-12)), at(0.1 * (1.0 + 1e-12))];
            for (x, y) in
                below.forward.iter().chain(&below.inverse).zip(above.forward.iter().chain(&above.inverse))
            {
                assert!((x - y).abs() < 3e-13, "{turn}: {x} {y}");
            }
        }
    }

    #[test]
    fn values_at_zero_are_the_limits() {
        assert_eq!(scaled_integral(0.0, 0.0).forward, [1.0, 0.5, 1.0 / 6.0]);
        let x = exponential(0.0);
        assert_eq!((x.cos_half, x.sin_half, x.a, x.b), (1.0, 0.5, 0.5, 1.0 / 6.0));
        assert_eq!(second_integral(0.0, 0.5), 1.0 / 24.0);
        assert_eq!(k_and_slope(0.0), (1.0 / 12.0, 1.0 / 360.0));
    }
}
