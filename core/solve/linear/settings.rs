//! How the linear system of each step is solved, as a config says it.
use manifactor_graph::Key;
use manifactor_graph::checked::NotNegative;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the linear system of each step is solved.
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
    /// The order of elimination.
    pub ordering: Ordering,
    /// Most steps of iterative refinement after each solve, by Cholesky: each brings the residual of a badly
    /// conditioned system down, for the time of a solve. They end once a correction is more than half of the one
    /// before: what is left is rounding.
    pub refinements: usize,
    /// When conjugate gradients stop, and what they are preconditioned by.
    pub conjugate_gradients: ConjugateGradients,
    /// Most memory that the factor may take, in GiB; what the system has available, where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_gib: Option<NotNegative>,
}

/// A way to solve (H + damping) δ = -g.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Cholesky; conjugate gradients where its factor does not fit into memory.
    #[default]
    Auto,
    /// The supernodal sparse Cholesky factorization of H.
    Cholesky,
    /// The Cholesky factorization of H as one dense matrix.
    Dense,
    /// The sparse QR factorization of J: where H, whose condition is the square of J's, is too close to singular. Several
    /// times slower than Cholesky.
    Qr,
    /// Conjugate gradients, for problems whose factor does not fit into memory: preconditioned by the diagonal blocks of
    /// H, or of its Schur complement where variables of one type are eliminated first (Schur-Jacobi): those that
    /// `ordering = { first = … }` names, or else those of the uncoupled type that leaves the smallest system.
    ConjugateGradients,
}

/// When to stop iterating, and how to precondition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConjugateGradients {
    /// What the preconditioner knows.
    pub preconditioner: Preconditioner,
    /// Stop once the residual is this share of the right-hand side, in the preconditioner's norm.
    pub tolerance: NotNegative,
    /// Most iterations; the step is then the best found, which lowers the quadratic model all the same.
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

/// What conjugate gradients are preconditioned by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preconditioner {
    /// The diagonal blocks of H.
    BlockJacobi,
    /// Those of the Schur complement; of H where no type of variables can be eliminated.
    #[default]
    SchurJacobi,
}

/// The order in which variables are eliminated. Fill, memory and time of a factorization follow from it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ordering {
    /// The one of the least predicted work, of minimum degree with several ways to break ties and, for large graphs,
    /// nested dissection.
    #[default]
    Auto,
    /// That of the values.
    Natural,
    /// Approximate minimum degree.
    Amd,
    /// Column approximate minimum degree.
    Colamd,
    /// Nested dissection by multilevel vertex separators.
    NestedDissection,
    /// Variables of these types first, then the others, each by minimum degree: the Schur complement of the others.
    First(Vec<String>),
    /// These variables first, as listed; then the others, by minimum degree.
    Given(Vec<Key>),
}
