//! Graduated non-convexity: classifies factors as outliers or inliers without prior knowledge.
use crate::Solution;
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::problem::CompileError;
use crate::problem::{Problem, ProblemFactor};
use crate::strategy::auto::Auto;
use crate::strategy::optimizer::Optimizer;
use graduation::Graduation;
use manifactor_graph::checked::Positive;
use manifactor_graph::{Factor, Graph, TypeName, Values, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

mod candidates;
mod graduation;
mod parameters;
mod surrogate;

pub use candidates::Candidates;
pub use parameters::{Growth, Probability};
pub use surrogate::Truncation;

/// Rejects outliers: solves with all factors, then with decreasing weights on factors that do not fit.
///
/// Yang, Antonante, Tzoumas, Carlone, *Graduated Non-Convexity for Robust Spatial Perception*, RA-L 2020.
/// Each candidate i costs c²ρ_μ(‖rᵢ‖²/c²), with the inlier bound c². μ leads from a convex ρ_μ to a
/// truncated one. For each μ the weighted problem is solved from the last estimate and from the best
/// registered start for the weighted graph. The better of the two results is kept. At the end, solves with
/// fewer and with more factors than the inliers are tried, as long as they lower the robust cost.
///
/// Candidates are loop closures: factors that couple variables, except the only factor between two
/// consecutive variables. A factor's own loss stays; its cost replaces ‖r‖². The outcome lists the rejected
/// factors. Its costs belong to the weighted problem: the initial cost with all factors, the final cost
/// with the remaining ones.
///
/// ```toml
/// solver = { type = "gnc", probability = 0.99, types = ["between_se2"], solver = { type = "dogleg" } }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Gnc {
    /// The robust cost.
    pub cost: Truncation,
    /// Share of the inliers to keep: c² is the χ² quantile for the rows of each factor.
    pub probability: Probability,
    /// c in standard deviations, for all factors, instead of `probability`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Positive>,
    /// The factors that may be outliers.
    pub candidates: Candidates,
    /// Restricts the candidates to these factor types. Default: no restriction.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub types: Vec<TypeName<dyn Factor>>,
    /// Factors that are always trusted, by index in the graph, from 0.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inliers: Vec<usize>,
    /// Factor between consecutive values of μ; 1.4 in the paper.
    pub step: Growth,
    /// Solver for the final weights.
    pub solver: Arc<dyn Optimizer>,
}

impl Default for Gnc {
    fn default() -> Self {
        Self {
            cost: Truncation::default(),
            probability: Probability::default(),
            threshold: None,
            candidates: Candidates::default(),
            types: vec![],
            inliers: vec![],
            step: Growth::default(),
            solver: Arc::new(Auto::default()),
        }
    }
}

#[typetag::serialize(name = "gnc")]
impl Optimizer for Gnc {
    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        Graduation::new(self, problem, None, observer).run()
    }

    fn linear(&self) -> LinearSolver {
        self.solver.linear()
    }

    fn solve(
        &self,
        graph: &Graph,
        values: &Values,
        observer: &mut dyn Observer,
    ) -> Result<Solution, CompileError> {
        let factors = graph.factors().len();
        if let Some(factor) = self.inliers.iter().copied().find(|i| *i >= factors) {
            return Err(CompileError::NoFactor { factor, factors });
        }
        let mut problem = Problem::compile_for(graph, values, &self.linear())?;
        let outcome = Graduation::new(self, &mut problem, Some(graph), observer).run();
        Ok(Solution::of(problem, outcome))
    }
}
register!(dyn Optimizer, "gnc", Gnc);

impl Gnc {
    /// Returns the inlier bound ½c² of each factor; `None` for trusted factors.
    fn bounds(&self, problem: &Problem) -> Vec<Option<f64>> {
        let named = |name: &str| self.types.is_empty() || self.types.iter().any(|t| t.as_str() == name);
        let mut may = self.candidates.of(problem);
        for inlier in &self.inliers {
            may.get_mut(*inlier).into_iter().for_each(|may| *may = false);
        }
        let mut quantiles: Vec<Option<f64>> = vec![];
        let mut bound = |rows: usize| {
            let square = self.threshold.map(|c| c.get().powi(2));
            quantiles.resize(quantiles.len().max(rows + 1), None);
            *quantiles[rows]
                .get_or_insert_with(|| 0.5 * square.unwrap_or_else(|| self.probability.chi_squared(rows)))
        };
        let one = |(may, factor): (bool, &ProblemFactor)| {
            let candidate = may && !factor.is_constraint && named(factor.name) && factor.rows > 0;
            candidate.then(|| bound(factor.rows as usize))
        };
        may.into_iter().zip(&problem.model.factors).map(one).collect()
    }
}
