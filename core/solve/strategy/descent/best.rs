//! The best estimate so far, for solvers with steps that may raise the cost.
use super::Descent;
use manifactor_graph::column::Columns;

/// The best estimate so far, for solvers with steps that may raise the cost.
pub(crate) struct Best {
    cost: f64,
    columns: Columns,
}

impl Best {
    pub(crate) fn new(descent: &Descent<'_>) -> Self {
        Self { cost: descent.at.cost, columns: descent.problem.model.columns().clone() }
    }
    pub(crate) fn update(&mut self, descent: &Descent<'_>) {
        if descent.at.cost < self.cost {
            self.cost = descent.at.cost;
            self.columns.clone_from(descent.problem.model.columns());
        }
    }
    /// Restores the best estimate, unless it is the last one. Returns whether its cost is lower by more than the
    /// tolerance: then what holds at the last estimate need not hold at this one.
    pub(crate) fn restore(self, descent: &mut Descent<'_>) -> bool {
        if self.cost < descent.at.cost || !descent.at.cost.is_finite() {
            let is_elsewhere = !descent.is_small(descent.at.cost - self.cost);
            descent.problem.model.restore(self.columns);
            descent.at = descent.problem.linearize();
            return is_elsewhere;
        }
        false
    }
}
