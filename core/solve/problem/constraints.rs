//! Equality constraints of a problem, with their multipliers.
use crate::outcome::ConstraintState;
use crate::problem::Problem;

/// Largest entry of a whitened residual at which a constraint counts as satisfied.
pub(crate) const TOLERANCE: f64 = 1e-9;

/// A constraint, whose whitened residual c has to be zero.
#[derive(Debug, Clone)]
struct Constraint {
    factor: usize,
    /// λ of the Lagrangian f + λᵀc.
    multipliers: Vec<f64>,
}

/// The constraints of a problem. The cost of each is ½μ‖c + λ/μ‖², which has its minimum at c = 0 if λ are its
/// multipliers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Constraints {
    all: Vec<Constraint>,
    /// μ; zero outside of the method of multipliers.
    penalty: f64,
}

impl Constraints {
    pub(super) fn of(factors: impl Iterator<Item = (usize, usize)>) -> Self {
        let constraint = |(factor, rows)| Constraint { factor, multipliers: vec![0.0; rows] };
        Self { all: factors.map(constraint).collect(), penalty: 0.0 }
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }
    /// Returns whether the method of multipliers has set a penalty, so that it checks the violation itself.
    pub(crate) fn have_penalty(&self) -> bool {
        self.penalty > 0.0
    }
}

impl Problem {
    /// Returns the whitened residual of each constraint at the estimate; infinite where it is undefined.
    fn constraint_residuals(&self) -> Vec<Vec<f64>> {
        let mut batches: Vec<Option<Vec<_>>> = vec![None; self.model.batches.len()];
        let residual = |constraint: &Constraint| {
            let place = &self.model.factors[constraint.factor];
            let batch = place.batch as usize;
            let inspect = || self.model.batches[batch].inspect(self.model.columns());
            let state = &batches[batch].get_or_insert_with(inspect)[place.index as usize];
            match state.defined {
                true => state.whitened.clone(),
                false => vec![f64::INFINITY; constraint.multipliers.len()],
            }
        };
        self.constraints.all.iter().map(residual).collect()
    }

    /// Returns the largest violation of a constraint at the estimate, in units of its noise.
    pub(crate) fn violation(&self) -> f64 {
        let all = self.constraint_residuals();
        all.iter()
            .flatten()
            .fold(0.0, |most, c| if c.is_nan() { f64::INFINITY } else { f64::max(most, c.abs()) })
    }

    /// Returns the state of each constraint at the estimate.
    pub(crate) fn constraint_states(&self) -> Vec<ConstraintState> {
        let state = |(constraint, residual): (&Constraint, Vec<f64>)| {
            let place = &self.model.factors[constraint.factor];
            let (factor, multipliers) = (constraint.factor, constraint.multipliers.clone());
            ConstraintState {
                factor,
                name: place.label(),
                keys: self.model.keys(factor),
                residual,
                multipliers,
            }
        };
        self.constraints.all.iter().zip(self.constraint_residuals()).map(state).collect()
    }

    /// Returns a penalty with which the constraints are stiff beside the other factors, whatever their units.
    pub(crate) fn stiff_penalty(&mut self) -> f64 {
        /// Ratio of the information from constraints to the information from other factors, in the same unknowns.
        const STIFFNESS: f64 = 100.0;
        let mut diagonal = |scale: f64| -> Vec<f64> {
            for constraint in &self.constraints.all {
                self.model.augment(constraint.factor, scale, &[]);
            }
            self.linearize();
            self.system.diagonal().copied().collect()
        };
        let (others, all) = (diagonal(0.0), diagonal(1.0));
        let constrained = others.iter().zip(&all).filter(|(others, all)| all > others);
        let sum = constrained.fold((0.0, 0.0), |sum, (others, all)| (sum.0 + others, sum.1 + all - others));
        let penalty = STIFFNESS * sum.0 / sum.1;
        if penalty > 0.0 && penalty.is_finite() { penalty } else { 1.0 }
    }

    /// Sets the penalty, and with it the cost of each constraint.
    pub(crate) fn set_penalty(&mut self, penalty: f64) {
        self.constraints.penalty = penalty;
        let root = penalty.sqrt();
        for constraint in &self.constraints.all {
            let shift: Vec<f64> = constraint.multipliers.iter().map(|x| x / root).collect();
            self.model.augment(constraint.factor, root, &shift);
        }
    }

    /// Sets the multipliers to those of the estimate: λ ← λ + μc.
    pub(crate) fn update_multipliers(&mut self) {
        let residuals = self.constraint_residuals();
        let Constraints { all, penalty } = &mut self.constraints;
        for (constraint, residual) in all.iter_mut().zip(residuals) {
            constraint.multipliers.iter_mut().zip(residual).for_each(|(x, c)| *x += *penalty * c);
        }
    }

    /// Takes over the multipliers and the penalty of an earlier problem of the same graph.
    pub(crate) fn set_constraints(&mut self, constraints: &Constraints) {
        self.constraints = constraints.clone();
        if constraints.have_penalty() {
            self.set_penalty(constraints.penalty);
        }
    }

    /// Returns the cost of all factors at the estimate, with their weights, but without constraints.
    pub(crate) fn objective(&self) -> f64 {
        let mut costs = vec![];
        self.model.factor_costs(&mut costs);
        self.constraints.all.iter().for_each(|constraint| costs[constraint.factor] = 0.0);
        let weights = self.weights();
        costs.iter().enumerate().map(|(i, cost)| cost * weights.get(i).unwrap_or(&1.0)).sum()
    }
}
