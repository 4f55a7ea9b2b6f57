//! Which landmarks a sighting may be of.
use super::hypotheses::{self, Hypothesis};
use super::{Known, Landmarks, Sighting, SightingError};
use crate::session::{Innovation, InnovationError, Linearized, Session};
use manifactor_graph::Key;
use nalgebra::DMatrix;

pub(super) use super::hypotheses::Choice;

/// What the sightings of a pose say.
#[derive(Default)]
pub(super) struct Candidates {
    /// By sighting.
    pub(super) choices: Vec<Choice>,
    /// Landmarks that seem to be one, the older first.
    pub(super) same: Vec<(usize, usize)>,
}

impl Landmarks {
    /// Finds out what sightings are of.
    pub(super) fn candidates(
        &mut self,
        session: &Session,
        pose: &Key,
        seen: &[Sighting],
    ) -> Result<Candidates, SightingError> {
        if seen.is_empty() {
            return Ok(Candidates::default());
        }
        // those that have left with a window
        self.known.retain(|known| session.find(known.key.as_str()).is_some());
        let new = -2.0 * self.settings.density.ln();
        let of_pose = session.covariance(&[pose.as_str()])?;
        let is_there = |known: &Known| session.estimate(known.key.as_str()).is_some();
        let there: Vec<(usize, &Known)> =
            self.known.iter().enumerate().filter(|(_, known)| is_there(known)).collect();
        let (mut options, mut factors) = (vec![], vec![]);
        for (sighting, one) in seen.iter().enumerate() {
            let mut of_one = vec![];
            for (landmark, known) in &there {
                let factor = match session.linearized(0, &one.of(pose, &known.key)) {
                    Ok(factor) => factor,
                    // it cannot be seen from here
                    Err(InnovationError::NotDefined { .. }) => continue,
                    Err(error) => return Err(SightingError::Sighting { sighting, error }),
                };
                let is_parked = factor.variables.iter().any(|v| session.is_parked(*v));
                if !is_parked && least_cost(&factor, &of_pose, known.covariance.as_ref()) < new {
                    of_one.push(Hypothesis { landmark: *landmark, factor: factors.len() });
                    factors.push(factor);
                }
            }
            options.push(of_one);
        }
        let joint = session.joint_of(&factors)?;
        for Hypothesis { landmark, factor } in options.iter().flatten() {
            let covariance = factors[*factor].variables.get(1).map(|v| joint.own(*v));
            self.known[*landmark].covariance = covariance;
        }
        let innovation = Innovation::new(&factors, &joint);
        let odds = 2.0 * self.settings.odds.ln();
        let choices = hypotheses::choose(&innovation, &options, new, odds);
        Ok(Candidates { choices, same: same(&innovation, &options, new - odds) })
    }
}

/// Pairs of landmarks that a sighting may be of both, and which cost less than this to be one.
fn same(innovation: &Innovation, options: &[Vec<Hypothesis>], most: f64) -> Vec<(usize, usize)> {
    let mut same = vec![];
    for of_one in options {
        for (i, a) in of_one.iter().enumerate() {
            let is_one = |b: &&Hypothesis| {
                innovation.apart(a.factor, b.factor).is_some_and(|misfit| misfit.cost() < most)
            };
            same.extend(of_one[i + 1..].iter().filter(is_one).map(|b| (a.landmark, b.landmark)));
        }
    }
    same
}

/// What it costs at least that a sighting alone is of a landmark, whatever the correlation with the pose is: J Σ Jᵀ is at most twice the sum of
/// what pose and landmark alone would make it. Several sightings that are off by one drift may cost less together: this gate does not know.
fn least_cost(factor: &Linearized, of_pose: &DMatrix<f64>, of_landmark: Option<&DMatrix<f64>>) -> f64 {
    let ([by_pose, by_landmark], Some(of_landmark)) = (factor.jacobians.as_slice(), of_landmark) else {
        return f64::NEG_INFINITY;
    };
    let alone = |j: &DMatrix<f64>, sigma: &DMatrix<f64>| j * sigma * j.transpose();
    let s = (alone(by_pose, of_pose) + alone(by_landmark, of_landmark)) * 2.0;
    let s = s + DMatrix::identity(factor.residual.len(), factor.residual.len());
    let squared = s.cholesky().map_or(0.0, |s| factor.residual.dot(&s.solve(&factor.residual)));
    squared + factor.volume
}
