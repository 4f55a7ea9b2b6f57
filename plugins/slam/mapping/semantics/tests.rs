use super::apply::RuleVerdict;
use super::*;
use manifactor_config::{Document, Errors, Format};
use manifactor_geometry::{Se3, So3};
use manifactor_quadric::DualQuadric;
use nalgebra::Vector3;

fn orientation(class: &str) -> Vec<String> {
    let aliases = ClassAliases::default();
    let class = aliases.canonical(class);
    let rules = table_one().unwrap();
    rules.iter().filter(|r| r.applies(&class, &aliases)).map(|r| r.factor.factor_type().to_owned()).collect()
}

#[test]
fn table_one_has_the_classes_of_the_paper() {
    let rules = table_one().unwrap();
    assert_eq!(rules.iter().map(|r| r.classes.len()).collect::<Vec<_>>(), [12, 9]);
    assert_eq!(orientation("tvmonitor"), ["horizontal_orientation"]);
    assert_eq!(orientation("pottedplant"), ["vertical_orientation"]);
    assert_eq!(orientation("sports ball"), [""; 0]);
}

#[test]
fn a_star_is_for_all() {
    let rule = SemanticRule { classes: vec!["*".into()], ..table_one().unwrap().swap_remove(0) };
    assert!(
        rule.applies("sports ball", &ClassAliases::default()) && rule.applies("", &ClassAliases::default())
    );
    assert_eq!(unmatched(&rule, &[], &ClassAliases::default()), [""; 0]);
}

#[test]
fn classes_that_match_nothing_are_reported() {
    let rules = table_one().unwrap();
    let seen = vec!["cup".to_owned(), "potted plant".to_owned()];
    let missing = unmatched(&rules[1], &seen, &ClassAliases::default());
    assert_eq!(missing.len(), 7);
    assert!(!missing.contains(&"cup"));
}

#[test]
fn the_factor_gets_up_from_gravity() {
    let up = Direction::new([0.0, -2.0, 0.0].into()).unwrap();
    let rules = table_one().unwrap();
    let entry = rules[1].entry(vec!["q1".into()], Some(up), 1.0).unwrap();
    let text = serde_json::to_string(&entry.factor).unwrap();
    assert_eq!(text, r#"{"type":"vertical_orientation","up":[0.0,-1.0,0.0]}"#);
    assert!(matches!(rules[1].entry(vec!["q1".into()], None, 1.0), Err(RuleError::NoUp { .. })));
}

/// Returns the rules of a document, or its errors.
fn read(text: &str) -> Result<Vec<SemanticRule>, String> {
    let document = Document::parse("rules.toml", text, Format::Toml).unwrap();
    let errors = Errors::new();
    let read = document.section(&errors).map(|mut section| {
        let (_, own) = manifactor_config::read_graph_section(&mut section);
        let folder = std::path::Path::new("");
        let mut rules = read_semantics(section.optional_node("semantics"), folder, &own, &errors);
        rules.extend(read_sizes(section.optional_node("sizes"), folder, &errors));
        rules
    });
    errors.finish(read).map_err(|e| e.to_string())
}

const TABLE: &str =
    "variables = [{ key = 'table', value = { type = 'plane', normal = [0.0, 0.0, 1.0], offset = 0.7 } }]\n";

fn rules(semantics: &str) -> Result<Vec<SemanticRule>, String> {
    read(&format!("{TABLE}[[semantics]]\n{semantics}"))
}

/// Returns an object on a line, half a metre long; its width equals its height.
fn object(number: usize, class: &str, score: f64, x: f64) -> RuleCandidate {
    let pose = Se3::new(So3::identity(), Vector3::new(x, 0.0, 0.1 * number as f64));
    let class = FusedClass { name: class.into(), score, share: 1.0, others: Default::default() };
    let start = DualQuadric { pose, semi_axes: Vector3::new(0.1, 0.1, 0.25) };
    RuleCandidate { key: Key::indexed("q", number), class: Some(class), start, known: false }
}

/// Returns the verdict on each of these objects.
fn judged(semantics: &str, objects: &[RuleCandidate]) -> Vec<RuleVerdict> {
    let (rules, aliases) = (rules(semantics).unwrap_or_else(|e| panic!("{e}")), ClassAliases::default());
    let mut judge =
        RuleEvaluator::new(&rules, &aliases, Some(Direction::Z), objects.to_vec(), ConnectedKeys::default());
    objects.iter().map(|object| judge.evaluate_object(object).unwrap()).collect()
}

fn keys(verdict: &RuleVerdict) -> Vec<Vec<&str>> {
    verdict.entries.iter().map(|entry| entry.keys.iter().map(Key::as_str).collect()).collect()
}

#[test]
fn a_score_decides_and_the_reason_has_it() {
    let rule = "classes = ['cup']\nmin_score = 0.5\nfactor = { type = 'vertical_orientation' }";
    let found =
        judged(rule, &[object(1, "cup", 0.8, 0.0), object(2, "cup", 0.4, 1.0), object(3, "bowl", 0.9, 2.0)]);
    assert_eq!(found.iter().map(|v| v.entries.len()).collect::<Vec<_>>(), [1, 0, 0]);
    assert_eq!(found[0].applied[0].because, "cup, score 0.80 (at least 0.5)");
    assert_eq!(found[1].left_out[0].because, "score 0.40, not at least 0.5");
    // a rule for other classes is not reported
    assert!(found[2].left_out.is_empty());
}

#[test]
fn a_size_decides_from_both_sides() {
    let objects = [object(1, "cup", 0.8, 0.0)];
    let count = |bounds: &str| {
        let rule = format!("classes = ['*']\n{bounds}\nfactor = {{ type = 'vertical_orientation' }}");
        judged(&rule, &objects)[0].entries.len()
    };
    assert_eq!((count("min_size_m = 0.4"), count("max_size_m = 0.6")), (1, 1));
    assert_eq!((count("min_size_m = 0.6"), count("max_size_m = 0.4")), (0, 0));
}

#[test]
fn what_is_near_is_the_second_object_and_each_pair_is_connected_once() {
    let rule =
        "classes = ['book']\nnear = { classes = ['book'], within_m = 0.5 }\nfactor = { type = 'parallel' }";
    let objects = [object(1, "book", 0.8, 0.0), object(2, "book", 0.8, 0.5), object(3, "book", 0.8, 2.0)];
    let found = judged(rule, &objects);
    assert_eq!(keys(&found[0]), [["q1", "q2"]]);
    assert_eq!(found[0].applied[0].because, "book, 0.31 m from q2 (book)");
    assert_eq!(found[1].left_out[0].because, "the rule connects it with q1 already");
    assert_eq!(found[2].left_out[0].because, "no book within 0.5 m: the nearest is q2, 1.30 m away");
}

#[test]
fn what_is_below_may_carry_and_what_is_near_may_be_a_condition_alone() {
    let on = "classes = ['cup']\nnear = { within_m = 0.5, below = true }\nfactor = { type = 'on_object' }";
    let objects = [object(1, "book", 0.8, 0.0), object(2, "cup", 0.8, 0.3), object(3, "book", 0.8, 0.31)];
    assert_eq!(keys(&judged(on, &objects)[1]), [["q2", "q1"]]);
    let alone =
        "classes = ['cup']\nnear = { classes = ['laptop'], within_m = 9.0 }\nfactor = { type = 'upright' }";
    assert_eq!(judged(alone, &objects)[1].left_out[0].because, "no laptop within 9 m: none is mapped");
    let three = "classes = ['cup']\nnear = { within_m = 9.0 }\nfactor = { type = 'collinear' }";
    assert_eq!(keys(&judged(three, &objects)[1]), [["q2", "q3", "q1"]]);
}

#[test]
fn a_variable_of_the_document_is_connected_with_each_object() {
    let rule = "classes = ['*']\nwith = ['table']\nfactor = { type = 'supporting_plane' }";
    assert_eq!(keys(&judged(rule, &[object(1, "cup", 0.8, 0.0)])[0]), [["q1", "table"]]);
}

#[test]
fn a_doubtful_class_does_not_get_its_factor_at_full_weight() {
    let rule = |mixture: &str| {
        format!(
            "classes = ['chair']\n{mixture}\nfactor = {{ type = 'vertical_orientation_smooth' }}\nnoise = {{ sigma = 0.1 }}"
        )
    };
    let mut doubtful = object(1, "box", 0.4, 0.0);
    let class = doubtful.class.as_mut().unwrap();
    (class.share, class.others) = (0.6, [("chair".to_owned(), 0.4)].into_iter().collect());
    // lying: wrong by 10 σ if it is a chair
    doubtful.start.semi_axes = Vector3::new(0.3, 0.1, 0.1);
    assert!(judged(&rule(""), std::slice::from_ref(&doubtful))[0].entries.is_empty());
    let cost = |share: f64| {
        let mut object = doubtful.clone();
        object.class.as_mut().unwrap().others["chair"] = share;
        let entry = judged(&rule("mixture = true"), &[object.clone()])[0].entries[0].clone();
        let r = entry.factor.erased().residual(&[&object.start]).unwrap();
        0.5 * r.iter().map(|r| r * r).sum::<f64>()
    };
    // 50 at full weight; ½ 3² + ln(p / (1 - p)) if the object is not a chair
    assert!((cost(0.5) - 4.5).abs() < 1e-9);
    assert!((cost(0.4) - 4.5 - (0.4f64 / 0.6).ln()).abs() < 1e-9);
    let because = &judged(&rule("mixture = true"), &[doubtful])[0].applied[0].because;
    assert_eq!(because, "40 % of its scores, most for box");
}

#[test]
fn gravity_reaches_the_components_of_a_mixture() {
    let rule = "classes = ['*']\nfactor = { type = 'max_mixture', components = [{ weight = 1.0, factor = { type = 'upright' } }, \
                { weight = 1.0, factor = { type = 'upright', axis = 'x', up = [1.0, 0.0, 0.0] } }] }";
    let rule = rules(rule).unwrap().swap_remove(0);
    assert!(rule.factor.wants_up() && rule.factor.instantiate(None).is_err());
    let up = Direction::new([0.0, -1.0, 0.0].into()).unwrap();
    let text = serde_json::to_string(&rule.factor.instantiate(Some(up)).unwrap()).unwrap();
    assert!(text.contains("[0.0,-1.0,0.0]") && text.contains("[1.0,0.0,0.0]"), "{text}");
}

#[test]
fn a_rule_that_cannot_be_applied_says_why_and_where() {
    let refused = |rule: &str| rules(rule).unwrap_err();
    let two = refused("classes = ['cup']\nfactor = { type = 'beside' }");
    assert!(two.contains("`beside` connects objects, and the rule does not say which"), "{two}");
    let none = refused("classes = ['cup']\nfactor = { type = 'supporting_plane' }");
    assert!(
        none.contains("besides objects `supporting_plane` connects a `plane`, found 0 in `with`"),
        "{none}"
    );
    let unknown = refused("classes = ['cup']\nwith = ['tabel']\nfactor = { type = 'supporting_plane' }");
    assert!(
        unknown.contains("unknown variable `tabel`") && unknown.contains("did you mean `table`"),
        "{unknown}"
    );
    let wrong = refused("classes = ['cup']\nwith = ['table']\nfactor = { type = 'upright_along' }");
    assert!(wrong.contains("takes a variable of type `s2` here, `table` is of type `plane`"), "{wrong}");
    let noise = refused("classes = ['cup']\nfactor = { type = 'upright' }\nnoise = { sigmas = [1.0, 1.0] }");
    assert!(noise.contains("rules.toml:5:9"), "{noise}");
    let score = refused("classes = ['cup']\nmin_score = 5.0\nfactor = { type = 'upright' }");
    assert!(score.contains("a number from 0 to 1"), "{score}");
}

#[test]
fn a_class_that_a_star_leaves_out_has_no_factor() {
    let rule = "classes = ['*']\nexcept = ['Cup']\nfactor = { type = 'vertical_orientation' }";
    let found = judged(rule, &[object(1, "cup", 0.8, 0.0), object(2, "bowl", 0.8, 1.0)]);
    assert_eq!(found.iter().map(|v| v.entries.len()).collect::<Vec<_>>(), [0, 1]);
    assert!(found[0].left_out.is_empty());
}

fn sizes(sizes: &str) -> Result<Vec<SemanticRule>, String> {
    read(&format!("{TABLE}sizes = {sizes}"))
}

#[test]
fn a_size_is_a_rule_with_a_size_prior() {
    let rules = sizes("[{ classes = ['cup'], size_m = [0.1, 0.2, 0.3], spread = 2.0 }]").unwrap();
    assert_eq!(rules.len(), 1);
    assert!(rules[0].applies("cup", &ClassAliases::default()) && !rules[0].optional);
    assert_eq!(rules[0].noise, Noise::sigma(2.0f64.ln()).unwrap());
    let entry = rules[0].entry(vec!["q1".into()], None, 1.0).unwrap();
    let factor = serde_json::to_value(&entry.factor).unwrap();
    assert_eq!(factor["type"], "size_prior");
    // s² = a² + (2/π) a (b + c) for half extents of 0.05, 0.1 and 0.15 m
    let shortest = (0.05f64.powi(2) + std::f64::consts::FRAC_2_PI * 0.05 * 0.25).sqrt();
    assert!((factor["semi_axes"][0].as_f64().unwrap() - shortest).abs() < 1e-12, "{factor}");
    let written = serde_json::to_value(&rules[0]).unwrap();
    assert_eq!(written["factor"]["type"], "size_prior");
}

#[test]
fn the_household_table_gives_no_warning_about_classes_without_objects() {
    let rules = sizes("'household'").unwrap();
    assert!(rules.len() > 30 && rules.iter().all(|rule| rule.optional));
    let of = |class: &str| rules.iter().filter(|rule| rule.applies(class, &ClassAliases::default())).count();
    assert_eq!([of("cup"), of("tv monitor"), of("zebra")], [1, 1, 0]);
}

#[test]
fn wrong_sizes_are_refused_at_their_place() {
    let refused = |row: &str| sizes(&format!("[\n{{ {row} }}]")).unwrap_err();
    for (row, expected) in [
        ("classes = ['cup'], size_m = [0.1, -0.2, 0.3], spread = 1.5", "rules.toml:3:37: expected a length"),
        ("classes = ['cup'], size_m = [0.1, 0.2], spread = 1.5", "rules.toml:3:"),
        ("classes = ['cup'], size_m = [0.1, 0.2, 0.3], spread = 0.5", "expected a factor above 1"),
        ("classes = ['cup'], size_m = [0.1, 0.2, 0.3]", "missing field `spread`"),
        ("classes = ['cup'], size = [0.1, 0.2, 0.3], spread = 1.5", "unknown field `size`"),
        ("size_m = [0.1, 0.2, 0.3], spread = 1.5", "missing field `classes`"),
    ] {
        let told = refused(row);
        assert!(told.contains(expected), "{row}: {told}");
    }
    let unknown = sizes("'houshold'").unwrap_err();
    assert!(unknown.contains("unknown sizes `houshold`"), "{unknown}");
    assert!(sizes("3").unwrap_err().contains("an array of sizes"));
    assert!(sizes("'nowhere.toml'").unwrap_err().contains("nowhere.toml"));
}
