//! Variance components on data with known noise.
use crate::online::{CollectedReports, both, run_of};
use manifactor_config::{Document, Format};
use manifactor_graph::Manifold;
use manifactor_graph::loss::Loss;
use manifactor_slam::online::Mapper;
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::source::InputFolders;
use manifactor_slam::variance::VarianceComponents;
use manifactor_solve::Silent;
use std::sync::Arc;

/// Returns the noise that is estimated in a simulated recording, with `sigma` and `sigma_px` as initial
/// values.
fn found(odometry: f64, sigma: f64, sigma_px: f64) -> VarianceComponents {
    let text = format!(
        "
        source = {{ type = 'simulated', seed = 3, scene = {{ objects = 8, classes = ['sports ball'] }},
                   trajectory = {{ frames = 60 }},
                   odometry = {{ translation = {odometry}, rotation = {odometry} }} }}
        odometry = {{ noise = {{ sigma = {sigma} }} }}
        detections = {{ noise = {{ sigma = {sigma_px} }} }}
        objects = {{ refinements = 1 }}
        variance_components = {{ correlation = false }}"
    );
    let document = Document::parse("run.toml", text, Format::Toml).unwrap();
    let run = RunDocument::read(&document).unwrap();
    let (estimate, report) = Run::new(&run, None).run_variant(&run.variants[0], &mut Silent).unwrap();
    assert_eq!(report.variance_components, estimate.components);
    estimate.components.last().unwrap().clone()
}

#[test]
fn the_noise_of_the_simulation_is_found_whatever_the_document_says_of_it() {
    let [found, again] = [found(0.1, 0.0001, 50.0), found(0.1, 0.1, 2.0)];
    assert_eq!(found, again);
    // balls are ellipsoids, so the detector's 2 px are the only error
    let sigma_px = found.boxes["all"].sigma_px;
    assert!((sigma_px - 2.0).abs() < 0.3, "{sigma_px}");
    // 10 % of 5 degrees, per axis; the grid has half decades
    let expected = 0.1 * (300f64 / 59.0).to_radians() / 3f64.sqrt();
    let choice = found.odometry.unwrap();
    assert!(!choice.keeps_input(), "{choice:?}");
    let turn = choice.noise.rotation;
    assert!((turn / expected).log10().abs() < 0.5, "{turn}, not {expected}");
}

#[test]
fn an_odometry_that_boxes_cannot_better_is_left_nearly_as_it_is() {
    let choice = found(1e-5, 0.01, 5.0).odometry.unwrap();
    assert!(choice.score.cost > -5.0, "{choice:?}");
    assert!(choice.noise.rotation < 1e-3 && choice.noise.translation < 1e-4, "{choice:?}");
}

#[test]
fn a_worse_odometry_is_found_to_be_worse() {
    let [good, bad] = [0.01, 0.3].map(|share| found(share, 0.01, 5.0).odometry.unwrap().noise);
    assert!(bad.rotation > 2.0 * good.rotation && bad.translation > good.translation, "{good:?} {bad:?}");
}

/// Returns the losses of the boxes' factors after one round, with the correlation time of that round.
fn losses(loss: &str) -> (Vec<Arc<dyn Loss>>, f64) {
    let text = format!(
        "
        source = {{ type = 'simulated', scene = {{ objects = 3 }}, trajectory = {{ frames = 90 }} }}
        detections = {{ noise = {{ sigma = 4.0 }}, loss = {loss} }}
        objects = {{ refinements = 0 }}
        variance_components = {{ rounds = 1 }}"
    );
    let document = Document::parse("run.toml", text, Format::Toml).unwrap();
    let run = RunDocument::read(&document).unwrap();
    let (estimate, _) = Run::new(&run, None).run_variant(&run.variants[0], &mut Silent).unwrap();
    let found = estimate.components.last().unwrap().boxes["all"];
    let boxes = estimate.mapping.graph.factors().iter().filter_map(|factor| factor.loss.clone());
    (boxes.collect(), found.correlation_time)
}

#[test]
fn boxes_that_last_get_their_loss_in_units_of_one_box() {
    for loss in ["{ type = 'dcs', scale = 5.0 }", "{ type = 'l1' }", "{ type = 'cauchy', scale = 2.8 }"] {
        let (tempered, tau) = losses(loss);
        assert!(tau > 1.2 && tempered.len() > 40, "{tau}, {} boxes", tempered.len());
        let node = Document::parse("loss.toml", format!("loss = {loss}"), Format::Toml).unwrap();
        let given = node.root().to_json().unwrap()["loss"].take();
        let given: Box<dyn Loss> = serde_json::from_value(given).unwrap();
        for s in [1e-3, 0.1, 1.0, 10.0, 1e4] {
            let (rho, weight) = given.erased().rho(tau * s);
            for loss in &tempered {
                let found = loss.erased().rho(s);
                assert!((found.0 * tau / rho - 1.0).abs() < 1e-12, "{loss:?} at {s}: {found:?}");
                assert!((found.1 / weight - 1.0).abs() < 1e-12, "{loss:?} at {s}: {found:?}");
            }
        }
    }
}

#[test]
fn the_noise_of_boxes_is_not_that_of_their_depths() {
    let text = "
        source = { type = 'simulated', scene = { objects = 3 }, trajectory = { frames = 60 },
                   detector = { depth_error = 0.02 } }
        objects = { refinements = 0 }
        variance_components = { rounds = 1 }";
    let document = Document::parse("run.toml", text, Format::Toml).unwrap();
    let run = RunDocument::read(&document).unwrap();
    let (estimate, _) = Run::new(&run, None).run_variant(&run.variants[0], &mut Silent).unwrap();
    let factors = estimate.mapping.graph.factors().iter();
    let depths = factors.filter(|entry| entry.factor.typetag_name() == "centroid_depth");
    let information = depths.map(|entry| entry.noise.information_matrix(1).unwrap()[(0, 0)]);
    let information: Vec<f64> = information.collect();
    // a box has 1/σ² below 1 in pixels
    assert!(!information.is_empty() && information.iter().all(|own| *own > 100.0), "{information:?}");
}

/// A camera that moves around a desk, with an odometry that boxes improve.
const STREAM: &str = r#"
source = { type = "simulated", seed = 3, scene = { objects = 8 }, trajectory = { frames = 60 },
           odometry = { translation = 0.3, rotation = 0.3 } }
association = { type = "likelihood" }
detections = { loss = { type = "cauchy", scale = 2.8 } }
variance_components = { prefix_s = 1.0 }
"#;

#[test]
fn a_stream_trusts_its_odometry_until_its_noise_is_estimated() {
    let document = run_of(STREAM, &[]);
    let variant = &document.variants[0];
    let (online, batch, kept) = both(&document, variant, None);
    let noisy: Vec<_> = kept.reports().iter().filter(|report| report.noise.is_some()).collect();
    let [report] = noisy[..] else { panic!("{} estimates", noisy.len()) };
    let sequence = variant.settings.source.load(&InputFolders::default()).unwrap();
    let first = sequence.frames[0].timestamp;
    // a first attempt may come before there are four objects
    assert!(report.timestamp - first >= 2.0, "{}", report.timestamp);
    assert_eq!(online.online.as_ref().unwrap().noise, report.noise);
    // before it, motions are those of the odometry
    for frame in 1..report.frame {
        let [from, to] = [frame - 1, frame].map(|i| sequence.frames[i].world_from_camera);
        let [live_from, live_to] = [frame - 1, frame].map(|i| kept.reports()[i].pose);
        let apart = from.between(&to).local(&live_from.between(&live_to)).norm();
        assert!(apart < 1e-3, "{apart} at frame {frame}");
    }
    // then the whole trajectory has the estimated noise
    let settings = report.noise.as_ref().unwrap().apply_to(&variant.settings);
    let mut last = Mapper::new(sequence.header(), &variant.settings);
    for observation in sequence.observations().take(report.frame + 1) {
        last.add_frame(&observation).unwrap();
    }
    last.set_noise(report.noise.as_ref().unwrap()).unwrap();
    let (graph, _) = last.smoother().graph();
    let of =
        |name: &str| graph.factors().iter().filter(|f| f.factor.typetag_name() == name).collect::<Vec<_>>();
    let (motions, boxes) = (of("between_se3"), of("bounding_box"));
    assert!(motions.len() == report.frame && boxes.len() > 100, "{} {}", motions.len(), boxes.len());
    assert!(motions.iter().all(|motion| motion.noise == settings.odometry.noise));
    assert!(boxes.iter().all(|seen| seen.noise == settings.detections.noise));
    assert_eq!(last.pose_of(report.frame), Some(report.pose));
    // a batch assigns boxes with the same noise
    let [online, batch] = [online.association, batch.association].map(|of| of.unwrap().at_the_time);
    assert_eq!(format!("{online:?}"), format!("{batch:?}"));
}

#[test]
fn a_stream_without_objects_keeps_the_initial_noise() {
    let document = run_of(STREAM, &["source.scene.objects=2"]);
    let mut kept = CollectedReports::default();
    let (_, online) = Run::new(&document, None).run_variant_online(&document.variants[0], &mut kept).unwrap();
    assert!(kept.reports().iter().all(|report| report.noise.is_none()));
    assert_eq!(online.online.unwrap().refusals, 0);
}
