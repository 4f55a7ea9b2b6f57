//! Texts of the error messages, for review.
use manifactor_expression::{Constant, Expression};
use manifactor_geometry as _;
use manifactor_quadric as _;

/// Error message of a formula over `q`, an object, and `x`, a pose.
fn says(formula: &str) -> String {
    let variables = [("q", "dual_quadric"), ("x", "se3")];
    Expression::new(variables, [formula]).map(|_| "nothing".to_owned()).unwrap_or_else(|e| e.to_string())
}

macro_rules! messages {
    ($($name:ident: $formula:expr => $message:expr);+ $(;)?) => { $(
        #[test]
        fn $name() {
            assert_eq!(says($formula), $message.trim_start_matches('\n'));
        }
    )+ };
}

messages! {
    a_function_that_nobody_knows: "1 - abs(dto(major_axis(q), up))" => "
unknown function `dto`
  1 - abs(dto(major_axis(q), up))
          ^^^
did you mean `dot`?";
    a_function_like_no_other: "frobnicate(q)" => "
unknown function `frobnicate`
  frobnicate(q)
  ^^^^^^^^^^
`manifactor explain expression` lists all functions";
    a_name_that_nobody_knows: "dot(major_axis(q), upp)" => "
unknown name `upp`
  dot(major_axis(q), upp)
                     ^^^
did you mean `up`? there are q, x, up, pi";
    a_function_without_its_arguments: "norm * 2" => "
`norm` is a function
  norm * 2
  ^^^^
write norm(v)";
    a_variable_that_is_called: "q(1)" => "
`q` is a variable, not a function
  q(1)
  ^
`manifactor explain expression` lists all functions";
    an_argument_of_the_wrong_type: "1 - dot(major_axis(q), 3)" => "
`dot` takes a vector3 here, found a number
  1 - dot(major_axis(q), 3)
                         ^
there is dot(a: vector3, b: vector3) -> number";
    an_object_where_a_pose_is_taken: "norm(position(q))" => "
`position` takes an se2 or an se3 or a sim3 here, found a dual_quadric
  norm(position(q))
                ^
there is position(x: se2) -> vector2, position(x: se3) -> vector3, position(x: sim3) -> vector3; what takes a dual_quadric: centroid, extent, major_axis, pose, rotation, semi_axes";
    too_few_arguments: "1 - dot(up)" => "
`dot` takes 2 arguments, found 1
  1 - dot(up)
      ^^^^^^^
there is dot(a: vector2, b: vector2) -> number, dot(a: vector3, b: vector3) -> number, dot(a: vector6, b: vector6) -> number";
    a_number_and_a_vector: "1 + major_axis(q)" => "
`+` is not defined between a number and a vector3
  1 + major_axis(q)
  ^^^^^^^^^^^^^^^^^
a number goes with a number, a vector with a vector of the same length";
    a_product_of_two_vectors: "major_axis(q) * up" => "
`*` is not defined between a vector3 and a vector3
  major_axis(q) * up
  ^^^^^^^^^^^^^^^^^^
write dot(a, b), cross(a, b), or multiply(a, b) for component by component";
    a_parenthesis_that_is_never_closed: "1 - abs(dot(major_axis(q), up)" => "
this `(` is never closed
  1 - abs(dot(major_axis(q), up)
         ^
a `)` is missing";
    a_parenthesis_that_was_never_opened: "1 - abs(dot(major_axis(q), up)))" => "
this `)` closes nothing
  1 - abs(dot(major_axis(q), up)))
                                 ^
take it out, or open it before";
    a_bracket_that_is_never_closed: "dot([0, 0, 1, major_axis(q))" => "
expected `,`, an operator or `]`, found `)`
  dot([0, 0, 1, major_axis(q))
                             ^
a `[` before it is still open";
    a_value_that_is_missing: "1 - " => "
the formula ends where a value is expected
  1 - 
      ^";
    two_operators_in_a_row: "1 * / x" => "
unexpected `/`
  1 * / x
      ^
expected a number, a name, a call such as `norm(v)`, a vector such as `[0, 0, 1]`, or `(`";
    a_sign_that_means_nothing: "dot(up, major_axis(q)) $ 2" => "
expected an operator or the end of the formula, found `$`
  dot(up, major_axis(q)) $ 2
                         ^
operators are + - * / ^";
    a_component_by_a_dot: "major_axis(q).x" => "
unexpected `.`
  major_axis(q).x
               ^
write `x(v)` for the x of a vector v";
    no_formula: "  " => "
the formula is empty
    
  ^^
expected one such as `norm(v) - 1`";
    a_constant_that_is_no_number: "norm(position(x)) - sqrt(-1)" => "
this is not a finite number
  norm(position(x)) - sqrt(-1)
                      ^^^^^^^^";
    a_number_too_large: "norm(position(x)) - 1e999" => "
`1e999` is not a finite number
  norm(position(x)) - 1e999
                      ^^^^^";
    a_formula_of_constants: "dot(up, [0, 0, 1]) - 1" => "
this formula is constant
  dot(up, [0, 0, 1]) - 1
  ^^^^^^^^^^^^^^^^^^^^^^
a residual depends on variables: q, x";
    a_residual_that_is_no_vector: "rotation(q)" => "
a residual is a number or a vector, this is of the type so3
  rotation(q)
  ^^^^^^^^^^^
what takes an so3: between, inverse, log, pose, x_axis, y_axis, z_axis";
    an_exponent_that_varies: "2 ^ norm(position(x))" => "
the exponent has to be constant
  2 ^ norm(position(x))
      ^^^^^^^^^^^^^^^^^
with a variable exponent, write exp(b * ln(a))";
    a_variable_without_use: "norm(position(x)) - 1" => "
the residual does not depend on `q`
  q
  ^
use it, or take it out of the variables";
}

#[test]
fn types_and_names_are_checked_too() {
    let says = |variables: &[(&'static str, &'static str)], formula: &str| {
        Expression::new(variables.iter().copied(), [formula]).unwrap_err().to_string()
    };
    let unknown = says(&[("q", "dual_quadrik")], "norm(q)");
    assert_eq!(
        unknown,
        "unknown type of variables `dual_quadrik`\n  dual_quadrik\n  ^^^^^^^^^^^^\n\
         did you mean `dual_quadric`? there are dual_quadric, point1, point2, point3, se2, se3, sim3, so2, so3"
    );
    let taken = says(&[("up", "point3")], "norm(up)");
    assert_eq!(taken, "`up` means something already: choose another name\n  up\n  ^^");
    let no_name = says(&[("2d", "point3")], "norm(up)");
    assert_eq!(no_name, "`2d` is not a name: expected letters, digits and `_`\n  2d\n  ^^");
    assert_eq!(
        says(&[], "norm(up)"),
        "expected 1 to 32 variables, such as variables = { q = \"dual_quadric\" }, found 0"
    );
}

#[test]
fn a_residual_has_one_row_at_least_and_not_too_many() {
    let says = |residual: &[&'static str]| {
        Expression::new([("x", "se3")], residual.iter().copied()).unwrap_err().to_string()
    };
    assert_eq!(
        says(&[]),
        "`residual` is empty: expected at least one formula, such as \"norm(position(x)) - 1\""
    );
    assert_eq!(
        says(&["log(x)"; 9]),
        "`residual`: expected a residual of 1 to 48 rows, got 54; a longer one can be split over several factors"
    );
}

#[test]
fn constants_are_checked() {
    let says = |name, constant| {
        let residual = ["norm(position(x)) - 1"];
        Expression::with_constants([("x", "se3")], [(name, constant)], residual).unwrap_err().to_string()
    };
    for (name, constant, message) in [
        ("x", Constant::Number(1.0), "`x` is a variable and a constant: rename one of them\n  x\n  ^"),
        ("c", Constant::Number(f64::NAN), "the constant `c`: it is not finite\n  c\n  ^"),
        (
            "c",
            Constant::Vector(vec![1.0]),
            "the constant `c`: expected a vector of 2, 3 or 6 numbers, found one of 1\n  c\n  ^",
        ),
        ("pi", Constant::Number(3.0), "`pi` means something already: choose another name\n  pi\n  ^^"),
    ] {
        assert_eq!(says(name, constant), message);
    }
}

/// Error message of a formula over `x`, a pose, with a named part.
fn says_of_part(name: &str, part: &str, residual: &str) -> String {
    let define: std::collections::BTreeMap<_, _> = [(name, part)].into();
    let document =
        serde_json::json!({ "variables": { "x": "se3" }, "define": define, "residual": [residual] });
    serde_json::from_value::<Expression>(document).map_or_else(|e| e.to_string(), |_| "nothing".to_owned())
}

#[test]
fn parts_of_formulas_are_checked() {
    assert_eq!(says_of_part("p", "position(x)", "norm(p) - 1"), "nothing");
    assert_eq!(
        says_of_part("p", "postion(x)", "norm(p)"),
        "unknown function `postion`\n  postion(x)\n  ^^^^^^^\ndid you mean `position`?"
    );
    assert!(
        says_of_part("x", "position(x)", "norm(x)").starts_with("`x` is a variable or a constant already")
    );
    assert!(says_of_part("up", "position(x)", "norm(up)").starts_with("`up` means something already"));
    assert!(says_of_part("a b", "position(x)", "1").starts_with("`a b` is not a name"));
    assert!(says_of_part("p", "position(x)", "norm(q)").contains("there are x, up, pi, p"));
}
