//! `manifactor check`: documents, and findings at their values.
use crate::{Ran, folder, manifactor, path};

fn check(name: &str, text: &str) -> Ran {
    let folder = folder(&[(name, text)]);
    manifactor(&format!("check {}", path(&folder, name)))
}

const PAIR: &str = r#"
[[variables]]
key = "x0"
value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }

[[variables]]
key = "x1"
value = { type = "se2", translation = [1.0, 0.0], angle = 0.0 }

[[factors]]
keys = ["x0", "x1"]
name = "a step"
factor = { type = "between_se2", relative = { translation = [1.0, 0.0], angle = 0.0 } }
"#;

#[test]
fn a_gauge_that_nothing_holds_and_a_variable_that_nothing_touches_are_told() {
    let ran = check("pair.toml", PAIR).ended(0);
    assert!(ran.stdout.contains("nothing wrong with the document; 1 warning"), "{}", ran.stdout);
    ran.complains(
        "at these values, nothing constrains the position and orientation of the whole; fix one pose",
    );
    let alone = "[[variables]]\nkey = \"l\"\nvalue = { type = \"point2\", position = [0.0, 0.0] }\n";
    check("alone.toml", &(PAIR.to_owned() + alone)).ended(0).complains("no factor that takes part touches l");
    let held =
        PAIR.replacen("angle = 0.0 }\n\n[[variables]]", "angle = 0.0 }\nfixed = true\n\n[[variables]]", 1);
    let ran = check("held.toml", &held).ended(0);
    assert!(ran.stdout.contains("nothing wrong.\n") && ran.stderr.is_empty(), "{}{}", ran.stdout, ran.stderr);
}

#[test]
fn a_point_that_is_seen_from_one_place_is_told() {
    let mut text = String::new();
    for key in ["x0", "x1"] {
        text += &format!(
            "[[variables]]\nkey = \"{key}\"\nfixed = true\n\
             value = {{ type = \"se3\", translation = [0.0, 0.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] }}\n\
             [[factors]]\nkeys = [\"{key}\", \"l0\"]\nfactor = {{ type = \"projection\", pixel = [320.0, 240.0], camera = \
             {{ fx = 500.0, fy = 500.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }} }}\n"
        );
    }
    text += "[[variables]]\nkey = \"l0\"\nvalue = { type = \"point3\", position = [0.0, 0.0, 4.0] }\n";
    check("point.toml", &text).ended(0).complains("at these values, nothing constrains l0.z");
    // two such points do not move as a whole, because the poses are fixed; but the scale about them is free
    let second = text.replace("[\"x0\", \"l0\"]", "[\"x0\", \"l1\"]").replace("key = \"l0\"", "key = \"l1\"");
    let second = &second[second.find("[[factors]]").unwrap()..];
    let second = second.split("[[variables]]\nkey = \"x1\"").next().unwrap().to_owned()
        + "[[variables]]\nkey = \"l1\"\nvalue = { type = \"point3\", position = [0.0, 0.0, 4.0] }\n";
    let both = check("points.toml", &(text + &second)).ended(0);
    both.complains("l0.z by 1.00");
    assert!(!both.stderr.contains("position"), "{}", both.stderr);
}

#[test]
fn what_is_not_finite_or_not_defined_at_the_start_is_told() {
    let formula = |residual: &str| {
        format!(
            "[[variables]]\nkey = \"p\"\nvalue = {{ type = \"point1\", position = [-1.0] }}\n[[factors]]\nkeys = [\"p\"]\n\
             name = \"the root\"\nfactor = {{ type = \"expression\", variables = {{ p = \"point1\" }}, residual = [\"{residual}\"] }}\n"
        )
    };
    check("nan.toml", &formula("sqrt(p)"))
        .ended(1)
        .complains("factor 0 the root (p) is not finite at these values");
    check("finite.toml", &formula("p - 1")).ended(0);
}

#[test]
fn other_units_and_another_order_of_quaternions_are_told() {
    let quadric = "variables = [{ key = \"q0\", value = { type = \"dual_quadric\", translation = [0.0, 0.0, 900.0], \
                   rotation = [0.0, 0.0, 0.0, 1.0], semi_axes = [100.0, 100.0, 150.0] } }]\nfactors = []\n";
    check("mm.toml", quadric)
        .ended(0)
        .complains("q0; the unit of semi-axes is metres; are these millimetres?");
    let edge = |i: u32, x: f64, xyzw: &str| {
        format!("EDGE_SE3:QUAT {i} {} {x} 0 0 {xyzw} 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n", i + 1)
    };
    let graph = |x: f64, xyzw: &str| (0..4).map(|i| edge(i, x, xyzw)).collect::<String>();
    check("wxyz.g2o", &graph(0.5, "0.995 0 0 0.0998749217771909")).ended(0).complains("are these w x y z?");
    check("mm.g2o", &graph(500.0, "0 0 0 1")).ended(0).complains("are these millimetres?");
    let ran = check("sound.g2o", &graph(0.5, "0 0 0 1")).ended(0);
    assert!(!ran.stderr.contains("are these"), "{}", ran.stderr);
}

#[test]
fn an_experiment_is_known_and_its_trials_are_counted() {
    let ran = manifactor("check examples/experiments/simulation/choices.toml").ended(0);
    assert!(ran.stdout.contains("An experiment of "), "{}", ran.stdout);
    manifactor("check examples/experiments/simulation/choices.toml --set base=\"nowhere.toml\"").ended(3);
}

#[test]
fn a_camera_and_a_noise_are_told_by_their_fields_and_rows() {
    let camera = |camera: &str| {
        check("run.toml", &format!("[source]\ntype = \"recorded\"\nfolder = \".\"\ncamera = {camera}\n"))
            .ended(2)
    };
    camera("{ fx = 500.0, fy = 500.0, cx = 320.0, cy = 240.0, width = 640, hight = 480 }")
        .complains("unknown field `hight`");
    camera("{ fx = 500.0, fy = 500.0, cx = 320.0, cy = 240.0, width = 640 }")
        .complains("missing field `height`");
    camera("\"kinect\"").complains("`kinect`");
    camera("3").complains("the name of a camera, or a table of its fx, fy, cx, cy, width and height");
    let noise = PAIR.to_owned() + "noise = { sigmas = [0.1, 0.2] }\n";
    check("noise.toml", &noise).ended(2).complains("the noise has 2 rows, the residual 3 (x, y, theta)");
}
