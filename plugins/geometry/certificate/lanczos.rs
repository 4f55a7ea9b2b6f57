//! The largest eigenvalue of a symmetric operator, by Lanczos' method.
use nalgebra::{DMatrix, DVector};

/// Returns the largest eigenvalue of the operator x ← A x on `n` numbers, from a fixed initial vector.
///
/// Every new direction is orthogonalized against all previous ones. Stops when the eigenvalue has the
/// relative accuracy `tolerance`, or after `steps` steps. The result never exceeds the true value, except by
/// rounding.
pub(super) fn largest(n: usize, steps: usize, tolerance: f64, mut apply: impl FnMut(&mut [f64])) -> f64 {
    let mut basis: Vec<DVector<f64>> = vec![start(n)];
    let (mut diagonal, mut beside) = (vec![], vec![]);
    let mut value = 0.0;
    while let Some(last) = basis.last() {
        let mut next = last.clone();
        apply(next.as_mut_slice());
        diagonal.push(last.dot(&next));
        // Twice: a single pass leaves rounding errors along the largest direction.
        for _ in 0..2 {
            for q in &basis {
                next.axpy(-q.dot(&next), q, 1.0);
            }
        }
        let k = diagonal.len();
        let tridiagonal = DMatrix::from_fn(k, k, |r, c| match r.abs_diff(c) {
            0 => diagonal[r],
            1 => beside[r.min(c)],
            _ => 0.0,
        });
        let eigen = tridiagonal.symmetric_eigen();
        let top = eigen.eigenvalues.imax();
        value = eigen.eigenvalues[top];
        let norm = next.norm();
        let known = norm * eigen.eigenvectors[(k - 1, top)].abs() <= tolerance * value.abs();
        // The first Ritz values may have converged to a smaller eigenvalue.
        if (known && k > 5) || k == steps.min(n) || norm <= f64::EPSILON * value.abs() {
            break;
        }
        beside.push(norm);
        basis.push(next / norm);
    }
    value
}

/// A pseudo-random unit vector from a linear congruential generator, so it matches no pattern of a graph.
fn start(n: usize) -> DVector<f64> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut draw = |_: usize, _: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    DVector::from_fn(n, &mut draw).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_largest_of_a_dense_decomposition(
            n in 1..30_usize,
            entries in prop::collection::vec(-1.0..1.0_f64, 900),
        ) {
            let m = DMatrix::from_fn(n, n, |r, c| entries[r * 30 + c]);
            let m = &m + m.transpose();
            let found = largest(n, 100, 1e-12, |x| {
                let y = &m * DVector::from_column_slice(x);
                x.copy_from_slice(y.as_slice());
            });
            prop_assert!((found - m.symmetric_eigenvalues().max()).abs() < 1e-8);
        }
    }

    #[test]
    fn equal_eigenvalues_end_it_early() {
        assert!((largest(1000, 50, 1e-12, |x| x.iter_mut().for_each(|x| *x *= 3.0)) - 3.0).abs() < 1e-12);
    }
}
