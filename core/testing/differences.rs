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
    let mut levels: Vec<Vec<Derivative>> = vec![];
    let mut previous: Vec<Vec<f64>> = vec![];
    for level in 0..LEVELS {
        let h = step / f64::from(1 << level);
        let (Some(after), Some(before)) = (f(h), f(-h)) else {
            previous.clear();
            continue;
        };
        // table[j]: extrapolated j times; the error of a central difference is even in h
        let mut table = vec![(0..rows).map(|i| (after[i] - before[i]) / (2.0 * h)).collect::<Vec<_>>()];
        let mut power = 1.0;
        for j in 0..previous.len() {
            power *= 4.0;
            let next = (0..rows).map(|i| (power * table[j][i] - previous[j][i]) / (power - 1.0)).collect();
            table.push(next);
        }
        let rounding = |i: usize| 2.0 * f64::EPSILON * after[i].abs().max(before[i].abs()) / h;
        levels.push((0..rows).map(|i| best(&table, &previous, i, rounding(i))).collect());
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
    fn undefined_steps_are_left_out() {
        let f = |x: f64| (x.abs() < 1e-3).then(|| vec![x.sin()]);
        assert!((differentiate(1, 1e-2, f).unwrap()[0].value - 1.0).abs() < 1e-9);
        assert_eq!(differentiate(1, 1e-2, |_| None), None);
    }
}
