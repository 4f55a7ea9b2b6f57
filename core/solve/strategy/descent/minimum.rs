//! Test for a minimum of the cost, and escape from a maximum, a saddle or a singular point.
//!
//! The gradient vanishes at all of these, and so does the step of every solver. JᵀJ cannot distinguish
//! them: the curvature of the cost is JᵀJ + Σ r ∇²r, and only the second term can be negative.
use super::Descent;
use crate::linear::system::{dot, norm};
use crate::outcome::{Termination, Tolerance};
use nalgebra::DMatrix;

/// Maximum number of escapes in one solve.
const MAX_ESCAPES: usize = 10;
/// Step of the test, as a share of a variable's standard deviation.
const STEP_SHARE: f64 = 0.1;
/// Maximum step of the test, in tangent units.
const MAX_STEP: f64 = 0.05;
/// Step of the test along a flat direction, without a slope of any factor, in tangent units.
const FLAT_STEP: f64 = 1e-3;
/// Share of a factor's cost below which its second difference is rounding.
const ROUNDING_SHARE: f64 = 1e-8;
/// Step for differences of gradients, as a share of the step of the test.
const DIFFERENCE_SHARE: f64 = 1e-2;
/// Maximum number of products with the Hessian.
const MAX_PRODUCTS: usize = 12;
/// Smallest curvature, as a share of JᵀJ's, above which the test accepts the minimum.
const MIN_CURVATURE: f64 = 0.5;
/// Maximum number of flat directions that are tried one by one.
const MAX_FLAT_DIRECTIONS: usize = 32;
/// Shares of the diagonal that are added to JᵀJ; the first that makes it positive definite is used.
const DIAGONAL_SHIFTS: [f64; 3] = [1e-10, 1e-6, 1e-3];
/// Lower bound of diagonal entries, as a share of the largest one.
const DIAGONAL_FLOOR: f64 = 1e-9;
/// Relative tolerance above which a solve is not tested, such as the inner solves of graduated
/// non-convexity.
const MAX_TOLERANCE: f64 = 1e-4;

/// Result of probing all factors on both sides of the estimate.
struct Probe {
    /// Unknowns of factors with negative curvature.
    bent: Vec<bool>,
    /// Whether a factor is undefined at the estimate, but defined on both sides of it.
    is_singular: bool,
}

impl Descent<'_> {
    /// Leaves a point at which the solve has ended although the cost is lower nearby. Returns whether it
    /// did, so that the solve continues.
    pub(crate) fn leave_stationary_point(&mut self, termination: &Termination) -> bool {
        let Termination::Converged { reason } = termination else { return false };
        let is_zero = *reason == Tolerance::AbsoluteCost && self.at.inactive == 0;
        if is_zero
            || self.stop.relative_cost() > MAX_TOLERANCE
            || self.escapes >= MAX_ESCAPES
            || self.gradient().is_empty()
        {
            return false;
        }
        let steps = self.probe_steps();
        let probe = self.probe(&steps);
        if probe.is_singular {
            self.escapes += 1;
            self.move_by(&steps);
            return self.at.not_finite.is_none();
        }
        tracing::debug!(bent = probe.bent.iter().filter(|bent| **bent).count(), "probed the ending");
        let flat: Vec<usize> = self.flat_unknowns().take(MAX_FLAT_DIRECTIONS).collect();
        if flat.is_empty() && !probe.bent.contains(&true) {
            return false;
        }
        let unit = |i: &usize| {
            let mut direction = vec![0.0; steps.len()];
            direction[*i] = steps[*i].abs();
            direction
        };
        let found = flat.iter().map(unit).any(|direction| self.descend_along(&direction))
            || self
                .negative_curvature(&steps, &probe.bent)
                .is_some_and(|direction| self.descend_along(&direction));
        self.escapes += usize::from(found);
        found
    }

    /// Returns a step for each unknown: a tenth of its standard deviation, with the noise scaled to fit the
    /// residuals. It does not depend on the noise's unit.
    fn probe_steps(&self) -> Vec<f64> {
        let rows: u32 = self.problem.model.factors.iter().map(|factor| factor.rows).sum();
        let fit = (2.0 * self.at.cost / f64::from(rows.max(1))).sqrt();
        // with inactive factors, the residuals do not show how good the fit is
        let fit = if self.at.inactive > 0 { fit.max(1.0) } else { fit };
        let step = |(i, d): (usize, &f64)| {
            let wave = ((i * 7919 % 104_729) as f64 + 1.0).sin();
            let size = if *d > 0.0 { (STEP_SHARE * fit / d.sqrt()).min(MAX_STEP) } else { FLAT_STEP };
            size * (0.5 + 0.5 * wave.abs()).copysign(wave)
        };
        let mut steps: Vec<f64> = self.problem.system.diagonal().enumerate().map(step).collect();
        self.problem.system.held.iter().for_each(|i| steps[*i] = 0.0);
        self.problem.clip_both_ways(&mut steps);
        steps
    }

    /// Returns the unknowns on which no whitened and weighted residual depends to first order.
    fn flat_unknowns(&self) -> impl Iterator<Item = usize> {
        self.problem.system.diagonal().enumerate().filter(|(_, d)| **d == 0.0).map(|(i, _)| i)
    }

    /// Computes the second difference of each factor's cost.
    fn probe(&mut self, steps: &[f64]) -> Probe {
        let model = &mut self.problem.model;
        let (mut here, mut ahead, mut behind) = (vec![], vec![], vec![]);
        model.factor_costs(&mut here);
        model.factor_costs_beside(steps, &mut ahead);
        let back: Vec<f64> = steps.iter().map(|x| -x).collect();
        model.factor_costs_beside(&back, &mut behind);
        let mut is_inactive = vec![false; here.len()];
        if self.at.inactive > 0 {
            model.batches.iter().for_each(|batch| batch.inactive(&mut |factor| is_inactive[factor] = true));
        }
        let mut probe = Probe { bent: vec![false; steps.len()], is_singular: false };
        let weights = model.weights();
        for (i, place) in model.factors.iter().enumerate() {
            if weights.get(i) == Some(&0.0) {
                continue;
            }
            let (ahead, behind, here) = (ahead[i], behind[i], here[i]);
            probe.is_singular |= is_inactive[i] && ahead > 0.0 && behind > 0.0;
            if is_inactive[i] || ahead + behind - 2.0 * here > -ROUNDING_SHARE * (ahead + behind + here) {
                continue;
            }
            for variable in &place.variables {
                let variable = &model.variables[*variable as usize];
                variable.unknowns().flatten().for_each(|unknown| probe.bent[unknown] = true);
            }
        }
        probe
    }

    /// Returns a direction of negative curvature, if there is one. Uses the Lanczos method in the metric of
    /// JᵀJ, in which all curvatures of a good minimum are close to one. Begins at the unknowns of factors
    /// with negative curvature.
    fn negative_curvature(&mut self, steps: &[f64], bent: &[bool]) -> Option<Vec<f64>> {
        let largest = self.problem.system.largest();
        let floor = if largest > 0.0 { DIAGONAL_FLOOR * largest } else { 1.0 };
        let scale: Vec<f64> = self.problem.system.diagonal().map(|d| d.max(floor)).collect();
        let shift =
            DIAGONAL_SHIFTS.into_iter().map(|share| scale.iter().map(|d| share * d).collect::<Vec<f64>>());
        let shift =
            shift.into_iter().find(|shift| self.problem.system.factorize_directly(Some(shift)).is_ok())?;
        self.is_refactorized = true;
        let found = self.lanczos(steps, bent, &shift);
        tracing::debug!(is_found = found.is_some(), "looked for negative curvature");
        self.at = self.problem.linearize();
        found
    }

    /// Runs the Lanczos method, with JᵀJ + `shift` factorized. Leaves the problem linearized at a different
    /// point.
    fn lanczos(&mut self, steps: &[f64], bent: &[bool], shift: &[f64]) -> Option<Vec<f64>> {
        let gradient = self.problem.system.g.clone();
        let metric = self.problem.system.h.clone();
        let weighed = |system: &crate::linear::system::LinearSystem, x: &[f64]| {
            let mut y: Vec<f64> = x.iter().zip(shift).map(|(x, s)| x * s).collect();
            system.layout.multiply_add(&metric, x, &mut y);
            y
        };
        let mut next: Vec<f64> =
            steps.iter().zip(bent).map(|(x, bent)| if *bent { *x } else { 0.0 }).collect();
        // basis vectors, and their products with the metric and with the Hessian
        let (mut basis, mut images): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (vec![], vec![]);
        let mut products: Vec<Vec<f64>> = vec![];
        let mut found = None;
        while basis.len() < MAX_PRODUCTS.min(steps.len()) {
            // orthogonalizing twice is enough (Parlett)
            for (vector, image) in basis.iter().zip(&images).chain(basis.iter().zip(&images)) {
                let along = dot(&next, image);
                next.iter_mut().zip(vector).for_each(|(x, v)| *x -= along * v);
            }
            let mut image = weighed(&self.problem.system, &next);
            let length = dot(&image, &next).sqrt();
            if !(length > 0.0 && length.is_finite()) {
                break;
            }
            next.iter_mut().chain(&mut image).for_each(|x| *x /= length);
            let Some(product) = self.hessian_product(&next, steps, &gradient) else { break };
            basis.push(next);
            images.push(image);
            next = product.clone();
            products.push(product);
            let projected = DMatrix::from_fn(basis.len(), basis.len(), |i, j| {
                0.5 * (dot(&basis[i], &products[j]) + dot(&basis[j], &products[i]))
            });
            let eigen = projected.symmetric_eigen();
            let least = eigen.eigenvalues.imin();
            tracing::debug!(products = products.len(), least = eigen.eigenvalues[least], "curvature");
            if eigen.eigenvalues[least] < 0.0 {
                // no early exit: a better direction allows a longer descent along it
                let mut direction = vec![0.0; steps.len()];
                for (vector, share) in basis.iter().zip(eigen.eigenvectors.column(least).iter()) {
                    direction.iter_mut().zip(vector).for_each(|(d, v)| *d += share * v);
                }
                found = Some(direction);
            } else if basis.len() > 2 && eigen.eigenvalues[least] > MIN_CURVATURE {
                break;
            }
            match self.problem.system.cholesky() {
                Some(cholesky) => cholesky.solve(&mut next),
                None => break,
            }
        }
        found
    }

    /// Returns the product of the cost's Hessian and a direction, by a difference of gradients; `None` if
    /// that is not finite.
    fn hessian_product(&mut self, direction: &[f64], steps: &[f64], gradient: &[f64]) -> Option<Vec<f64>> {
        let share = shortest(direction, steps)?;
        let step: Vec<f64> = direction.iter().map(|d| DIFFERENCE_SHARE * share * d).collect();
        self.problem.retract(&step);
        self.problem.model.accept();
        let there = self.problem.linearize_keeping_factor();
        let mut product: Vec<f64> = self.problem.system.g.iter().zip(gradient).map(|(a, b)| a - b).collect();
        self.problem.model.accept();
        product.iter_mut().for_each(|x| *x /= DIFFERENCE_SHARE * share);
        self.problem.system.held.iter().for_each(|i| product[*i] = 0.0);
        (there.not_finite.is_none() && norm(&product).is_finite()).then_some(product)
    }

    /// Moves along a direction, forward or backward, as long as the cost falls. Returns whether it falls by
    /// more than the tolerance.
    fn descend_along(&mut self, direction: &[f64]) -> bool {
        let steps = self.probe_steps();
        let Some(share) = shortest(direction, &steps) else { return false };
        let enough = self.at.cost * (1.0 - self.stop.relative_cost().max(ROUNDING_SHARE));
        let mut best: Option<(f64, f64)> = None;
        for sign in [1.0, -1.0] {
            let mut size = sign * share;
            let mut before = self.at.cost;
            while let Some(cost) = self.cost_beside(direction, size).filter(|cost| *cost < before) {
                if cost < enough && best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, size));
                }
                (before, size) = (cost, 2.0 * size);
            }
        }
        let Some((cost, size)) = best else { return false };
        let step: Vec<f64> = direction.iter().map(|d| size * d).collect();
        tracing::debug!(cost, "left a stationary point that is no minimum");
        self.move_by(&step);
        self.at.not_finite.is_none()
    }

    /// Returns the cost next to the estimate, if all active factors are defined and finite there.
    fn cost_beside(&mut self, direction: &[f64], size: f64) -> Option<f64> {
        let step: Vec<f64> = direction.iter().map(|d| size * d).collect();
        let there = self.problem.try_step(&step);
        (there.became_undefined == 0 && there.not_finite.is_none() && there.cost.is_finite())
            .then_some(there.cost)
    }

    fn move_by(&mut self, step: &[f64]) {
        self.problem.retract(step);
        self.problem.model.accept();
        self.at = self.problem.linearize();
        self.trial = self.at;
    }
}

/// Returns the largest multiple of a direction for which no unknown moves by more than its step.
fn shortest(direction: &[f64], steps: &[f64]) -> Option<f64> {
    let moving = direction.iter().zip(steps).filter(|(d, s)| **d != 0.0 && **s != 0.0);
    let share = moving.map(|(d, s)| (s / d).abs()).fold(f64::INFINITY, f64::min);
    (share.is_finite() && share > 0.0).then_some(share)
}
