//! Search for jumps of a residual along a line, because random points almost never hit a jump.
use crate::jacobian::{At, Kink};
use manifactor_graph::{Factor, Variable};

/// Length of the line to both sides, in units of the tangent.
const REACH: f64 = 4.0;
/// Number of steps on each side. It is not a power of two, so that round numbers are not at step ends.
const STEPS: i32 = 37;
/// Number of halvings of the step with the largest change of a row.
const HALVINGS: usize = 30;
/// A smaller change over the shortest step is not a jump, relative to the row or to 1.
const JUMP_TOLERANCE: f64 = 1e-6;

/// Finds the jumps along a tangent direction of one variable, the largest one of each row. Each has the
/// variables just before the jump.
pub(super) fn jumps(
    factor: &dyn Factor,
    variables: &[&dyn Variable],
    variable: usize,
    column: usize,
) -> Vec<(Kink, Vec<Box<dyn Variable>>)> {
    let at = At { factor, variables };
    let along = |h: f64| at.along(variable, column, h).filter(|r| r.iter().all(|x| x.is_finite()));
    let places = (-STEPS..=STEPS).map(|i| f64::from(i) / f64::from(STEPS) * REACH);
    let samples: Vec<(f64, Option<Vec<f64>>)> = places.map(|h| (h, along(h))).collect();
    let steps: Vec<[(f64, &Vec<f64>); 2]> = samples
        .windows(2)
        .filter_map(|pair| Some([(pair[0].0, pair[0].1.as_ref()?), (pair[1].0, pair[1].1.as_ref()?)]))
        .collect();
    let rows = steps.first().map_or(0, |[(_, r), _]| r.len());
    let mut found = vec![];
    for row in 0..rows {
        let change = |[(_, a), (_, b)]: &[(f64, &Vec<f64>); 2]| (b[row] - a[row]).abs();
        let largest = steps.iter().max_by(|a, b| change(a).total_cmp(&change(b)));
        let Some(&[(from, before), (to, after)]) = largest else { continue };
        let value = |h: f64| along(h).map(|r| r[row]);
        let Some((place, jump)) = narrow((from, before[row]), (to, after[row]), value) else { continue };
        let kink = Kink { variable, column, row, before: 0.0, after: 0.0, jump };
        found.extend(at.moved(variable, column, place).map(|there| (kink, there)));
    }
    found
}

/// Halves a step repeatedly and keeps the half in which the function changes more. Returns the final position
/// and the jump there. Returns `None` if the function is continuous, or not defined at an intermediate
/// position.
fn narrow(mut from: (f64, f64), mut to: (f64, f64), f: impl Fn(f64) -> Option<f64>) -> Option<(f64, f64)> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (from.0 + to.0);
        let middle = (middle, f(middle)?);
        match (middle.1 - from.1).abs() > (to.1 - middle.1).abs() {
            true => to = middle,
            false => from = middle,
        }
    }
    let jump = (to.1 - from.1).abs();
    (jump > JUMP_TOLERANCE * from.1.abs().max(to.1.abs()).max(1.0)).then_some((from.0, jump))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_told_from_a_slope() {
        let find = |f: &dyn Fn(f64) -> f64| narrow((1.0, f(1.0)), (2.7, f(2.7)), |x| Some(f(x)));
        let (place, jump) = find(&|x| if x > 2.0 { x } else { x - 0.25 }).unwrap();
        assert!((place - 2.0).abs() < 1e-8 && (jump - 0.25).abs() < 1e-8);
        assert_eq!((find(&|x| 100.0 * x), find(&|x| (20.0 * (x - 2.0)).tanh())), (None, None));
        assert_eq!(narrow((0.0, 0.0), (1.0, 1.0), |_| None), None);
    }
}
