//! apex-solver on a pose graph. Methods: gn, lm, dogleg.
use apex_solver::apex_manifolds::ManifoldType;
use apex_solver::apex_manifolds::se2::SE2;
use apex_solver::apex_manifolds::se3::SE3;
use apex_solver::core::problem::Problem;
use apex_solver::optimizer::dog_leg::DogLegConfig;
use apex_solver::optimizer::gauss_newton::GaussNewtonConfig;
use apex_solver::optimizer::levenberg_marquardt::LevenbergMarquardtConfig;
use apex_solver::optimizer::{DogLeg, GaussNewton, LevenbergMarquardt};
use apex_solver::{BetweenFactor, Factor, JacobianMode, NoiseModel, PriorFactor};
use nalgebra::{DMatrix, DVector, Quaternion, Vector3};
use peers::{PoseGraph, Task, report, timed, write};
use std::collections::HashMap;

/// Converts to the order of apex-solver: x y z qw qx qy qz.
fn own_order(pose: &[f64]) -> Vec<f64> {
    match pose {
        [x, y, z, qx, qy, qz, qw] => vec![*x, *y, *z, *qw, *qx, *qy, *qz],
        planar => planar.to_vec(),
    }
}

fn files_order(pose: &[f64]) -> Vec<f64> {
    match pose {
        [x, y, z, qw, qx, qy, qz] => vec![*x, *y, *z, *qx, *qy, *qz, *qw],
        planar => planar.to_vec(),
    }
}

fn se2(pose: &[f64]) -> SE2 {
    SE2::from_xy_angle(pose[0], pose[1], pose[2])
}

fn se3(pose: &[f64]) -> SE3 {
    let [x, y, z, qx, qy, qz, qw] = pose.try_into().expect("seven numbers");
    SE3::from_translation_quaternion(Vector3::new(x, y, z), Quaternion::new(qw, qx, qy, qz).normalize())
}

fn main() {
    let task = Task::from_arguments();
    let graph = PoseGraph::read(&task.input);
    let (kind, n) = if graph.spatial { (ManifoldType::SE3, 6) } else { (ManifoldType::SE2, 3) };

    let mut problem = Problem::new(JacobianMode::Sparse);
    let mut keys = HashMap::new();
    for (id, pose) in &graph.vertices {
        keys.insert(*id, problem.add_variable(kind.clone(), DVector::from_vec(own_order(pose))));
    }
    // its Gauss-Newton cannot fix a variable: a prior, whose cost at the start is zero
    let (first, pose) = &graph.vertices[0];
    let prior: Box<dyn Factor + Send> = match graph.spatial {
        true => Box::new(PriorFactor::new(se3(pose))),
        false => Box::new(PriorFactor::new(se2(pose))),
    };
    problem.add_residual_block(&[keys[first]], prior, None);
    for edge in &graph.edges {
        let ends = edge.ends.map(|id| keys[&id]);
        let factor: Box<dyn Factor + Send> = match graph.spatial {
            true => Box::new(BetweenFactor::new(se3(&edge.measured))),
            false => Box::new(BetweenFactor::new(se2(&edge.measured))),
        };
        let information = DMatrix::from_fn(n, n, |i, j| edge.information(i, j));
        let noise = NoiseModel::from_information(information).expect("information is positive definite");
        problem.add_residual_block_with_noise(&ends, factor, None, noise);
    }

    let (iterations, relative) = (task.max_iterations, task.relative_cost);
    let (result, seconds) = timed(|| match task.method.as_str() {
        "gn" => GaussNewton::with_config(
            GaussNewtonConfig::new()
                .with_max_iterations(iterations)
                .with_cost_tolerance(relative)
                .with_parameter_tolerance(0.0)
                .with_gradient_tolerance(0.0),
        )
        .optimize(&mut problem),
        "dogleg" => DogLeg::with_config(
            DogLegConfig::new()
                .with_max_iterations(iterations)
                .with_cost_tolerance(relative)
                .with_parameter_tolerance(0.0)
                .with_gradient_tolerance(0.0),
        )
        .optimize(&mut problem),
        _ => LevenbergMarquardt::with_config(
            match graph.spatial {
                true => LevenbergMarquardtConfig::new(),
                false => LevenbergMarquardtConfig::for_2d_pose_graph(),
            }
            .with_max_iterations(iterations)
            .with_cost_tolerance(relative)
            .with_parameter_tolerance(0.0)
            .with_gradient_tolerance(0.0),
        )
        .optimize(&mut problem),
    });
    let result = result.unwrap_or_else(|error| panic!("{error}"));
    let poses = graph.vertices.iter().map(|(id, _)| *id);
    write(
        &task.output,
        poses.map(|id| (id, files_order(result.parameters[keys[&id]].to_dvector().as_slice()))),
    );
    report(seconds, result.iterations, format!("{:?}", result.status));
}
