//! apex-solver on a bundle adjustment in BAL's format, configured like its own program, without a loss.
//! Methods: lm+schur, explicit; lm+implicit, by conjugate gradients that never form the Schur complement.
use apex_solver::JacobianMode;
use apex_solver::apex_camera_models::{BALPinholeCameraStrict, DistortionModel, PinholeParams};
use apex_solver::apex_manifolds::{LieGroup, ManifoldType};
use apex_solver::apex_manifolds::se3::SE3;
use apex_solver::apex_manifolds::so3::SO3;
use apex_solver::core::VarKey;
use apex_solver::core::problem::Problem;
use apex_solver::factors::SelfCalibration;
use apex_solver::factors::visual::ProjectionFactor;
use apex_solver::linalg::{ExplicitSchurVariant, LinearSolverType, SchurPreconditioner};
use apex_solver::optimizer::LevenbergMarquardt;
use apex_solver::optimizer::levenberg_marquardt::LevenbergMarquardtConfig;
use nalgebra::{DVector, Matrix2xX, Quaternion, UnitQuaternion, Vector2, Vector3};
use peers::{Task, report, timed};
use std::fs;
use std::io::Write;

struct Bundle {
    observations: Vec<[f64; 4]>,
    cameras: Vec<[f64; 9]>,
    points: Vec<[f64; 3]>,
}

impl Bundle {
    fn read(path: &str) -> Self {
        let text = fs::read_to_string(path).expect("INPUT is readable");
        let numbers: Vec<f64> = text.split_whitespace().map(|w| w.parse().expect("a number")).collect();
        let [cameras, _, observations] = [0, 1, 2].map(|i| numbers[i] as usize);
        let (seen, rest) = numbers[3..].split_at(4 * observations);
        let (cameras, points) = rest.split_at(9 * cameras);
        Self {
            observations: seen.as_chunks().0.to_vec(),
            cameras: cameras.as_chunks().0.to_vec(),
            points: points.as_chunks().0.to_vec(),
        }
    }
}

fn main() {
    let task = Task::from_arguments();
    let bundle = Bundle::read(&task.input);

    let mut problem = Problem::new(JacobianMode::Sparse);
    let (mut poses, mut intrinsics, mut points) = (Vec::new(), Vec::new(), Vec::new());
    for [rx, ry, rz, x, y, z, own @ ..] in &bundle.cameras {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(*rx, *ry, *rz)).into_inner();
        let rotation = SO3::from_quaternion(UnitQuaternion::from_quaternion(rotation));
        let pose = SE3::from_translation_so3(Vector3::new(*x, *y, *z), rotation);
        let pose = DVector::from_column_slice(pose.as_param_slice());
        poses.push(problem.add_variable(ManifoldType::SE3, pose));
        intrinsics.push(problem.add_variable(ManifoldType::RN, DVector::from_column_slice(own)));
    }
    for point in &bundle.points {
        let key = problem.add_variable(ManifoldType::RN, DVector::from_column_slice(point));
        problem.mark_for_elimination(key);
        points.push(key);
    }
    for [camera, point, u, v] in &bundle.observations {
        let (camera, point) = (*camera as usize, *point as usize);
        let [.., f, k1, k2] = bundle.cameras[camera];
        let pinhole = PinholeParams { fx: f, fy: f, cx: 0.0, cy: 0.0 };
        let model = BALPinholeCameraStrict::new(pinhole, DistortionModel::Radial { k1, k2 }).expect("a camera");
        let pixel = Matrix2xX::from_columns(&[Vector2::new(*u, *v)]);
        let factor: ProjectionFactor<BALPinholeCameraStrict, SelfCalibration> = ProjectionFactor::new(pixel, model);
        problem.add_residual_block(&[poses[camera], points[point], intrinsics[camera]], Box::new(factor), None);
    }
    (0..6).for_each(|direction| problem.fix_variable(poses[0], direction));

    let mut config = LevenbergMarquardtConfig::for_bundle_adjustment()
        .with_max_iterations(task.max_iterations)
        .with_cost_tolerance(task.relative_cost)
        .with_parameter_tolerance(0.0)
        .with_gradient_tolerance(0.0);
    config.schur_variant = ExplicitSchurVariant::Sparse;
    config.schur_preconditioner = SchurPreconditioner::SchurJacobi;
    config.linear_solver_type = match task.method.as_str() {
        "lm+implicit" => LinearSolverType::ImplicitSparseSchur,
        _ => LinearSolverType::ExplicitSparseSchur,
    };
    let (result, seconds) = timed(|| LevenbergMarquardt::with_config(config).optimize(&mut problem));
    let result = result.unwrap_or_else(|error| panic!("{error}"));

    let estimate = |key: &VarKey| result.parameters[*key].to_dvector();
    let mut out = std::io::BufWriter::new(fs::File::create(&task.output).expect("OUTPUT is writable"));
    let mut line = |numbers: &[f64]| {
        let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
        writeln!(out, "{}", words.join(" ")).expect("OUTPUT is writable");
    };
    line(&[poses.len() as f64, points.len() as f64, 0.0]);
    for (pose, own) in poses.iter().zip(&intrinsics) {
        // the order of apex-solver is x y z qw qx qy qz
        let pose = estimate(pose);
        let q = UnitQuaternion::from_quaternion(Quaternion::new(pose[3], pose[4], pose[5], pose[6]));
        line(&[q.scaled_axis().as_slice(), &pose.as_slice()[..3], estimate(own).as_slice()].concat());
    }
    points.iter().for_each(|point| line(estimate(point).as_slice()));
    report(seconds, result.iterations, format!("{:?}", result.status));
}
