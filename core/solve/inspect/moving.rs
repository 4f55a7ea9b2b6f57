//! Variables that still move when a solve runs out of iterations.
use crate::inspect::null_space::name;
use crate::outcome::{LargestMoves, Undetermined};
use crate::problem::Problem;
use manifactor_graph::column::Columns;

impl Problem {
    /// Returns the step between the last trial and the estimate; `None` if they are equal.
    pub(crate) fn moving(&self) -> Option<LargestMoves> {
        let mut step = vec![0.0; self.dim()];
        for place in &self.model.variables {
            let value = |columns: &Columns| columns.column(place.column).get(place.index);
            let (trial, estimate) = (value(self.model.trial()), value(self.model.columns()));
            let (Some(start), Some(from), Some(to)) = (place.start, trial, estimate) else {
                continue;
            };
            let local = from.erased().local(&*to).unwrap_or_default();
            step[start..start + local.len()].copy_from_slice(&local);
        }
        if step.iter().all(|x| *x == 0.0) || !step.iter().all(|x| x.is_finite()) {
            return None;
        }
        let scale: Vec<f64> = self.system.diagonal().copied().collect();
        let Undetermined { keys, direction, moving, .. } = name(&self.model, &step, &scale);
        Some(LargestMoves { keys, direction, moving })
    }
}
