//! Scales, offsets and weights at the limits of robotics: a solve returns the scaled answer, or the reason
//! for its failure.
use manifactor::config::{Document, Format, read_graph};
use manifactor::geometry::{Between, Prior, Se2, Se3};
use manifactor::prelude::*;
use manifactor::solve::Auto;
use proptest::prelude::*;

/// Poses on a ring, with edges between neighbours and across, consistent except for a bias. Lengths are in
/// units of `unit` metres, and the ring is moved by `offset`.
fn ring(count: usize, unit: f64, offset: f64, sigma: impl Fn(usize) -> f64) -> (Graph, Values) {
    let pose = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / count as f64;
        let place = Vector3::new(angle.cos(), angle.sin(), 0.2 * (3.0 * angle).sin());
        Se3::new(manifactor::geometry::So3::exp(&Vector3::new(0.1 * angle, 0.0, angle)), place)
    };
    let scaled = |x: Se3, offset: f64| {
        let t = x.translation * unit + Vector3::new(offset, -offset, 0.5 * offset);
        Se3::new(x.rotation, t)
    };
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["x0"], Prior { value: scaled(pose(0), offset) }).noise(noise(1e-3, unit));
    for i in 0..count {
        let bend = Vector6::new(0.02, -0.01, 0.03, 0.05, 0.02, -0.04) * (i as f64 * 1.7).sin();
        values.insert(Key::indexed("x", i), scaled(pose(i).retract(&bend), offset));
        for step in [1, 3] {
            let j = (i + step) % count;
            let bias = Vector6::new(0.002, 0.001, -0.002, 0.004, -0.003, 0.002) * ((i * step) as f64).cos();
            let relative = pose(i).inverse().compose(&pose(j)).retract(&bias);
            let keys = [Key::indexed("x", i), Key::indexed("x", j)];
            graph.add(keys, Between { relative: scaled(relative, 0.0) }).noise(noise(sigma(i), unit));
        }
    }
    (graph, values)
}

/// Noise of a rotation and, in units, of a translation.
fn noise(sigma: f64, unit: f64) -> Noise {
    Noise::sigmas(&[sigma, sigma, sigma, sigma * unit, sigma * unit, sigma * unit]).unwrap()
}

fn solved(graph: &Graph, values: &Values) -> Solution {
    let solution = solve(graph, values, &Auto::default(), &mut Silent).unwrap();
    assert!(
        solution.values.iter().all(|(_, v)| v.erased().is_finite()),
        "{:?}",
        solution.outcome.termination
    );
    solution
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_graph_at_another_scale_has_the_scaled_answer(count in 5..30usize, exponent in -9..=9i32) {
        let unit = 10_f64.powi(exponent);
        let one = solved(&ring(count, 1.0, 0.0, |_| 0.01).0, &ring(count, 1.0, 0.0, |_| 0.01).1);
        let (graph, values) = ring(count, unit, 0.0, |_| 0.01);
        let other = solved(&graph, &values);
        prop_assert!(other.outcome.termination.is_converged(), "{:?}", other.outcome.termination);
        for i in 0..count {
            let key = Key::indexed("x", i);
            let (a, b): (&Se3, &Se3) = (one.values.get(&key).unwrap(), other.values.get(&key).unwrap());
            prop_assert!((a.translation - b.translation / unit).norm() < 1e-6);
            prop_assert!(a.rotation.local(&b.rotation).norm() < 1e-6);
        }
    }

    #[test]
    fn a_graph_a_thousand_kilometres_off_has_the_same_shape(count in 5..30usize, exponent in 0..=6i32) {
        let offset = 10_f64.powi(exponent);
        let (graph, values) = ring(count, 1.0, 0.0, |_| 0.01);
        let one = solved(&graph, &values);
        let (graph, values) = ring(count, 1.0, offset, |_| 0.01);
        let other = solved(&graph, &values);
        prop_assert!(other.outcome.termination.is_converged(), "{:?}", other.outcome.termination);
        let relative = |s: &Solution, i: usize| {
            let (a, b): (&Se3, &Se3) = (s.values.get("x0").unwrap(), s.values.get(Key::indexed("x", i)).unwrap());
            a.inverse().compose(b)
        };
        for i in 1..count {
            prop_assert!(relative(&one, i).local(&relative(&other, i)).norm() < 1e-6);
        }
    }

    #[test]
    fn weights_may_span_twelve_orders_of_magnitude(count in 5..30usize, seed in 0..1000usize) {
        // standard deviations from 1e-5 to 10: weights from 1e-2 to 1e10
        let (graph, values) = ring(count, 1.0, 0.0, |i| 10_f64.powi(((i * 31 + seed) % 7) as i32 - 5));
        let solution = solved(&graph, &values);
        match solution.outcome.termination {
            Termination::Converged { .. } => prop_assert!(solution.outcome.final_cost < solution.outcome.initial_cost),
            // the outcome has the reason, and the cost has not increased
            other => prop_assert!(solution.outcome.final_cost <= solution.outcome.initial_cost, "{other:?}"),
        }
    }

    #[test]
    fn any_finite_graph_ends_with_finite_values(
        numbers in prop::collection::vec(prop_oneof![-1e300..1e300f64, -1e-300..1e-300f64, -10.0..10.0f64], 9),
        sigma in prop_oneof![1e-150..1e150f64, 1e-3..1e3f64],
    ) {
        let pose = |n: &[f64]| Se2::exp(&Vector3::new(n[0], n[1], n[2] % 10.0));
        let (mut graph, mut values) = (Graph::new(), Values::new());
        values.insert("a", pose(&numbers[..3]));
        values.insert("b", pose(&numbers[3..6]));
        prop_assume!(values.iter().all(|(_, v)| v.erased().is_finite()));
        graph.add(["a"], Prior { value: Se2::identity() }).noise(Noise::sigma(sigma).unwrap());
        let relative = pose(&numbers[6..]);
        prop_assume!(relative.translation.iter().all(|x| x.is_finite()));
        graph.add(["a", "b"], Between { relative });
        solved(&graph, &values);
    }
}

/// A fit of a decay to measurements, without noise, at times from 0 to 5.
fn decay(scale: f64, tau: f64, residual: &str, start: [f64; 2], noise: &str) -> (Graph, Values) {
    let mut text = format!(
        "[[variables]]\nkey = \"a\"\nvalue = {{ type = \"point1\", position = [{:e}] }}\n\
         [[variables]]\nkey = \"b\"\nvalue = {{ type = \"point1\", position = [{:e}] }}\n",
        start[0], start[1]
    );
    for i in 0..11 {
        let t = 0.5 * f64::from(i);
        let measured = scale * (-t / tau).exp();
        let residual = residual.replace('T', &format!("{t:.1}"));
        text += &format!(
            "[[factors]]\nkeys = [\"a\", \"b\"]\n{noise}\nfactor = {{ type = \"expression\", \
             variables = {{ a = \"point1\", b = \"point1\" }}, residual = [\"{residual} - {measured:e}\"] }}\n"
        );
    }
    let document = Document::parse("decay.toml", text, Format::Toml).unwrap();
    read_graph(&document).unwrap()
}

fn number(values: &Values, key: &str) -> f64 {
    values.get::<manifactor::geometry::Point1>(key).unwrap().x
}

#[test]
fn values_in_small_units_are_fitted_as_others() {
    // currents of 40 pA in amperes, and a capacity of 0.47 pF in farads
    let current = decay(4e-11, 1.7, "a*exp(-T/b)", [1e-11, 1.0], "");
    let capacity = decay(3.3, 0.47, "a*exp(-T/(1e12*b))", [3.0, 1e-13], "noise = { sigma = 0.01 }");
    for ((graph, values), expected) in [(current, [4e-11, 1.7]), (capacity, [3.3, 4.7e-13])] {
        let solution = solved(&graph, &values);
        let termination = &solution.outcome.termination;
        assert!(termination.is_converged(), "{termination:?}");
        assert!(solution.outcome.undetermined.is_none(), "{:?}", solution.outcome.undetermined);
        for (key, expected) in ["a", "b"].into_iter().zip(expected) {
            let found = number(&solution.values, key);
            assert!((found / expected - 1.0).abs() < 1e-6, "{key}: {found}, not {expected}");
        }
    }
}

#[test]
fn a_cost_that_no_step_changes_hides_no_other() {
    let (mut graph, mut values) = ring(30, 1.0, 0.0, |_| 0.01);
    let expected = solved(&graph, &values).outcome.final_cost;
    for key in ["here", "there"] {
        values.insert(key, Se2::identity());
        graph.fix(key);
    }
    let far = Between { relative: Se2::exp(&Vector3::new(1e4, 0.0, 0.0)) };
    graph.add(["here", "there"], far).noise(Noise::sigma(1e-3).unwrap());
    let outcome = solved(&graph, &values).outcome;
    let others = outcome.final_cost - 0.5e14;
    assert!((others - expected).abs() < 0.1 + 0.01 * expected, "{others}, not {expected}");
}

#[test]
fn information_of_others_leaves_no_variable_open() {
    use manifactor::geometry::Point1;
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let point = |x: f64| Point1::new(Vector1::new(x));
    values.insert("a", point(0.5));
    values.insert("b", point(0.5));
    graph.add(["a"], Prior { value: point(1.0) }).noise(Noise::sigma(1.0).unwrap());
    graph.add(["b"], Prior { value: point(2.0) }).noise(Noise::sigma(1e-14).unwrap());
    let solution = solved(&graph, &values);
    assert!(solution.outcome.undetermined.is_none(), "{:?}", solution.outcome.undetermined);
    let mut problem = manifactor::solve::Problem::compile(&graph, &solution.values).unwrap();
    let covariance = problem.joint_covariance(&["a"]).unwrap();
    assert!((covariance[(0, 0)] - 1.0).abs() < 1e-9, "{covariance}");
}
