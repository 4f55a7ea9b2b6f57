//! Derivatives by central differences, extrapolated to a step of zero.

/// Number of steps, each half of the one before.
const LEVELS: usize = 16;

/// A derivative, and how far it may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derivative {
    /// The best estimate.
    pub value: f64,
    /// How much the estimates around it differ.
    pub error: f64,
}

/// The derivative at 0 of each row of `f`, from steps of `step` downwards.
///
/// Richardson extrapolation in the manner of Ridders (1982): of all extrapolations from all steps,
/// one that agrees well with its neighbours. A jump or a kink nearby spoils the longer steps only.
/// Those may agree with each other, on the wrong value: shorter steps, though less exact, overrule
/// them. Steps where `f` is `None` are left out; `None` comes back where all are.
pub fn differentiate(rows: usize, step: f64, f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Vec<Derivative>> {
    // the error of a central difference is even in h
    extrapolate(rows, step, 4.0, |h| {
        let (after, before) = (f(h)?, f(-h)?);
        Some((0..rows).map(|i| quotient(after[i], before[i], 2.0 * h)).collect())
    })
}

/// The derivative from one side: for the positive `side` 1, or the negative -1. [`differentiate`] says how.
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

/// How far each row of `f` jumps from 0 to the one `side`; 0 where it is continuous.
///
/// A row that jumps changes as much over a step as over one sixteen times as long.
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

/// A difference over its step, and what rounding does to it.
fn quotient(after: f64, before: f64, h: f64) -> Derivative {
    let error = 2.0 * f64::EPSILON * after.abs().max(before.abs()) / h.abs();
    Derivative { value: (after - before) / h, error }
}

/// Quotients at steps of `step`, half of it, …, extrapolated to 0, where each power of the error falls by `base`.
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
        // table[j]: extrapolated j times
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

/// Of all extrapolations in `table` of row `i`, the one that agrees best with its neighbours there and
/// in the table of the step before.
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

/// The more exact of two estimates, unless the one from longer steps contradicts the other.
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
