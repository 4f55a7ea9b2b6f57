//! Steps from the factorization, from the root downwards as far as something changes.
use super::Session;
use crate::tree::Redone;

impl Session {
    /// Back-substitutes through the new fronts and the fronts below them whose rows have changed; in an idle update, through all
    /// fronts. Returns the number of variables.
    pub(super) fn solve(&mut self, redone: &Redone) -> usize {
        self.moved.clear();
        self.before.clear();
        let mut solved = 0;
        let mut open: Vec<u32> = vec![];
        if self.is_idle {
            open.extend(self.factorization.roots());
        } else {
            solved += redone.new.iter().rev().map(|f| self.solve_front(*f)).sum::<usize>();
            open.extend(redone.kept.iter().map(|(kept, _)| *kept));
        }
        while let Some(f) = open.pop() {
            let (rows, children) = self.factorization.below(f);
            if self.is_idle || rows.iter().any(|row| self.changed[*row as usize] == self.pass) {
                open.extend_from_slice(children);
                solved += self.solve_front(f);
            }
        }
        solved
    }

    fn solve_front(&mut self, f: u32) -> usize {
        let deviation = self.deviation();
        let Self { factorization, model, delta, changed, moved, before, .. } = self;
        let (variables, mut x) = factorization.solve(model, f, delta);
        let first = moved.len();
        for v in variables {
            let range = model.blocks.range(*v);
            let (step, rest) = x.split_at(range.len());
            x = rest;
            // compared with what was last passed on, so that small changes add up
            let old = &mut delta[range];
            let precision = model.blocks.precision(*v);
            let mut changes = step.iter().zip(&*old).zip(precision);
            if changes.any(|((new, old), precision)| (new - old).abs() * precision > deviation) {
                moved.push((*v, before.len()));
                before.extend_from_slice(old);
                old.copy_from_slice(step);
                changed[*v as usize] = self.pass;
            }
        }
        let solved = variables.len();
        if !self.suspects.is_empty() {
            self.shaken.extend(self.moved[first..].iter().map(|(v, _)| *v));
        }
        for i in first..self.moved.len() {
            self.note_excess(self.moved[i].0);
        }
        solved
    }
}
