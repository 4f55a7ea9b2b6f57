//! Settings of the linear solver, as written in a config.
use manifactor_graph::Key;
use manifactor_graph::checked::NotNegative;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Solver of the linear system of each step.
///
/// ```toml
/// linear = { method = "cholesky", ordering = "nested_dissection", refinements = 1 }
/// linear = { method = "conjugate_gradients", ordering = { first = ["point3"] }, memory_gib = 8.0 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LinearSolver {
    /// The method.
    pub method: Method,
    /// The elimination order.
    pub ordering: Ordering,
    /// Maximum number of steps of iterative refinement after each solve, for Cholesky. Each step reduces
    /// the residual of a badly conditioned system, and takes the time of a solve. Refinement stops if a
    /// correction is more than half of the previous one, as rounding then dominates.
    pub refinements: usize,
    /// Stopping criteria and preconditioner of conjugate gradients.
    pub conjugate_gradients: ConjugateGradients,
    /// Maximum memory of the factor, in GiB. Default: the available memory of the system.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_gib: Option<NotNegative>,
}

/// A method to solve (H + damping) δ = -g.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Cholesky; conjugate gradients if its factor does not fit into memory.
    #[default]
    Auto,
    /// The supernodal sparse Cholesky factorization of H.
    Cholesky,
    /// The Cholesky factorization of H as one dense matrix.
    Dense,
    /// The sparse QR factorization of J, for problems with a nearly singular H, since the condition number
    /// of H is the square of J's. Several times slower than Cholesky.
    Qr,
    /// Conjugate gradients, for problems whose factor does not fit into memory. The preconditioner uses the
    /// diagonal blocks of H, or of its Schur complement if variables of one type are eliminated first
    /// (Schur-Jacobi). These are the variables in `ordering = { first = … }`, or else of the uncoupled type
    /// that leaves the smallest system.
    ConjugateGradients,
}

/// Stopping criteria and preconditioner of conjugate gradients.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConjugateGradients {
    /// The preconditioner.
    pub preconditioner: Preconditioner,
    /// Stop once the residual is this share of the right-hand side, in the preconditioner's norm.
    pub tolerance: NotNegative,
    /// Maximum number of iterations. The step is then the best one so far, which still lowers the quadratic
    /// model.
    pub max_iterations: usize,
}

impl Default for ConjugateGradients {
    fn default() -> Self {
        Self {
            preconditioner: Preconditioner::default(),
            tolerance: NotNegative::literal(1e-6),
            max_iterations: 1000,
        }
    }
}

/// A preconditioner of conjugate gradients.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preconditioner {
    /// The diagonal blocks of H.
    BlockJacobi,
    /// The diagonal blocks of the Schur complement; of H if no type of variables can be eliminated.
    #[default]
    SchurJacobi,
}

/// Elimination order of the variables. It determines fill, memory and time of a factorization.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ordering {
    /// The order with the least predicted work: minimum degree with several tie-breaking rules, and for
    /// large graphs nested dissection.
    #[default]
    Auto,
    /// The order of the values.
    Natural,
    /// Approximate minimum degree.
    Amd,
    /// Column approximate minimum degree.
    Colamd,
    /// Nested dissection by multilevel vertex separators.
    NestedDissection,
    /// Variables of these types first, then the remaining ones, each group by minimum degree. Forms the
    /// Schur complement on the remaining variables.
    First(Vec<String>),
    /// These variables first, as listed; then the remaining ones, by minimum degree.
    Given(Vec<Key>),
}
