//! A certificate that the minimum of a pose graph is global, after SE-Sync.
//!
//! Rosen, Carlone, Bandeira and Leonard, *SE-Sync: a certifiably correct algorithm for synchronization over the
//! special Euclidean group*, IJRR 2019.
//!
//! The certificate covers the **chordal cost** with isotropic weights, ½ Σ κ ‖R_b - R_a Z‖² + τ ‖t_b - t_a -
//! R_a z‖². Here 1/2κ is the mean variance of the rotation angles and 1/τ the mean variance of the
//! translation coordinates. The chordal cost is first minimized from the estimate, and the certificate is
//! evaluated at that local minimum. If all noise is isotropic, the graph's cost is never below the chordal
//! cost: θ² is not below 4 sin²(θ/2), and the translation of the logarithm is not shorter than the
//! translation. The lower bound then holds for the graph's cost too. With any other noise, the graph's cost
//! has no bound.
use crate::initialise::network::{Edge, Network};
use crate::initialise::parts::ConnectedSets;
use crate::initialise::pose::Pose;
use crate::{Between, ChordalBetween, Prior, Se2, Se3};
use dual::{Dual, Weights};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Factor, Fixed, Graph, Key, Noise, Values};
use manifactor_solve::{
    BlockSystemError, CompileError, GaussNewton, LevenbergMarquardt, Silent, StartError, Stopping, solve,
};
use serde::Serialize;
use std::fmt;

mod dual;
mod lanczos;

/// Result of [`certify`]: a lower bound on a pose graph's chordal cost, and whether the minimum close to the
/// estimate attains it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Certificate {
    /// Whether the minimum close to the estimate is global: S is positive semidefinite, to within 1e-9 of its
    /// diagonal.
    pub certified: bool,
    /// The chordal cost at its local minimum close to the estimate.
    pub chordal_cost: f64,
    /// Lower bound on the chordal cost over all values, up to rounding.
    pub lower_bound: f64,
    /// Upper bound on the difference between `chordal_cost` and the global minimum.
    pub suboptimality: f64,
    /// Smallest eigenvalue of the dual certificate matrix S = Q - Λ, dimensionless: each pose is scaled by
    /// the mean of its diagonal in the data matrix. Zero at a certified minimum, as S has the estimate in its
    /// kernel.
    pub smallest_eigenvalue: f64,
    /// Lower bound on the cost of the graph itself, if all noise is isotropic.
    pub cost_bound: Option<f64>,
}

/// Largest shift of the smallest eigenvalue that counts as rounding.
const ROUNDING_SHIFT: f64 = 1e-9;

/// The reason why a graph has no certificate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CertificateError {
    /// The graph has no between factor of poses.
    #[error("a certificate needs a pose graph: between factors of se2 or se3, priors, and nothing else")]
    NoPoseGraph,
    /// The graph has a factor of an unsupported type.
    #[error(
        "a certificate needs between factors and priors of one type of poses; factor {factor} is a `{name}`"
    )]
    OtherFactor {
        /// Index of the factor in the graph, from 0.
        factor: usize,
        /// Type of the factor.
        name: &'static str,
    },
    /// A factor has a robust loss.
    #[error("a certificate is for squared costs; factor {factor} has a robust loss")]
    RobustLoss {
        /// Index of the factor in the graph, from 0.
        factor: usize,
    },
    /// A factor leaves some direction of a relative pose unmeasured.
    #[error("a certificate needs relative poses; factor {factor} leaves a rotation or a translation open")]
    NotMeasured {
        /// Index of the factor in the graph, from 0.
        factor: usize,
    },
    /// More variables are held than needed to fix the gauge.
    #[error(
        "a certificate needs a pose graph that is held by one pose or by priors in each connected part; more than \
         that, or directions alone, is held around `{key}`"
    )]
    Held {
        /// One of the variables.
        key: Key,
    },
    /// No shift makes the certificate matrix positive definite: its entries are too uneven for f64.
    #[error("the certificate matrix is too badly conditioned for f64")]
    Conditioning,
    /// The graph does not fit its values.
    #[error(transparent)]
    Graph(#[from] StartError),
    /// The graph of chordal factors does not compile.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// A computed weight is not a valid noise.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The certificate matrix does not fit into memory.
    #[error(transparent)]
    System(#[from] BlockSystemError),
}

/// Certifies the minimum of a pose graph close to an estimate.
///
/// # Errors
/// If the graph has factors other than between factors and priors of one pose type, or a robust loss.
pub fn certify(graph: &Graph, values: &Values) -> Result<Certificate, CertificateError> {
    if let Some(factor) = graph.factors().iter().position(|f| f.loss.is_some()) {
        return Err(CertificateError::RobustLoss { factor });
    }
    let certificate = match certify_type::<Se3, 3>(graph, values)? {
        None => certify_type::<Se2, 2>(graph, values)?,
        found => found,
    };
    certificate.ok_or(CertificateError::NoPoseGraph)
}

fn certify_type<P: Pose<D>, const D: usize>(
    graph: &Graph,
    values: &Values,
) -> Result<Option<Certificate>, CertificateError>
where
    Between<P>: Factor,
    Prior<P>: Factor,
    ChordalBetween<P>: Factor,
{
    let Some(net) = Network::<P, D>::of(graph, values)? else { return Ok(None) };
    if net.edges.len() < graph.factors().len() {
        let mut known = net.edges.iter().map(|e| e.factor);
        let other = (0..).zip(graph.factors()).find(|(i, _)| known.next() != Some(*i));
        let (factor, name) = other.map_or((0, ""), |(i, entry)| (i, entry.factor.typetag_name()));
        return Err(CertificateError::OtherFactor { factor, name });
    }
    check_fixed(&net, graph, values)?;
    let mut isotropic = true;
    let mut edges = vec![];
    for edge in &net.edges {
        let weights =
            Weights { kappa: edge.information.chordal_weight(), tau: edge.information.shift_weight() };
        if !(weights.kappa > 0.0 && weights.tau > 0.0) {
            return Err(CertificateError::NotMeasured { factor: edge.factor });
        }
        isotropic &= edge.information.is_isotropic();
        edges.push((edge, weights));
    }
    let anchored = net.anchored(|_| true);
    let poses = minimum(&net, &edges, &anchored)?;
    let rotations: Vec<_> = poses.iter().map(Pose::rotation).collect();
    let translations: Vec<_> = poses.iter().map(Pose::translation).collect();
    let mut dual = Dual::new(&edges, &rotations, &translations, &anchored)?;
    let (smallest_eigenvalue, shift) = dual.smallest_eigenvalue().ok_or(CertificateError::Conditioning)?;
    let lower_bound = dual.lower_bound(shift).max(0.0);
    Ok(Some(Certificate {
        certified: shift <= ROUNDING_SHIFT,
        chordal_cost: dual.cost,
        lower_bound,
        suboptimality: (dual.cost - lower_bound).max(0.0),
        smallest_eigenvalue,
        cost_bound: isotropic.then_some(lower_bound),
    }))
}

/// Checks that the graph holds no more than the gauge of each connected part.
fn check_fixed<P: Pose<D>, const D: usize>(
    net: &Network<P, D>,
    graph: &Graph,
    values: &Values,
) -> Result<(), CertificateError> {
    let partly = graph.fixed().iter().find(|(_, fixed)| matches!(fixed, Fixed::Directions(_)));
    if let Some((key, _)) = partly {
        return Err(CertificateError::Held { key: key.clone() });
    }
    let n = net.poses.len();
    let mut parts = ConnectedSets::new(n);
    net.edges.iter().for_each(|e| parts.join(e.a, e.b));
    let mut part_is_held = vec![false; n];
    for i in (0..n).filter(|i| net.held[*i]) {
        if std::mem::replace(&mut part_is_held[parts.root(i)], true) {
            // At least one of the two is a pose, as the outer frame is the last node.
            let first =
                net.places.iter().enumerate().find(|(k, _)| net.held[*k] && parts.root(*k) == parts.root(i));
            let key = first.and_then(|(_, place)| values.iter().nth(*place));
            return Err(CertificateError::Held {
                key: key.map_or_else(|| "".into(), |(key, _)| key.clone()),
            });
        }
    }
    Ok(())
}

/// Minimizes the chordal cost, beginning at the poses of the network.
fn minimum<P: Pose<D>, const D: usize>(
    net: &Network<P, D>,
    edges: &[(&Edge<D>, Weights)],
    anchored: &[bool],
) -> Result<Vec<P>, CertificateError>
where
    ChordalBetween<P>: Factor,
{
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let keys: Vec<Key> = (0..net.poses.len()).map(|i| Key::indexed("", i)).collect();
    for (i, key) in keys.iter().enumerate() {
        values.insert(key.clone(), net.poses[i]);
        if anchored[i] {
            graph.fix(key);
        }
    }
    for (edge, Weights { kappa, tau }) in edges {
        let relative = P::assemble(&edge.rotation, &edge.translation);
        let mut sigmas = vec![1.0 / (2.0 * kappa).sqrt(); D * D];
        sigmas.extend([1.0 / tau.sqrt(); D]);
        graph.add([&keys[edge.a], &keys[edge.b]], ChordalBetween { relative }).noise(Noise::sigmas(&sigmas)?);
    }
    if anchored.iter().all(|anchored| *anchored) {
        return Ok(net.poses.clone());
    }
    let stop = |share, max_iterations| Stopping {
        relative_cost: Some(share),
        max_iterations,
        ..Stopping::default()
    };
    let near =
        LevenbergMarquardt { stop: stop(NotNegative::literal(1e-9), 100), ..LevenbergMarquardt::default() };
    let near = solve(&graph, &values, &near, &mut Silent)?.values;
    // Solve to full accuracy: the certificate matrix is only as close to singular as the gradient is to zero.
    let exact = solve(
        &graph,
        &near,
        &GaussNewton { stop: stop(NotNegative::literal(1e-12), 30), ..Default::default() },
        &mut Silent,
    )?
    .values;
    let pose = |(key, start): (&Key, &P)| exact.get::<P>(key).map_or(*start, |pose| *pose);
    Ok(keys.iter().zip(&net.poses).map(pose).collect())
}

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { chordal_cost, lower_bound, suboptimality, smallest_eigenvalue, .. } = self;
        let what = match self.certified {
            true => {
                "certified: this is the basin of the global minimum of the chordal cost, isotropic weights"
            }
            false => "not certified: the chordal cost, isotropic weights, may have a lower minimum elsewhere",
        };
        writeln!(f, "{what}")?;
        write!(
            f,
            "chordal cost {chordal_cost:.9}, nowhere below {lower_bound:.9} (by {suboptimality:.3e} at most); \
             smallest eigenvalue of the certificate matrix {smallest_eigenvalue:.3e}"
        )?;
        match self.cost_bound {
            Some(bound) => {
                write!(f, "\nall noise is isotropic: the graph's own cost is nowhere below {bound:.9}")
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
#[path = "certificate/tests.rs"]
mod tests;
