//! The cost of rejected factors, given the information of the smoother.
use crate::elimination_tree::Couplings;
use crate::model::Model;
use crate::smoother::factorization::Factorization;
use crate::smoother::steps::Steps;
use nalgebra::{DMatrix, DVector};

/// Largest number of Gauss-Newton steps. The first one gives the innovation, the next ones correct for
/// nonlinearity.
const MAX_STEPS: usize = 10;
/// Largest number of halvings of such a step.
const MAX_HALVINGS: usize = 5;

/// Cost and information of rejected factors, given the information of the smoother.
#[derive(Debug, Clone, Copy)]
pub(super) struct Innovation {
    /// min Σ‖r(x ⊕ δ)‖² + δᵀΣ⁻¹δ.
    pub(super) square: f64,
    /// ½ ln det(I + HΣ): information gain of the factors on their variables. Unit: nats.
    pub(super) gain: f64,
}

/// The model at the estimate, for the evaluation of rejected factors.
pub(super) struct Fit<'a> {
    pub(super) model: &'a mut Model,
    pub(super) steps: &'a Steps,
    pub(super) factorization: &'a Factorization,
}

impl Fit<'_> {
    /// Returns ‖r‖² of a rejected factor at the estimate; `None` if it is not defined or not finite there.
    pub(super) fn square(&mut self, factor: u32) -> Option<f64> {
        let variables = self.prepare_variables(&[factor]);
        let zeros = DVector::zeros(variables.iter().map(|v| self.model.dim(*v)).sum());
        let square = self.square_at(&[factor], &variables, &zeros);
        variables.iter().for_each(|v| self.model.reset_trial(*v));
        square
    }

    /// Returns min Σ‖r(x ⊕ δ)‖² + δᵀΣ⁻¹δ over the variables of some rejected factors, with their joint
    /// covariance Σ. Returns `None` if a variable is undetermined, no factor constrains one of its
    /// directions, or a factor is not defined.
    pub(super) fn innovation(&mut self, factors: &[u32]) -> Option<Innovation> {
        let variables = self.prepare_variables(factors);
        let has_undetermined =
            |v: &u32| self.model.is_undetermined(*v) || self.factorization.has_undetermined(*v);
        if variables.iter().any(has_undetermined) {
            return None;
        }
        let zeros = DVector::zeros(variables.iter().map(|v| self.model.dim(*v)).sum());
        let square = self.square_at(factors, &variables, &zeros);
        let least = square.and_then(|square| self.descend(factors, &variables, square));
        variables.iter().for_each(|v| self.model.reset_trial(*v));
        least
    }

    fn descend(&mut self, factors: &[u32], variables: &[u32], square: f64) -> Option<Innovation> {
        let sigma = self.factorization.gauged_covariance(self.model, variables);
        let n = sigma.nrows();
        // δ = Σy throughout: this needs no inverse of Σ, which may be singular, and δᵀΣ⁻¹δ = yᵀδ
        let (mut least, mut y, mut gain) = (square, DVector::zeros(n), 0.0);
        for _ in 0..MAX_STEPS {
            let delta = &sigma * &y;
            let (h, g) = self.model.sums(variables, factors);
            // the minimum of the quadratic: (I + HΣ) y = Hδ − g
            let matrix = (DMatrix::identity(n, n) + &h * &sigma).lu();
            gain = 0.5 * matrix.u().diagonal().iter().map(|x| x.abs().ln()).sum::<f64>();
            let aim = matrix.solve(&(&h * &delta - g))?;
            let mut step = aim - &y;
            let lower = (0..MAX_HALVINGS).find_map(|_| {
                let delta = &sigma * (&y + &step);
                let square = self.square_at(factors, variables, &delta);
                let total =
                    square.map(|square| square + (&y + &step).dot(&delta)).filter(|total| *total < least);
                step *= if total.is_none() { 0.5 } else { 1.0 };
                total
            });
            let Some(total) = lower else { break };
            y += &step;
            let is_last = total > least * (1.0 - 1e-3);
            least = total;
            if is_last {
                break;
            }
        }
        Some(Innovation { square: least, gain })
    }

    /// Returns the sum of ‖r‖² of factors at a step from the estimate. The factors stay linearized there.
    fn square_at(&mut self, factors: &[u32], variables: &[u32], step: &DVector<f64>) -> Option<f64> {
        let mut first = 0;
        for v in variables {
            let dim = self.model.dim(*v);
            let from = self.steps.of(self.model, *v);
            let step: Vec<f64> = from.iter().zip(step.rows(first, dim).iter()).map(|(a, b)| a + b).collect();
            self.model.try_step(*v, &step);
            first += dim;
        }
        let evaluation = self.model.linearize(factors);
        let is_defined = factors.iter().all(|f| self.model.is_defined(*f));
        let square = 2.0 * evaluation.cost;
        (is_defined && evaluation.not_finite.is_none() && square.is_finite()).then_some(square)
    }

    /// Returns the variables of some rejected factors, ascending. Passes the held directions to the factors
    /// first, because rejected factors are not connected to their variables.
    fn prepare_variables(&mut self, factors: &[u32]) -> Vec<u32> {
        factors.iter().for_each(|f| self.model.pass_held_directions(*f));
        let all = factors.iter().filter_map(|f| self.model.factor(*f)).flat_map(|f| f.variables());
        let mut variables: Vec<u32> = all.collect();
        variables.sort_unstable();
        variables.dedup();
        variables
    }
}
