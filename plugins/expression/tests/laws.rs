//! Formulas obey the laws of all factors, and every function agrees with its derivative.
use manifactor_expression::{Constant, Expression};
use manifactor_geometry::testing::{any_point3, any_se2, any_se3};
use manifactor_geometry::{Between, Se3};
use manifactor_graph::quantity::{Function, LANES, Lanes, functions};
use manifactor_graph::{Direction, Factor, Jet};
use manifactor_quadric::testing::{any_quadric, unequal_quadric};
use manifactor_quadric::{HorizontalOrientation, VerticalOrientation, VerticalOrientationSmooth};
use manifactor_testing::strategies::direction;
use manifactor_testing::{check, differentiate, jacobian_law, jacobian_laws};
use proptest::prelude::*;

fn formula(variables: &[(&'static str, &'static str)], residual: &[&'static str]) -> Expression {
    Expression::new(variables.iter().copied(), residual.iter().copied()).unwrap()
}

fn vertical() -> Expression {
    formula(&[("q", "dual_quadric")], &["1 - abs(dot(major_axis(q), up))"])
}

fn pose_and_object() -> Expression {
    let rows = [
        "log(between(rotation(x), rotation(q)))",
        "ln(semi_axes(q)) + 2 * up",
        "norm_squared(inverse(x) * p - centroid(q)) / 9",
    ];
    formula(&[("q", "dual_quadric"), ("x", "se3"), ("p", "point3")], &rows)
}

fn plane() -> Expression {
    let rows = ["between(a, b) * [1, 2] - [x(position(a)) ^ 2, 1]", "sin(angle(rotation(between(a, b))))"];
    formula(&[("a", "se2"), ("b", "se2")], &rows)
}

jacobian_laws! {
    the_paper_s_formula_agrees: unequal_quadric()
        .prop_filter("at the kink", |q| q.major_axis().z.abs() > 1e-4).prop_map(|q| (vertical(), q));
    several_variables_and_rows_agree: (any_quadric(), any_se3(), any_point3())
        .prop_filter("at the jump of log", |(q, x, _)| q.pose.rotation.between(&x.rotation).log().norm() < 3.0)
        .prop_map(|(q, x, p)| (pose_and_object(), q, x, p));
    formulas_in_the_plane_agree: (any_se2(), any_se2()).prop_map(|(a, b)| (plane(), a, b));
}

fn with_parts(document: serde_json::Value) -> Expression {
    serde_json::from_value(document).unwrap()
}

#[test]
fn a_part_that_has_a_name_is_the_formula_that_it_stands_for() {
    let parts = with_parts(serde_json::json!({
        "variables": { "x": "se3", "p": "point3" },
        "define": { "seen": "inverse(x) * p", "far": "norm(seen)" },
        "residual": ["seen / far - up", "where(far - 2, far, 2)"],
        "domain": ["far"],
    }));
    let long = with_parts(serde_json::json!({
        "variables": { "x": "se3", "p": "point3" },
        "residual": ["inverse(x) * p / norm(inverse(x) * p) - up", "where(norm(inverse(x) * p) - 2, norm(inverse(x) * p), 2)"],
    }));
    check((any_se3(), any_point3()), |(x, p)| {
        // No direction leads from the pose to a point at the same position.
        if parts.erased().is_defined(&[&x, &p]) == Some(true) {
            same(&parts, &long, &[&x, &p], 0.0);
        }
        Ok(())
    });
    let read: Expression = serde_json::from_str(&serde_json::to_string(&parts).unwrap()).unwrap();
    assert_eq!(serde_json::to_value(&read).unwrap(), serde_json::to_value(&parts).unwrap());
}

#[test]
fn formulas_that_differ_in_constants_are_told_apart() {
    let of = |offset: f64, up: [f64; 3]| {
        with_parts(serde_json::json!({
            "variables": { "p": "point3" },
            "residual": ["dot(p, up) - offset ^ 2 * 3", "norm(p) - sqrt(offset)"],
            "constants": { "offset": offset },
            "up": up,
        }))
    };
    let p = manifactor_geometry::Point3::new([1.0, 2.0, 2.0]);
    let residual = |factor: &Expression| factor.erased().residual(&[&p]).unwrap();
    assert_eq!(residual(&of(4.0, [0.0, 0.0, 1.0])), [2.0 - 48.0, 3.0 - 2.0]);
    assert_eq!(residual(&of(9.0, [0.0, 1.0, 0.0])), [2.0 - 243.0, 3.0 - 3.0]);
    // A value computed from this constant is not finite, although it was for the previous constants.
    let document = serde_json::json!({
        "variables": { "p": "point3" },
        "residual": ["dot(p, up) - offset ^ 2 * 3", "norm(p) - sqrt(offset)"],
        "constants": { "offset": -1.0 },
    });
    let error = serde_json::from_value::<Expression>(document).unwrap_err().to_string();
    assert!(
        error.contains("this is not a finite number") && error.contains("norm(p) - sqrt(offset)"),
        "{error}"
    );
    let plane = |of: &str| {
        let document = serde_json::json!({ "variables": { "p": of }, "residual": ["norm(p) - 1"] });
        let factor: Expression = serde_json::from_value(document).unwrap();
        factor.erased().signature().variables
    };
    assert_ne!(plane("point3"), plane("point2"));
}

/// Checks that residuals and Jacobians of both factors are equal.
fn same(
    formula: &Expression,
    factor: &dyn Factor,
    variables: &[&dyn manifactor_graph::Variable],
    tolerance: f64,
) {
    let (a, b) =
        (formula.erased().linearize(variables).unwrap(), factor.erased().autodiff(variables).unwrap());
    let close = |x: f64, y: f64| (x - y).abs() <= tolerance * (1.0 + y.abs());
    assert!(a.residual.iter().zip(&b.residual).all(|(x, y)| close(*x, *y)), "{a:?} {b:?}");
    for (j, k) in a.jacobians.iter().zip(&b.jacobians) {
        assert!(j.iter().zip(k.iter()).all(|(x, y)| close(*x, *y)), "{j} {k}");
    }
}

#[test]
fn the_built_in_factors_are_the_same_formulas() {
    let of = |text, up| formula(&[("q", "dual_quadric")], &[text]).with_up(up).unwrap();
    check((any_quadric(), direction()), |(q, up)| {
        let up = Direction::new(up.into_inner()).unwrap();
        same(
            &of("1 - abs(dot(major_axis(q), up))", up),
            &VerticalOrientation { up: up.into() },
            &[&q],
            1e-15,
        );
        same(
            &of("0 - abs(dot(major_axis(q), up))", up),
            &HorizontalOrientation { up: up.into() },
            &[&q],
            1e-15,
        );
        same(&of("cross(major_axis(q), up)", up), &VerticalOrientationSmooth { up: up.into() }, &[&q], 1e-15);
        Ok(())
    });
}

#[test]
fn a_relative_pose_may_be_a_constant() {
    let relative = Se3::exp(&[0.3, -0.2, 0.1, 1.0, 2.0, 3.0].into());
    let constants = [("z", Constant::Value(Box::new(relative)))];
    let variables = [("x", "se3"), ("y", "se3")];
    let between =
        Expression::with_constants(variables, constants, ["log(between(z, between(x, y)))"]).unwrap();
    check((any_se3(), any_se3()), |(x, y)| {
        if relative.between(&x.between(&y)).rotation.log().norm() < 3.0 {
            same(&between, &Between { relative }, &[&x, &y], 1e-9);
        }
        Ok(())
    });
}

#[test]
fn outside_of_its_domain_a_formula_takes_no_part() {
    let text = r#"{ "type": "expression", "variables": { "x": "se3", "p": "point3" }, "residual": ["project(inverse(x) * p)"],
                    "domain": ["z(inverse(x) * p)"] }"#;
    let factor: Box<dyn Factor> = serde_json::from_str(text).unwrap();
    check((any_se3(), any_point3()), |(x, p)| {
        let depth = x.inverse_act(&p).z;
        assert_eq!(factor.erased().is_defined(&[&x, &p]), Some(depth > 0.0));
        if depth > 0.1 { jacobian_law(&*factor, &[&x, &p]) } else { Ok(()) }
    });
}

/// Compares the derivatives from dual numbers with finite differences, over flat values.
fn agrees(function: &Function, point: &[f64]) {
    let mut places = vec![0];
    for (_, shape) in function.arguments {
        places.push(places[places.len() - 1] + shape.size as u32);
    }
    let value = |point: &[f64]| {
        let mut result = vec![0.0; function.result.size];
        (function.over_numbers)(point, &places, &mut result);
        result
    };
    for i in 0..places[places.len() - 1] as usize {
        let mut duals: Vec<Lanes> = point.iter().map(|x| Lanes::from(*x)).collect();
        let seed: [f64; LANES] = std::array::from_fn(|lane| if lane == 1 { 1.0 } else { 0.0 });
        duals[i] = Lanes::with_gradient(point[i], &seed);
        let mut result = vec![Lanes::from(0.0); function.result.size];
        (function.over_lanes)(&duals, &places, &mut result);
        let moved = |h: f64| {
            let mut moved = point.to_vec();
            moved[i] += h;
            Some(value(&moved))
        };
        let numeric = differentiate(result.len(), 1e-3, moved).unwrap();
        for (dual, numeric) in result.iter().zip(&numeric) {
            let found = dual.gradient().map_or(0.0, |g| g[1]);
            let error = (found - numeric.value).abs() / (1.0 + numeric.value.abs());
            assert!(
                error < 1e-6,
                "{} by entry {i} at {point:?}: {found}, {}",
                function.signature(),
                numeric.value
            );
        }
    }
}

#[test]
fn every_function_agrees_with_its_derivative() {
    let smooth = |f: &&Function| f.name != "^";
    let all: Vec<&Function> = functions().into_iter().filter(smooth).collect();
    assert!(all.len() > 80 && all.iter().any(|f| f.name == "extent"));
    // A range in which all functions are defined, including roots, logarithms and inverse trigonometric
    // functions.
    check(proptest::collection::vec(0.2..0.9f64, 32), |point| {
        all.iter().for_each(|function| agrees(function, &point));
        Ok(())
    });
}

#[test]
fn functions_are_told_apart_by_name_and_arguments() {
    let key = |f: &Function| (f.name, f.arguments.iter().map(|(_, shape)| *shape).collect::<Vec<_>>());
    for pair in functions().windows(2) {
        assert!(key(pair[0]) != key(pair[1]), "{} is registered twice", pair[0].signature());
    }
    for function in functions() {
        let summary = function.summary.trim();
        assert!(summary.len() > 3 && summary.ends_with('.'), "{}: {summary}", function.signature());
    }
}

#[test]
fn powers_of_negative_numbers_have_a_derivative() {
    let cube = formula(&[("p", "point3")], &["x(p) ^ 3 + y(p) ^ -1"]);
    check(any_point3().prop_filter("at the pole", |p| p.y.abs() > 0.1), |p| jacobian_law(&cube, &[&p]));
}
