//! Motion models, in batch and in a stream.
use crate::online::{both, run_of};
use manifactor_geometry::{Point1, Twist};
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::Mapping;
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::{Frame, Observation};
use manifactor_solve::{Problem, Silent};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A camera that moves around a desk with poor odometry. Only depths determine the scale; velocities and
/// boxes do not.
const DESK: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 12 }, trajectory = { frames = 80 }, detector = { depth_error = 0.02 }, odometry = { translation = 0.3, rotation = 0.15 } }
odometry = { noise = { sigmas = [0.03, 0.03, 0.03, 0.05, 0.05, 0.05] } }
"#;

#[test]
fn frames_are_tied_by_a_constant_velocity_in_batch_and_stream() {
    let run = run_of(DESK, &["motion.type=constant_velocity"]);
    let (online, batch, _) = both(&run, &run.variants[0], None);
    let (found, expected) = (online.solve.final_cost, batch.solve.final_cost);
    assert!(found <= expected * (1.0 + 1e-3), "{found} {expected}");
    let ate = &batch.trajectory[0];
    assert!(ate.estimate.ate.rmse < 0.5 * ate.odometry.ate.rmse, "{ate:?}");
}

#[test]
fn each_frame_has_a_velocity_and_the_first_a_prior() {
    let run = run_of(DESK, &["motion.type=constant_velocity"]);
    let settings = &run.variants[0].settings;
    let sequence = Run::new(&run, None).sequence(&run.variants[0]).unwrap();
    let mapping = Mapping::new(&sequence, settings).unwrap();
    assert_eq!(mapping.values.all::<Twist>().count(), 80);
    let of = |name: &str| {
        let factors = mapping.graph.factors().iter();
        factors.filter(|entry| entry.factor.typetag_name() == name).count()
    };
    assert_eq!((of("constant_velocity"), of("prior_twist"), of("between_se3")), (79, 1, 0));
    run.variants
        .iter()
        .for_each(|variant| drop(Run::new(&run, None).run_variant(variant, &mut Silent).unwrap()));
}

#[test]
fn what_does_not_go_with_a_motion_model_is_refused() {
    let refused = |more: &str| {
        let text = format!("motion = {{ type = \"constant_velocity\" }}\n{DESK}\n{more}");
        let document =
            manifactor_config::Document::parse("desk.toml", text, manifactor_config::Format::Toml).unwrap();
        RunDocument::read(&document).unwrap_err().to_string()
    };
    let own = refused("[[variables]]\nkey = \"v3\"\nvalue = { type = \"point1\", position = [0.0] }");
    assert!(own.contains("`v3` is the key of a variable of the motion model `constant_velocity`"), "{own}");
    let variance = refused("[variance_components]\nodometry = true");
    assert!(variance.contains("the noise of the odometry cannot be estimated with"), "{variance}");
}

/// A camera without depth that walks around a table with objects of known classes.
const MONOCULAR: &str = r#"
semantics = "table_one"
sizes = "household"
motion = { type = "scaled_odometry" }
source = { type = "simulated", scene = { objects = 12 }, trajectory = { frames = 80 }, odometry = { translation = 0.02, rotation = 0.02 } }
odometry = { noise = { sigma = 0.002 } }
"#;

/// The estimated logarithm of a scale.
#[derive(Debug)]
struct FoundScale {
    error: f64,
    sigma: f64,
}

/// Returns the estimated scales at the first and at the last step. `log_unit` is the logarithm of the length of one
/// unit of the odometry, in metres, at a share of the trajectory.
fn found_scales(text: &str, scene: usize, log_unit: fn(f64) -> f64) -> [FoundScale; 2] {
    let run = run_of(text, &[&format!("source.scene.seed={scene}")]);
    let settings = run.variants[0].settings.clone().for_stream();
    let sequence = settings.source.load(&Default::default()).unwrap();
    let frames: Vec<Observation> = sequence.observations().collect();
    let share = |i: usize| i as f64 / (frames.len() - 2) as f64;
    let mut monocular = sequence.header().into_sequence();
    let mut pose = frames[0].frame.world_from_camera;
    for (i, observation) in frames.iter().enumerate() {
        if let Some(before) = i.checked_sub(1) {
            let mut step =
                frames[before].frame.world_from_camera.between(&observation.frame.world_from_camera);
            step.translation /= log_unit(share(before)).exp();
            pose = pose.compose(&step);
        }
        let frame = Frame { world_from_camera: pose, ..observation.frame.clone() };
        monocular.push(Observation { frame, ..observation.clone() });
    }
    let sequence = Arc::new(monocular);
    let mapping = Mapping::new(&sequence, &settings).unwrap();
    let estimate = Estimate::new(sequence, mapping, &settings, &mut Silent).unwrap();
    assert!(estimate.solution.outcome.termination.is_converged());
    let mut problem = Problem::compile(&estimate.mapping.graph, &estimate.solution.values).unwrap();
    problem.linearize();
    let sigmas: BTreeMap<String, f64> = problem
        .marginals()
        .unwrap()
        .into_iter()
        .map(|(key, m)| (key.to_string(), m[(0, 0)].sqrt()))
        .collect();
    let steps = frames.len() - 1;
    [0, steps - 1].map(|step| {
        let key = if text.contains("drift") { format!("s{step}") } else { "s0".to_owned() };
        let scale = estimate.solution.values.get::<Point1>(key.as_str()).unwrap().0.x;
        FoundScale { error: scale - log_unit(share(step)), sigma: sigmas[&key] }
    })
}

#[test]
fn sizes_of_objects_determine_the_scale_of_a_camera_without_depth() {
    let balls = MONOCULAR
        .replace(
            "sizes = \"household\"",
            "sizes = [{ classes = [\"sports ball\"], size_m = [0.22, 0.22, 0.22], shape = \"ellipsoid\", spread = 1.1 }]",
        )
        .replace("objects = 12", "objects = 12, classes = [\"sports ball\"]");
    let drift = balls.replace("scaled_odometry\"", "scaled_odometry\", drift = 0.05");
    for scene in 1..=3 {
        let [constant, _] = found_scales(&balls, scene, |_| 2f64.ln());
        let [first, last] = found_scales(&drift, scene, |share| share * 1.2f64.ln());
        let [household, _] = found_scales(MONOCULAR, scene, |_| 0.5f64.ln());
        for found in [&constant, &first, &last, &household] {
            assert!(found.error.abs() < 3.0 * found.sigma && found.sigma < 0.11, "{scene}: {found:?}");
        }
        assert!(
            constant.sigma < 0.04 && (last.error - first.error).abs() < 0.05,
            "{scene}: {first:?} {last:?}"
        );
    }
}

#[test]
fn a_stream_estimates_the_scale_as_a_batch_does() {
    for more in ["motion.first=0.5", "motion.drift=0.05"] {
        let run = run_of(MONOCULAR, &[more]);
        let (online, batch, _) = both(&run, &run.variants[0], None);
        let (found, expected) = (online.solve.final_cost, batch.solve.final_cost);
        assert!(found <= expected * (1.0 + 1e-3), "{more}: {found} {expected}");
        let run = run_of(MONOCULAR, &[more, "online.window.poses=20"]);
        let (online, ..) = both(&run, &run.variants[0], None);
        let stream = online.online.unwrap();
        assert_eq!(stream.refusals, 0, "{more}");
        assert!(
            online.trajectory[0].estimate.ate.rmse < 0.3,
            "{more}: {:?}",
            online.trajectory[0].estimate.ate
        );
    }
}
