//! Poses of one type and the relative measurements between them, in the form that linear methods need.
use super::as_factor;
use super::parts::ConnectedSets;
use super::pose::Pose;
use crate::{Between, Prior};
use manifactor_graph::{Factor, Fixed, Graph, Key, Values};
use manifactor_solve::StartError;
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector};

/// A graph whose nodes are the poses, indexed among the values of their type.
///
/// The last node is the outer frame, the reference of priors. It is held, as are fixed poses. A
/// connected part without a held node is anchored at one pose.
pub(crate) struct Network<P, const D: usize> {
    pub poses: Vec<P>,
    /// Index of each node among the values; the outer frame has none.
    pub places: Vec<usize>,
    /// Nodes held by the graph, wholly or in part, and the outer frame.
    pub held: Vec<bool>,
    pub edges: Vec<Edge<D>>,
}

/// A measurement of pose `b` from pose `a`.
pub(crate) struct Edge<const D: usize> {
    pub a: usize,
    pub b: usize,
    /// Index of the factor in the graph.
    pub factor: usize,
    pub rotation: SMatrix<f64, D, D>,
    pub translation: SVector<f64, D>,
    pub information: Information<D>,
}

/// Blocks of the information matrix Ω. Rotations are about x, y and z; in the plane only z is nonzero.
pub(crate) struct Information<const D: usize> {
    pub turn: Matrix3<f64>,
    pub cross: SMatrix<f64, D, 3>,
    pub shift: SMatrix<f64, D, D>,
}

impl<const D: usize> Information<D> {
    fn of<P: Pose<D>>(m: &DMatrix<f64>) -> Self {
        let entry = |r: Option<usize>, c: Option<usize>| r.zip(c).map_or(0.0, |at| m[at]);
        let shift = |k: usize| P::FIRST_TRANSLATION.map(|first| first + k);
        Self {
            turn: Matrix3::from_fn(|r, c| entry(P::ROTATION_DIRECTIONS[r], P::ROTATION_DIRECTIONS[c])),
            cross: SMatrix::from_fn(|r, c| entry(shift(r), P::ROTATION_DIRECTIONS[c])),
            shift: SMatrix::from_fn(|r, c| entry(shift(r), shift(c))),
        }
    }

    /// Returns κ: half the inverse of the mean variance about the axes, marginalized over the translation.
    /// Zero if some axis is not measured. For a small angle θ, ‖R - I‖² is 2θ².
    pub(crate) fn chordal_weight(&self) -> f64 {
        let Self { turn, cross, shift } = self;
        let coupled = cross.iter().any(|x| *x != 0.0);
        let marginal = match shift.try_inverse() {
            Some(inverse) if coupled => turn - cross.tr_mul(&(inverse * cross)),
            _ => *turn,
        };
        let variance = match D {
            2 => 1.0 / marginal[(2, 2)],
            _ => marginal.try_inverse().map_or(f64::INFINITY, |m: Matrix3<f64>| m.trace() / 3.0),
        };
        above_zero(0.5 / variance)
    }

    /// Returns τ: the inverse of the mean variance along the axes, marginalized over the rotation. Zero if
    /// some axis is not measured.
    pub(crate) fn shift_weight(&self) -> f64 {
        let Self { turn, cross, shift } = self;
        let mut turn = *turn;
        // Rotation axes that do not exist in the plane.
        for i in 0..3 {
            if turn[(i, i)] == 0.0 {
                turn[(i, i)] = 1.0;
            }
        }
        let marginal =
            turn.try_inverse().map_or(*shift, |inverse| shift - cross * inverse * cross.transpose());
        above_zero(marginal.try_inverse().map_or(0.0, |m| D as f64 / m.trace()))
    }

    /// Returns whether rotation and translation are uncorrelated and each equally uncertain along all axes.
    pub(crate) fn is_isotropic(&self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        let turns = if D == 2 { 2..3 } else { 0..3 };
        let even = turns.clone().all(|i| near(self.turn[(i, i)], self.turn[(2, 2)]))
            && (0..D).all(|i| near(self.shift[(i, i)], self.shift[(0, 0)]));
        let apart = |r: usize, c: usize| r == c || (self.turn[(r, c)] == 0.0);
        let alone = |r: usize, c: usize| r == c || (self.shift[(r, c)] == 0.0);
        even && self.cross.iter().all(|x| *x == 0.0)
            && turns.clone().all(|r| turns.clone().all(|c| apart(r, c)))
            && (0..D).all(|r| (0..D).all(|c| alone(r, c)))
    }
}

fn above_zero(weight: f64) -> f64 {
    if weight.is_finite() { weight.max(0.0) } else { 0.0 }
}

impl<P: Pose<D>, const D: usize> Network<P, D>
where
    Between<P>: Factor,
    Prior<P>: Factor,
{
    /// Builds the network; `None` if the graph has no between factor of this type.
    pub(crate) fn of(graph: &Graph, values: &Values) -> Result<Option<Self>, StartError> {
        if !graph.factors().iter().any(|entry| as_factor::<Between<P>, 2>(entry).is_some()) {
            return Ok(None);
        }
        let mut net = Self { poses: vec![], places: vec![], held: vec![], edges: vec![] };
        // Node of each value, by its index.
        let mut nodes = vec![usize::MAX; values.len()];
        for (place, (_, value)) in values.iter().enumerate() {
            if let Some(pose) = value.erased().as_any().downcast_ref::<P>() {
                nodes[place] = net.poses.len();
                net.poses.push(*pose);
                net.places.push(place);
            }
        }
        let outer = net.poses.len();
        net.poses.push(P::identity());
        net.held = vec![false; outer + 1];
        net.held[outer] = true;
        let node = |key: &Key| match values.position(key.as_str()).map(|place| nodes[place]) {
            Some(node) if node != usize::MAX => Ok(node),
            // The lookup returns the error.
            _ => values.get::<P>(key).map(|_| usize::MAX).map_err(StartError::from),
        };
        for (key, fixed) in graph.fixed() {
            if let (Ok(node), true) = (node(key), *fixed != Fixed::Whole(false)) {
                net.held[node] = true;
            }
        }
        for (i, entry) in graph.factors().iter().enumerate() {
            let (a, b, relative) = if let Some((between, [a, b])) = as_factor::<Between<P>, 2>(entry) {
                (node(a)?, node(b)?, &between.relative)
            } else if let Some((prior, [x])) = as_factor::<Prior<P>, 1>(entry) {
                (outer, node(x)?, &prior.value)
            } else {
                continue;
            };
            let rows = P::TANGENT.len();
            let information = entry.noise.information_matrix(rows);
            let information = information.map_err(|source| StartError::Noise { factor: i, source })?;
            net.edges.push(Edge {
                a,
                b,
                factor: i,
                rotation: relative.rotation(),
                translation: relative.translation(),
                information: Information::of::<P>(&information),
            });
        }
        Ok(Some(net))
    }

    /// Returns the nodes that stay fixed if only the selected edges count: the held nodes, and the first node
    /// of each connected part without a held one.
    pub(crate) fn anchored(&self, counts: impl Fn(&Edge<D>) -> bool) -> Vec<bool> {
        let n = self.poses.len();
        let mut parts = ConnectedSets::new(n);
        self.edges.iter().filter(|e| counts(e)).for_each(|e| parts.join(e.a, e.b));
        let mut part_is_held = vec![false; n];
        (0..n).filter(|i| self.held[*i]).for_each(|i| part_is_held[parts.root(i)] = true);
        let mut anchored = self.held.clone();
        // A root is the first node of its part.
        (0..n).filter(|i| parts.root(*i) == *i && !part_is_held[*i]).for_each(|i| anchored[i] = true);
        anchored
    }
}
