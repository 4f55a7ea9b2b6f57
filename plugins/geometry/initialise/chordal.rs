//! Chordal initialisation of pose graphs: rotations by a linear relaxation, then positions.
//!
//! 1. Rotations: min Σ κ ‖R_b - R_a Z‖² over all 3×3 (2×2) matrices. The rows of R are independent, so one
//!    factorization of a sparse matrix with 3×3 blocks serves three right-hand sides.
//! 2. Each matrix is replaced by the closest rotation, from its singular value decomposition.
//! 3. Positions: the full cost ½ Σ rᵀΩr with the rotations held. It is quadratic, as the logarithm of a pose
//!    is linear in the translation, and needs one more factorization.
//!
//! Martinec and Pajdla, *Robust rotation and translation estimation in multiview reconstruction*, CVPR 2007;
//! Carlone, Tron, Daniilidis and Dellaert, *Initialization techniques for 3D SLAM*, ICRA 2015.
use super::loops::is_wound;
use super::network::{Edge, Information, Network};
use super::pose::Pose;
use super::relaxation::{Relaxation, Term};
use super::start::place_points;
use super::{Tree, spanning_tree};
use crate::{Between, Prior, Se2, Se3, So2, So3};
use manifactor_graph::{Factor, Graph, ValueError, Values, Variable, register};
use manifactor_solve::{BlockSystemError, Start, StartError};
use nalgebra::{SMatrix, SVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rotations from a linear relaxation of all relative measurements at once, then positions.
///
/// Uses between factors and priors of rotations and poses, with any noise; robust losses are ignored. The
/// rotation of a measurement is weighted by the mean variance of its three angles, independent of the
/// translation. The positions then minimize the full cost with the rotations held. Held variables keep their
/// values. A connected part without a held variable or prior keeps its first pose. Points are placed from
/// their first measurement; other variables keep their values.
///
/// The result is close to the optimum if rotations are measured well, independent of the given values. This
/// start also marks a minimum as doubtful if the rotations along some loop add up to extra turns.
///
/// ```toml
/// start = { type = "chordal" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Chordal {}

const NAME: &str = "chordal";

#[typetag::serialize(name = "chordal")]
impl Start for Chordal {
    fn start(&self, graph: &Graph, values: &Values) -> Result<Values, StartError> {
        match relax_all(graph, values) {
            // A graph without values: a spanning tree gives each part the anchor that the relaxation needs.
            Err(StartError::Value(ValueError::Missing { .. })) => {
                relax_all(graph, &spanning_tree(graph, values, Tree::Shallow)?)
            }
            done => done,
        }
    }

    fn doubts(&self, graph: &Graph, minimum: &Values) -> bool {
        is_wound(graph, minimum)
    }
}
register!(dyn Start, "chordal", Chordal);

fn relax_all(graph: &Graph, values: &Values) -> Result<Values, StartError> {
    let mut found = NewValues::default();
    found.resize_with(values.len(), || None);
    let applies = [
        relax::<So2, 2>(graph, values, &mut found)?,
        relax::<So3, 3>(graph, values, &mut found)?,
        relax::<Se2, 2>(graph, values, &mut found)?,
        relax::<Se3, 3>(graph, values, &mut found)?,
    ];
    if !applies.contains(&true) {
        let needs = "between factors of rotations or poses (so2, so3, se2, se3)";
        return Err(StartError::NotApplicable { start: NAME, needs });
    }
    let mut started = Values::new();
    for ((key, value), found) in values.iter().zip(found) {
        started.insert_boxed(key.clone(), found.unwrap_or_else(|| value.erased().clone_box()));
    }
    place_points(graph, &mut started);
    Ok(started)
}

/// New values, by index among the values.
type NewValues = Vec<Option<Box<dyn Variable>>>;

/// Computes the poses of one type from the measurements between them; false if there is none.
fn relax<P: Pose<D>, const D: usize>(
    graph: &Graph,
    values: &Values,
    found: &mut NewValues,
) -> Result<bool, StartError>
where
    Between<P>: Factor,
    Prior<P>: Factor,
{
    let Some(net) = Network::<P, D>::of(graph, values)? else { return Ok(false) };
    let failed = |what| {
        let (variables, first) = (net.places.len(), net.places.first().copied().unwrap_or(0));
        let key = values.iter().nth(first).map_or_else(|| "".into(), |(key, _)| key.clone());
        move |error| match error {
            BlockSystemError::NotPositiveDefinite => StartError::Open { start: NAME, what, key, variables },
            other => StartError::System(other),
        }
    };
    let anchored = net.anchored(|e| e.information.chordal_weight() > 0.0);
    let mut relaxation = Relaxation::new(&net.edges, anchored)?;
    let rotations = rotations(&net, &mut relaxation).map_err(failed("rotations"))?;
    let mut translations: Vec<_> = net.poses.iter().map(Pose::translation).collect();
    if P::FIRST_TRANSLATION.is_some() {
        let anchored = net.anchored(|e| e.information.shift.iter().any(|x| *x != 0.0));
        if !relaxation.fits(&anchored) {
            relaxation = Relaxation::new(&net.edges, anchored)?;
        }
        relaxation
            .minimize(&net.edges, &mut translations, |e| position_term::<P, D>(e, &rotations))
            .map_err(failed("positions"))?;
    }
    for (i, place) in net.places.iter().enumerate().filter(|(i, _)| !net.held[*i]) {
        if let Some(found) = found.get_mut(*place) {
            *found = Some(Box::new(P::assemble(&rotations[i], &translations[i])));
        }
    }
    Ok(true)
}

fn rotations<P: Pose<D>, const D: usize>(
    net: &Network<P, D>,
    relaxation: &mut Relaxation<D>,
) -> Result<Vec<SMatrix<f64, D, D>>, BlockSystemError> {
    // The rows of R are the columns of x.
    let mut x: Vec<SMatrix<f64, D, D>> = net.poses.iter().map(|p| p.rotation().transpose()).collect();
    relaxation.minimize(&net.edges, &mut x, |e| {
        let kappa = e.information.chordal_weight();
        let w = SMatrix::identity() * kappa;
        (kappa > 0.0).then(|| Term { a: e.rotation, w, g: SMatrix::zeros() })
    })?;
    // A rotation that the measurements leave fully undetermined keeps its value.
    let nearest =
        |(x, pose): (&SMatrix<f64, D, D>, &P)| P::nearest(&x.transpose()).unwrap_or_else(|| pose.rotation());
    Ok(x.iter().zip(&net.poses).map(nearest).collect())
}

/// ½ rᵀΩr as a function of positions: the translational rows of r are B (t_b - t_a - R_a z) with B = V⁻¹(ω)
/// Zᵀ R_aᵀ, the rotational ones ω = Log(Zᵀ R_aᵀ R_b).
fn position_term<P: Pose<D>, const D: usize>(
    edge: &Edge<D>,
    rotations: &[SMatrix<f64, D, D>],
) -> Option<Term<D, 1>> {
    let Information { cross, shift, .. } = &edge.information;
    if shift.iter().all(|x| *x == 0.0) {
        return None;
    }
    let outer_from_b = rotations[edge.a] * edge.rotation;
    let (omega, v_inverse) = P::logarithm(&outer_from_b.tr_mul(&rotations[edge.b]));
    let b = v_inverse * outer_from_b.transpose();
    let w = b.tr_mul(&(shift * b));
    let g: SVector<f64, D> = w * (rotations[edge.a] * edge.translation) - b.tr_mul(&(cross * omega));
    Some(Term { a: SMatrix::identity(), w, g })
}

#[cfg(test)]
#[path = "chordal_tests.rs"]
mod tests;
