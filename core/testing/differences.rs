//! Derivatives by central differences, extrapolated to a step of zero.

/// Number of steps. Each is half of the previous one.
const LEVELS: usize = 16;

/// A derivative with an error estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derivative {
    /// The best estimate.
    pub value: f64,
    /// Largest difference from the neighbouring estimates.
    pub error: f64,
}

/// Computes the derivative at 0 of each row of `f`, with steps from `step` downwards.
///
/// It uses Richardson extrapolation as in Ridders (1982) and selects an extrapolation that agrees well with
/// its neighbours. A jump or a kink nearby only affects the longer steps. These may agree on a wrong value,
/// so shorter steps overrule them although they are less accurate. Steps at which `f` is `None` are left out.
/// Returns `None` if no step remains.
pub fn differentiate(rows: usize, step: f64, f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Vec<Derivative>> {
    // the error of a central difference is even in h
    extrapolate(rows, step, 4.0, |h| {
        let (after, before) = (f(h)?, f(-h)?);
        Some((0..rows).map(|i| quotient(after[i], before[i], 2.0 * h)).collect())
    })
}

/// Computes the one-sided derivative: `side` is 1 for the positive side and -1 for the negative one. See
/// [`differentiate`].
pub fn differentiate_from(
    side: f64,
    rows: usize,
    step: f64,
    f: impl Fn(f64) -> Option<Vec<f64>>,
) -> Option<Vec<Derivative>> {
    let middle = f(0.0)?;
    extrapolate(rows, step, 2.0, |h| {
        let there = f(side * h)?;
        Some((0..rows).map(|i| quotient(there[i], middle[i], side * h)).collect())
    })
}

/// Returns the jump of each row of `f` from 0 to the given `side`; 0 for a continuous row.
///
/// A row jumps if its change over a step is similar to its change over a step sixteen times as long.
pub fn jumps(side: f64, rows: usize, step: f64, f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
    let shortest = step / f64::from(1 << (LEVELS - 1));
    let (middle, near, far) = (f(0.0)?, f(side * shortest)?, f(side * shortest * 16.0)?);
    let of = |i: usize| {
        let (near, far): (f64, f64) = (near[i] - middle[i], far[i] - middle[i]);
        let rounding = 1e-9 * middle[i].abs().max(1.0);
        if near.abs() > 0.5 * far.abs() && near.abs() > rounding { near } else { 0.0 }
    };
    Some((0..rows).map(of).collect())
}

/// Returns a difference quotient with its rounding error.
fn quotient(after: f64, before: f64, h: f64) -> Derivative {
    let error = 2.0 * f64::EPSILON * after.abs().max(before.abs()) / h.abs();
    Derivative { value: (after - before) / h, error }
}

/// Extrapolates quotients at steps of `step`, half of it, … to 0. Each extrapolation reduces the error term
/// by `base`.
fn extrapolate(
    rows: usize,
    step: f64,
    base: f64,
    quotients: impl Fn(f64) -> Option<Vec<Derivative>>,
) -> Option<Vec<Derivative>> {
    let mut levels: Vec<Vec<Derivative>> = vec![];
    let mut previous: Vec<Vec<f64>> = vec![];
    for level in 0..LEVELS {
        let Some(first) = quotients(step / f64::from(1 << level)) else {
            previous.clear();
            continue;
        };
        // table[j] is extrapolated j times
        let mut table = vec![first.iter().map(|d| d.value).collect::<Vec<_>>()];
        let mut power = 1.0;
        for j in 0..previous.len() {
            power *= base;
            let next = (0..rows).map(|i| (power * table[j][i] - previous[j][i]) / (power - 1.0)).collect();
            table.push(next);
        }
        levels.push((0..rows).map(|i| best(&table, &previous, i, first[i].error)).collect());
        previous = table;
    }
    levels.into_iter().rev().reduce(|shorter, longer| shorter.into_iter().zip(longer).map(merge).collect())
}

/// Returns the extrapolation in `table` of row `i` that agrees best with its neighbours and with the table of
/// the previous step.
fn best(table: &[Vec<f64>], previous: &[Vec<f64>], i: usize, rounding: f64) -> Derivative {
    let mut best = Derivative { value: table[0][i], error: f64::INFINITY };
    for j in 1..table.len() {
        let value = table[j][i];
        let error = (value - table[j - 1][i]).abs().max((value - previous[j - 1][i]).abs()).max(rounding);
        if error < best.error {
            best = Derivative { value, error };
        }
    }
    best
}

/// Returns the more accurate estimate, unless the estimate from longer steps contradicts the one from shorter
/// steps.
fn merge((shorter, longer): (Derivative, Derivative)) -> Derivative {
    let apart = (shorter.value - longer.value).abs();
    // the errors are estimates themselves
    if longer.error < shorter.error && apart <= 10.0 * shorter.error { longer } else { shorter }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn derivative(f: impl Fn(f64) -> f64) -> f64 {
        differentiate(1, 1e-2, |x| Some(vec![f(x)])).unwrap()[0].value
    }

    #[test]
    fn smooth_functions_are_differentiated_to_ten_digits() {
        assert!((derivative(|x| (3.0 + x).exp()) / 3f64.exp() - 1.0).abs() < 1e-10);
        assert!((derivative(|x| 1e6 * (1.0 + x).ln()) / 1e6 - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_jump_or_a_kink_nearby_does_no_harm() {
        assert!((derivative(|x| if x > 1e-4 { 5.0 } else { x.sin() }) - 1.0).abs() < 1e-8);
        assert!((derivative(|x| (x + 1e-4).abs()) - 1.0).abs() < 1e-8);
        // longer steps agree on zero
        assert!((derivative(|x| if x.abs() > 1e-4 { 0.0 } else { 1e-4 * x.sin() }) - 1e-4).abs() < 1e-9);
    }

    #[test]
    fn the_two_sides_of_a_kink_are_told_apart() {
        let side = |side: f64, f: &dyn Fn(f64) -> f64| {
            differentiate_from(side, 1, 1e-2, |x| Some(vec![f(x)])).unwrap()[0].value
        };
        let f = |x: f64| x.sin() + 3.0 * x.max(0.0).exp();
        assert!((side(1.0, &f) - 4.0).abs() < 1e-8 && (side(-1.0, &f) - 1.0).abs() < 1e-8);
        assert!((side(1.0, &f64::exp) - 1.0).abs() < 1e-8 && (side(-1.0, &f64::exp) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn a_jump_is_measured_and_a_kink_is_none() {
        let jump = |side: f64, f: &dyn Fn(f64) -> f64| jumps(side, 1, 1e-2, |x| Some(vec![f(x)])).unwrap()[0];
        let step = |x: f64| if x > 0.0 { 2.0 + x } else { x };
        assert!((jump(1.0, &step) - 2.0).abs() < 1e-6 && jump(-1.0, &step) == 0.0);
        assert!(
            jump(1.0, &f64::abs) == 0.0 && jump(1.0, &|x: f64| 1e6 * x) == 0.0 && jump(1.0, &|_| 7.0) == 0.0
        );
    }

    #[test]
    fn undefined_steps_are_left_out() {
        let f = |x: f64| (x.abs() < 1e-3).then(|| vec![x.sin()]);
        assert!((differentiate(1, 1e-2, f).unwrap()[0].value - 1.0).abs() < 1e-9);
        assert_eq!(differentiate(1, 1e-2, |_| None), None);
    }
}
