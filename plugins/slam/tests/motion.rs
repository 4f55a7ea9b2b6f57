//! Motion models, in batch and in a stream.
use crate::online::{both, run_of};
use manifactor_geometry::Twist;
use manifactor_slam::mapping::Mapping;
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_solve::Silent;

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
    assert!(variance.contains("has no odometry whose noise could be estimated"), "{variance}");
}
