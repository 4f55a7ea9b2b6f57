use super::*;
use crate::semantics::{SemanticRule, read_semantics};
use manifactor_config::{Document, Errors, Format};
use manifactor_geometry::{Se3, So3};
use manifactor_graph::Values;
use manifactor_quadric::DualQuadric;
use manifactor_recording::fusion::ClassFusion;
use manifactor_recording::prior_map::DetectionCounts;
use manifactor_recording::sequence::{ClassScores, ObjectId};
use std::path::Path;
use std::sync::Arc;

const STANDING: [f64; 3] = [0.04, 0.05, 0.15];
const LYING: [f64; 3] = [0.15, 0.1, 0.02];

/// Returns an object that leans by an angle about x, with the standard deviation of its log semi-axes.
fn object(class: &str, semi_axes: [f64; 3], tilt: f64, sigma: f64) -> PriorObject {
    let mut classes = ClassFusion::default();
    let scores: ClassScores = [(class.to_owned(), 0.9)].into_iter().collect();
    classes.add(&scores, &ClassAliases::default());
    let pose = Se3::new(So3::exp(&Vector3::new(tilt, 0.0, 0.0)), Vector3::new(1.0, 2.0, 0.5));
    let mut covariance = [[0.0; 9]; 9];
    for k in 0..9 {
        covariance[k][k] = if k < 6 { 1e-4 } else { sigma * sigma };
    }
    let quadric = DualQuadric { pose, semi_axes: semi_axes.into() };
    let (id, detection_counts) = (ObjectId(0), DetectionCounts::default());
    PriorObject { id, classes, quadric, covariance, detection_counts, least_px: None, flat: false }
}

fn map(objects: Vec<PriorObject>) -> PriorMap {
    PriorMap::new(Some(Direction::Z), objects.into_iter().map(Arc::new).collect())
}

fn learned(objects: Vec<PriorObject>) -> LearnedPriors {
    LearnedPriors::learn(&[map(objects)]).unwrap()
}

fn orientation(objects: Vec<PriorObject>) -> LearnedOrientation {
    let all = learned(objects);
    all.classes["cup"].orientation.orientation(&all.pooled.orientation)
}

#[test]
fn sizes_move_from_the_household_table_to_the_objects() {
    let table = household()["cup"];
    let longest = |n: usize, sigma: f64| {
        let objects = vec![object("cup", [0.2, 0.2, 0.4], 0.0, sigma); n];
        learned(objects).classes["cup"].sizes[2]
    };
    let own = 0.4f64.ln();
    assert!((longest(2, 1e-6).mean - 0.5 * (table[2].mean + own)).abs() < 1e-9);
    assert!((longest(200, 1e-6).mean - own).abs() < 0.02);
    // equal objects: a small spread remains
    assert!(longest(200, 1e-6).sigma < 0.5 * table[2].sigma && longest(200, 1e-6).sigma > 0.0);
    // one object far from the table makes the class wide
    assert!(longest(1, 1e-6).sigma > table[2].sigma);
    // a semi-axis that boxes hardly determine counts little
    assert!((longest(2, 4.0).mean - table[2].mean).abs() < 0.05);
}

#[test]
fn a_flat_object_has_no_size_and_a_class_without_a_row_is_reported() {
    let flat = PriorObject { flat: true, ..object("cup", [0.2, 0.2, 0.4], 0.0, 1e-6) };
    assert_eq!(learned(vec![flat]).classes["cup"].sizes, household()["cup"]);
    let all = learned(vec![object("gramophone", STANDING, 0.0, 0.1), object("cup", STANDING, 0.0, 0.1)]);
    assert_eq!(all.unknown_classes().collect::<Vec<_>>(), [("gramophone", None)]);
    let typo = learned(vec![object("keybord", LYING, 0.0, 0.1)]);
    assert_eq!(typo.unknown_classes().collect::<Vec<_>>(), [("keybord", Some("keyboard".to_owned()))]);
}

#[test]
fn most_objects_decide_which_axis_is_vertical() {
    let turned = std::f64::consts::FRAC_PI_2;
    let cups = |axes: [f64; 3], tilts: &[f64]| tilts.iter().map(|t| object("cup", axes, *t, 0.1)).collect();
    assert_eq!(orientation(cups(STANDING, &[0.0; 5])), LearnedOrientation::Longest);
    assert_eq!(orientation(cups(LYING, &[0.05; 5])), LearnedOrientation::Shortest);
    // the middle axis is vertical
    assert_eq!(orientation(cups([0.3, 0.05, 0.15], &[0.0; 5])), LearnedOrientation::Lying);
    assert_eq!(orientation(cups(STANDING, &[0.0, 0.0, turned, turned])), LearnedOrientation::Resting);
    assert_eq!(orientation(cups(STANDING, &[0.7; 5])), LearnedOrientation::Free);
    // nearly equal axes have no order
    assert_eq!(orientation(cups([0.1, 0.1, 0.105], &[0.0; 5])), LearnedOrientation::Resting);
    assert_eq!(orientation(cups(STANDING, &[0.0])), LearnedOrientation::Longest);
}

#[test]
fn the_spread_of_the_tilt_moves_from_its_prior_to_that_of_the_objects() {
    let sigma = |tilt: f64, n: usize| {
        let all = learned(vec![object("cup", STANDING, tilt, 0.1); n]);
        all.classes["cup"].orientation.tilt_sigma()
    };
    assert!((sigma(0.0, 2) - TILT_SIGMA / 2.0f64.sqrt()).abs() < 1e-12);
    assert!((sigma(0.2, 1000) - 0.2f64.sin()).abs() < 1e-3);
}

#[test]
fn a_tilt_that_the_map_leaves_open_is_not_counted() {
    let mut open = object("cup", STANDING, 0.0, 0.1);
    open.covariance[0][0] = 1.0;
    assert_eq!(learned(vec![open.clone()]).classes["cup"].orientation.objects(), 0);
    // turns about the vertical axis do not matter
    open.covariance[0][0] = 1e-4;
    open.covariance[2][2] = 1.0;
    assert_eq!(learned(vec![open.clone()]).classes["cup"].orientation.objects(), 1);
    let mut without_up = map(vec![open]);
    without_up.up = None;
    let all = LearnedPriors::learn(&[without_up]).unwrap();
    assert_eq!(all.classes["cup"].orientation.objects(), 0);
}

/// Returns the rules of the written file.
fn rules(all: &LearnedPriors) -> Vec<SemanticRule> {
    let document = Document::parse("priors.toml", all.to_string(), Format::Toml).unwrap();
    let errors = Errors::new();
    let read = read_semantics(document.root().field("semantics"), Path::new(""), &Values::new(), &errors);
    errors.finish(Some(read)).unwrap_or_else(|e| panic!("{e}\n{all}"))
}

fn factors<'a>(rules: &'a [SemanticRule], class: &str) -> Vec<&'a str> {
    let of_class = rules.iter().filter(|rule| rule.applies(class, &ClassAliases::default()));
    of_class.map(|rule| rule.factor.factor_type()).collect()
}

#[test]
fn the_file_gives_each_class_its_rules_and_all_others_the_pooled_ones() {
    let strange = "a \"b\"\n\u{7f} # c";
    let mut objects = vec![object("bottle", STANDING, 0.0, 0.1); 8];
    objects.extend(vec![object("book", LYING, 0.0, 0.1); 8]);
    objects.extend(vec![object("umbrella", STANDING, 0.7, 0.1); 3]);
    objects.push(object(strange, STANDING, 0.0, 0.1));
    let rules = rules(&learned(objects));
    assert!(rules.iter().all(|rule| rule.optional));
    assert_eq!(factors(&rules, "bottle"), ["size_prior", "upright", "resting"]);
    assert_eq!(factors(&rules, "book"), ["size_prior", "upright", "resting"]);
    assert_eq!(factors(&rules, "umbrella"), ["size_prior"]);
    assert_eq!(factors(&rules, "zebra"), ["size_prior", "resting"]);
    let strange = ClassAliases::default().canonical(strange);
    // one object is not enough for an axis
    assert_eq!(factors(&rules, &strange), ["size_prior", "resting"]);
}

#[test]
fn classes_that_rest_keep_their_rule_among_many_that_lean() {
    let mut objects = vec![object("umbrella", STANDING, 0.7, 0.1); 9];
    objects.extend(vec![object("bottle", STANDING, 0.0, 0.1); 5]);
    let rules = rules(&learned(objects));
    assert_eq!(factors(&rules, "umbrella"), ["size_prior"]);
    assert_eq!(factors(&rules, "bottle"), ["size_prior", "upright", "resting"]);
    assert_eq!(factors(&rules, "zebra"), ["size_prior"]);
}

#[test]
fn maps_without_objects_are_refused() {
    assert_eq!(LearnedPriors::learn(&[map(vec![])]).unwrap_err(), NothingToLearn);
}
