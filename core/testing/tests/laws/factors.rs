//! Each flaw of a factor breaks the Jacobian law, with a message that names the flaw.
use crate::dynamic::Chain;
use crate::toy::*;
use manifactor_graph::catalogue::find;
use manifactor_testing::catalogue::{documentation_law, factor_law, manifold_law};
use manifactor_testing::strategies::vector;
use manifactor_testing::{Each, FactorCheck, LawError, Subject, invariance_law, jacobian_law, jacobian_laws};
use proptest::prelude::*;

fn spot() -> impl Strategy<Value = Spot> {
    vector::<2>(10.0).prop_map(Spot)
}
fn area() -> impl Strategy<Value = Area> {
    (-5.0..5.0).prop_map(|area| Area { area })
}

jacobian_laws! {
    a_sound_factor_keeps_the_law: (area(), spot(), spot());
    a_factor_that_is_known_at_run_time_keeps_the_law: (spot(), spot(), spot(), spot())
        .prop_map(|(a, b, c, d)| (Chain::from(4), a, b, c, d));
    a_factor_of_any_number_of_variables_keeps_the_law:
        proptest::collection::vec(spot(), 1..12).prop_map(|spots| (Spread {}, Each(spots)));
}

fn spots<const S: u8>() -> (Spot<S>, Spot<S>) {
    (Spot([1.0, 2.0].into()), Spot([3.0, 4.0].into()))
}

#[test]
fn a_wrong_entry_is_named_by_variable_and_direction() {
    let (a, b) = spots::<SOUND>();
    let error = jacobian_law(&Area::<WRONG_SIGN> { area: 0.5 }, &[&a, &b]).unwrap_err();
    let expected = "analytic against automatic Jacobian: row 0 by `spot.y`, variable 1, is -1 and should be 1\n  \
                    factor {\"type\":\"area_of_wrong_sign\",\"area\":0.5}\n  \
                    at [{\"type\":\"spot\",\"x\":1.0,\"y\":2.0}, {\"type\":\"spot\",\"x\":3.0,\"y\":4.0}]";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_block_that_is_not_written_is_found() {
    let (a, b) = spots::<SOUND>();
    let error = jacobian_law(&Area::<UNWRITTEN_BLOCK> { area: 0.5 }, &[&a, &b]).unwrap_err();
    assert!(matches!(error, LawError::Jacobian { variable: 1, found, .. } if found.is_nan()), "{error}");
}

#[test]
fn a_wrong_seed_is_found_by_differences() {
    let (a, b) = spots::<DOUBLED_SEED>();
    // the analytic Jacobian is right, the automatic one is wrong
    let error = jacobian_law(&Area::<SOUND, DOUBLED_SEED> { area: 0.5 }, &[&a, &b]).unwrap_err();
    assert!(matches!(error, LawError::Jacobian { direction: "y", .. }), "{error}");
}

#[test]
fn another_residual_beside_the_jacobian_is_found() {
    let (a, b) = spots::<SOUND>();
    let error = jacobian_law(&Area::<OTHER_RESIDUAL> { area: 0.5 }, &[&a, &b]).unwrap_err();
    assert!(matches!(error, LawError::Residual { law: "residual of linearize", .. }), "{error}");
}

#[test]
fn nothing_to_check_is_said() {
    let (a, b) = spots::<SOUND>();
    let error = jacobian_law(&Area::<NEVER_DEFINED> { area: 0.5 }, &[&a, &b]).unwrap_err();
    assert!(matches!(error, LawError::NotDefined { .. }), "{error}");
    let error = jacobian_law(&Area::<SOUND> { area: 0.5 }, &[&a]).unwrap_err();
    assert!(matches!(error, LawError::WrongVariables { .. }), "{error}");
}

#[test]
fn what_changes_the_residual_is_no_invariance() {
    let ((a, b), factor) = (spots::<SOUND>(), Area::<SOUND> { area: 0.5 });
    // shearing b along a does not change the area
    let sheared = Spot::<SOUND>(b.0 + a.0 * 3.0);
    assert_eq!(invariance_law(&factor, &[&a, &b], &[&a, &sheared]), Ok(()));
    let error = invariance_law(&factor, &[&a, &b], &[&a, &Spot::<SOUND>([3.0, 4.1].into())]).unwrap_err();
    assert!(matches!(error, LawError::Residual { row: 0, .. }), "{error}");
}

#[test]
fn a_wrong_sign_is_shown_at_the_simplest_point_as_the_book_says() {
    let around: [Box<dyn manifactor_graph::Variable>; 2] = {
        let (a, b) = spots::<SOUND>();
        [Box::new(a), Box::new(b)]
    };
    let factor = std::sync::Arc::new(Area::<WRONG_SIGN> { area: 0.5 });
    let keys = vec!["a".to_owned(), "b".to_owned()];
    let report = FactorCheck::default().run(&Subject { factor, keys, around: around.into() });
    let text = report.to_string();
    let page = include_str!("../../../../docs/mistakes.md");
    assert!(!report.holds() && page.contains(text.lines().next().unwrap()), "{text}");
    assert!(text.contains("[[factors]]\nkeys = [\"a\", \"b\"]"), "{text}");
}

#[test]
fn what_is_free_and_what_jumps_is_named_by_variable_and_direction() {
    let report = factor_law(find("factor", "area").unwrap(), 64).unwrap();
    assert_eq!((report.rank, report.directions, report.free.len()), (2, 4, 1));
    assert_eq!(report.free[0].count, 2);
    assert!(report.kinks.is_empty() && report.worst.is_some());
}

#[test]
fn a_jump_is_found_where_no_point_was_drawn() {
    let report = factor_law(find("factor", "step").unwrap(), 64).unwrap();
    let [jump] = report.kinks.as_slice() else { panic!("{report}") };
    assert!(
        (jump.jump - 0.25).abs() < 1e-6 && jump.rows == [0] && jump.directions == ["spot_0.x"],
        "{report}"
    );
    let x = jump.at.pointer("/variables/0/value/x").and_then(serde_json::Value::as_f64);
    assert!((x.unwrap() - 2.0).abs() < 1e-6, "{}", jump.at);
}

#[test]
fn the_catalogue_is_enough_to_check_a_type() {
    let factor = |name| find("factor", name).unwrap();
    assert_eq!(factor_law(factor("area"), 32).unwrap().defined, 32);
    assert_eq!(factor_law(factor("spread"), 32).unwrap().defined, 32);
    assert!(manifold_law(find("variable", "spot").unwrap(), 32).unwrap().seed_error < Some(1e-9));
    documentation_law(factor("area")).unwrap();
    // the flawed factors share a doc comment, and its example names a different factor
    let error = documentation_law(factor("area_of_wrong_sign")).unwrap_err().to_string();
    let expected = "factor `area_of_wrong_sign`: its example has no table with type = \"area_of_wrong_sign\"";
    assert_eq!(error, expected);
}
