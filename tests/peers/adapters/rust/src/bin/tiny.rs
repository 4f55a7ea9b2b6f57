//! tiny-solver on a pose graph. Methods: gn, lm. Its own factors accept no information matrix, so these
//! factors are whitened.
use peers::{Edge, PoseGraph, Task, report, timed, write};
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tiny_solver::factors::{Factor, PriorFactor, na};
use tiny_solver::manifold::se3::{SE3, SE3Manifold};
use tiny_solver::{GaussNewtonOptimizer, LevenbergMarquardtOptimizer, Optimizer, OptimizerOptions, Problem};

/// Linearizations, counted at the first edge, because the optimizers do not report them.
static LINEARIZATIONS: AtomicUsize = AtomicUsize::new(0);

struct Between {
    /// The measurement in the order of tiny-solver: rotation, then translation.
    measured: na::DVector<f64>,
    /// L' of L L' = information, in that order.
    root: na::DMatrix<f64>,
    counts: bool,
}

impl<T: na::RealField> Factor<T> for Between {
    fn residual_func(&self, poses: &[na::DVector<T>]) -> na::DVector<T> {
        if self.counts && TypeId::of::<T>() != TypeId::of::<f64>() {
            LINEARIZATIONS.fetch_add(1, Ordering::Relaxed);
        }
        let measured: na::DVector<T> = self.measured.clone().cast();
        let log = match self.measured.len() {
            3 => planar(&measured, &poses[0], &poses[1]),
            _ => spatial(&measured, &poses[0], &poses[1]),
        };
        self.root.clone().cast::<T>() * log
    }
}

/// Log of Z^-1 Xi^-1 Xj; poses are (angle, x, y).
fn planar<T: na::RealField>(z: &na::DVector<T>, a: &na::DVector<T>, b: &na::DVector<T>) -> na::DVector<T> {
    let turn = |angle: &T, x: T, y: T| {
        let (s, c) = angle.clone().sin_cos();
        (c.clone() * x.clone() + s.clone() * y.clone(), c * y - s * x)
    };
    let (x, y) = turn(&a[0], b[1].clone() - a[1].clone(), b[2].clone() - a[2].clone());
    let (x, y) = turn(&z[0], x - z[1].clone(), y - z[2].clone());
    let angle = b[0].clone() - a[0].clone() - z[0].clone();
    let angle = angle.clone().sin().atan2(angle.cos());
    let half = angle.clone() * na::convert::<f64, T>(0.5);
    let k = match half.clone().abs() < na::convert(1e-4) {
        true => T::one() - half.clone() * half.clone() / na::convert(3.0),
        false => half.clone() / half.clone().tan(),
    };
    let u = k.clone() * x.clone() + half.clone() * y.clone();
    na::DVector::from_vec(vec![angle, u, k * y - half * x])
}

/// Log of Z^-1 Xi^-1 Xj in space. The library's logarithm does not transform the translation, so V^-1 is
/// applied here.
fn spatial<T: na::RealField>(z: &na::DVector<T>, a: &na::DVector<T>, b: &na::DVector<T>) -> na::DVector<T> {
    let pose = |x: &na::DVector<T>| SE3::from_vec(x.as_view());
    let log = (pose(z).inverse() * pose(a).inverse() * pose(b)).log();
    let w = na::Vector3::new(log[0].clone(), log[1].clone(), log[2].clone());
    let t = na::Vector3::new(log[3].clone(), log[4].clone(), log[5].clone());
    let square = w.norm_squared();
    let k = match square < na::convert(1e-8) {
        true => na::convert(1.0 / 12.0),
        false => {
            let half = square.clone().sqrt() * na::convert::<f64, T>(0.5);
            (T::one() - half.clone() / half.tan()) / square
        }
    };
    let wt = w.cross(&t);
    let v = t - wt.clone() * na::convert::<f64, T>(0.5) + w.cross(&wt) * k;
    na::DVector::from_iterator(6, w.iter().chain(v.iter()).cloned())
}

/// Converts to the order of tiny-solver, rotation first.
fn own_order(pose: &[f64]) -> na::DVector<f64> {
    let translation = if pose.len() == 3 { 2 } else { 3 };
    na::DVector::from_vec([&pose[translation..], &pose[..translation]].concat())
}

fn files_order(pose: &[f64]) -> Vec<f64> {
    let rotation = if pose.len() == 3 { 1 } else { 4 };
    [&pose[rotation..], &pose[..rotation]].concat()
}

fn between(edge: &Edge, counts: bool) -> Between {
    let n = if edge.measured.len() == 3 { 3 } else { 6 };
    let translations = if n == 3 { 2 } else { 3 };
    let own = |i: usize| (i + translations) % n;
    let information = na::DMatrix::from_fn(n, n, |i, j| edge.information(own(i), own(j)));
    let root = information.cholesky().expect("information is positive definite").l().transpose();
    Between { measured: own_order(&edge.measured), root, counts }
}

fn main() {
    let task = Task::from_arguments();
    let graph = PoseGraph::read(&task.input);
    let name = |id: u64| format!("x{id}");
    let mut problem = Problem::new();
    let mut start = HashMap::new();
    for (id, pose) in &graph.vertices {
        start.insert(name(*id), own_order(pose));
        if graph.spatial {
            problem.set_variable_manifold(&name(*id), Arc::new(SE3Manifold));
        }
    }
    for (i, edge) in graph.edges.iter().enumerate() {
        let [a, b] = edge.ends.map(name);
        let rows = if graph.spatial { 6 } else { 3 };
        problem.add_residual_block(rows, &[&a, &b], Box::new(between(edge, i == 0)), None);
    }
    // it cannot fix a variable on a manifold: a prior, whose cost at the start is zero
    let (first, pose) = &graph.vertices[0];
    let prior = PriorFactor { v: own_order(pose) };
    problem.add_residual_block(pose.len(), &[&name(*first)], Box::new(prior), None);

    let options = OptimizerOptions {
        max_iteration: task.max_iterations,
        min_rel_error_decrease_threshold: task.relative_cost,
        min_abs_error_decrease_threshold: 0.0,
        ..OptimizerOptions::default()
    };
    let (result, seconds) = timed(|| match task.method.as_str() {
        "gn" => GaussNewtonOptimizer::new().optimize(&problem, &start, Some(options)),
        _ => LevenbergMarquardtOptimizer::default().optimize(&problem, &start, Some(options)),
    });
    let result = result.expect("the solver returns an estimate");
    let poses = graph.vertices.iter().map(|(id, _)| (*id, files_order(result[&name(*id)].as_slice())));
    write(&task.output, poses);
    report(seconds, LINEARIZATIONS.load(Ordering::Relaxed), "returned");
}
