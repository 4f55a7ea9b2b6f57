//! Points without a derivative of the residual: kinks, with different derivatives on both sides, and jumps.
use crate::differences::{Derivative, differentiate_from, jumps};
use crate::jacobian::JacobianEntry;

/// Smallest difference of the one-sided derivatives at a kink, relative to their size.
const MIN_DIFFERENCE: f64 = 1e-3;

/// An entry of a Jacobian at a kink or at a jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kink {
    /// Position of the variable, counted from 0.
    pub variable: usize,
    /// The tangent direction, counted from 0.
    pub column: usize,
    /// The row, counted from 0.
    pub row: usize,
    /// The derivative from below.
    pub before: f64,
    /// The derivative from above.
    pub after: f64,
    /// Jump of the residual; 0 at a kink.
    pub jump: f64,
}

impl Kink {
    /// Returns the jump of the derivative.
    pub fn size(&self) -> f64 {
        (self.after - self.before).abs()
    }
}

/// Both sides of a point along one direction.
pub(crate) struct Sides {
    before: Vec<Derivative>,
    after: Vec<Derivative>,
    jumps: Vec<f64>,
}

/// Evaluates both sides. Returns `None` if the residual is not defined on one of them.
pub(crate) fn sides(rows: usize, step: f64, f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Sides> {
    let (down, up) = (jumps(-1.0, rows, step, &f)?, jumps(1.0, rows, step, &f)?);
    Some(Sides {
        before: differentiate_from(-1.0, rows, step, &f)?,
        after: differentiate_from(1.0, rows, step, &f)?,
        jumps: down.iter().zip(up).map(|(d, u)| d.abs().max(u.abs())).collect(),
    })
}

impl Sides {
    /// Returns the kink or jump that explains a wrong entry. At a kink, the entry has to be the derivative of
    /// one side, or lie between both.
    pub(crate) fn kink(&self, entry: &JacobianEntry) -> Option<Kink> {
        let &JacobianEntry { variable, column, row, found, .. } = entry;
        let (before, after, jump) = (self.before[row].value, self.after[row].value, self.jumps[row]);
        let kink = Kink { variable, column, row, before, after, jump };
        if jump > 0.0 {
            return Some(kink);
        }
        let slack = MIN_DIFFERENCE * before.abs().max(after.abs()).max(1.0);
        let between = (before.min(after) - slack / 10.0..=before.max(after) + slack / 10.0).contains(&found);
        (kink.size() > slack && between).then_some(kink)
    }
}

/// Returns the kink that explains an entry within the range of different entries nearby. This is a
/// generalized gradient in the sense of Clarke.
pub(crate) fn hull(nearby: &[f64], entry: &JacobianEntry) -> Option<Kink> {
    let &JacobianEntry { variable, column, row, found, .. } = entry;
    let before = nearby.iter().copied().reduce(f64::min)?;
    let after = nearby.iter().copied().reduce(f64::max)?;
    let kink = Kink { variable, column, row, before, after, jump: 0.0 };
    let slack = MIN_DIFFERENCE * before.abs().max(after.abs()).max(1.0);
    let among = (before - slack..=after + slack).contains(&found);
    (kink.size() > 10.0 * slack && among).then_some(kink)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(found: f64) -> JacobianEntry {
        JacobianEntry { variable: 0, column: 0, row: 0, found, expected: 0.0, error: 1.0 }
    }

    #[test]
    fn an_entry_at_a_kink_is_that_of_a_side_or_between() {
        let sides = sides(1, 1e-2, |h| Some(vec![h.abs() * 2.0])).unwrap();
        assert_eq!(sides.kink(&entry(2.0)).map(|k| k.size().round()), Some(4.0));
        assert!(sides.kink(&entry(0.0)).is_some() && sides.kink(&entry(3.0)).is_none());
    }

    #[test]
    fn a_wrong_derivative_of_a_smooth_residual_is_no_kink() {
        let sides = sides(1, 1e-2, |h| Some(vec![h.sin()])).unwrap();
        assert!(sides.kink(&entry(0.0)).is_none());
        assert!(hull(&[1.0, 1.0, 0.9999], &entry(0.0)).is_none());
        assert!(hull(&[0.0, 1.0, 0.0], &entry(1.0)).is_some() && hull(&[0.0, 1.0], &entry(2.0)).is_none());
    }
}
