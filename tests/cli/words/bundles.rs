//! `docs/bundles.md`: its document is solved, and the model of the example is solved, written and read again.
use super::block;
use crate::{folder, manifactor, path, root};
use std::fs;

#[test]
fn the_model_of_the_example_is_solved_and_written() {
    let folder = folder(&[]);
    let out = path(&folder, "refined");
    let ran = manifactor(&format!("solve examples/bundle --covariances=camera1 --out {out} --json")).ended(0);
    ran.complains("27 image points without a point in space: not used");
    let json = ran.json();
    let camera = &json["values"]["camera1"];
    // made with f = 700, k1 = -0.08 and noise of 0.5 px; other parameters are held
    let sigma = |i: usize| json["covariances"][0]["covariance"][i][i].as_f64().unwrap().sqrt();
    let off = [camera["f"].as_f64().unwrap() - 700.0, camera["distortion"][0].as_f64().unwrap() + 0.08];
    assert!(off[0].abs() < 3.0 * sigma(0) && off[1].abs() < 3.0 * sigma(3), "{camera}");
    assert_eq!((&camera["cx"], sigma(1)), (&320.0.into(), 0.0));
    let cost = json["final_cost"].as_f64().unwrap();
    let again = manifactor(&format!("solve {out} --json")).ended(0).json();
    assert!((again["initial_cost"].as_f64().unwrap() - cost).abs() < 1e-9 * cost, "{again}");
    let read = |folder: &str, file: &str| fs::read_to_string(format!("{folder}/{file}")).unwrap();
    let source = root().join("examples/bundle").display().to_string();
    let names = |text: String| text.lines().filter(|line| line.ends_with(".jpg")).count();
    assert_eq!(names(read(&out, "images.txt")), names(read(&source, "images.txt")));
    // the files of a model are not replaced
    manifactor(&format!("solve examples/bundle --out {out}")).ended(2).complains("has a model already");
    manifactor(&format!("solve examples/bundle --out {out} --force")).ended(0);
    fs::remove_file(format!("{out}/images.txt")).unwrap();
    manifactor(&format!("solve examples/bundle --out {out}"))
        .ended(2)
        .complains("cameras.txt exists already");
}

#[test]
fn a_free_gauge_and_a_loss_are_named() {
    let free = manifactor("solve examples/bundle --no-anchor").ended(0);
    assert!(
        free.stdout.contains("nothing constrains the position, orientation and scale of the whole"),
        "{}",
        free.stdout
    );
    let robust = manifactor("solve examples/bundle --loss cauchy --set loss.scale=2.0 --json").ended(0);
    robust.complains("every factor has the loss cauchy");
    let plain = manifactor("solve examples/bundle --json").ended(0).json();
    assert!(robust.json()["final_cost"].as_f64().unwrap() < plain["final_cost"].as_f64().unwrap());
    manifactor("solve examples/bundle --loss cauchi").ended(2).complains("did you mean `cauchy`?");
    manifactor("solve examples/03_relations/graph.toml --loss cauchy").ended(2).complains("its own loss");
}

#[test]
fn folders_that_are_no_text_model_are_refused() {
    let folder = folder(&[]);
    for (name, file, text) in
        [("binary", "images.bin", "x"), ("short", "images.txt", "1 1 0 0 0 0 0 0 1 a.jpg\n\n")]
    {
        fs::create_dir(folder.path().join(name)).unwrap();
        fs::write(folder.path().join(name).join(file), text).unwrap();
    }
    let refused = |name: &str| manifactor(&format!("solve {}", path(&folder, name)));
    refused("binary").ended(2).complains("--output_type TXT");
    refused("short").ended(3).complains("cameras.txt");
}

#[test]
fn a_document_estimates_the_focal_length_of_one_observation() {
    let document = block("bundles.md", "toml", "uncalibrated_radial");
    let folder = folder(&[("camera.toml", &document)]);
    let json = manifactor(&format!("solve {} --json", path(&folder, "camera.toml"))).ended(0).json();
    // the point is at (0.1, -0.05) on the plane at depth one, and its pixel 70 right of the centre and 35 above it
    let camera = &json["values"]["camera"];
    let k = camera["distortion"][0].as_f64().unwrap();
    let radial = 1.0 + 0.0125 * k;
    assert!((camera["f"].as_f64().unwrap() * radial - 700.0).abs() < 1e-3, "{camera}");
}

#[test]
fn a_document_estimates_the_offset_between_two_clocks() {
    let fixed = |key: &str, value: &str| {
        format!("[[variables]]\nkey = \"{key}\"\nvalue = {{ {value} }}\nfixed = true\n")
    };
    let pose = |x: f64| format!(r#"type = "se3", translation = [{x}, 0.0, 0.0], rotation = [0, 0, 0, 1]"#);
    let point = r#"type = "point3", position = [0.2, -0.1, 2.0]"#;
    let document = [
        fixed("x0", &pose(0.0)),
        fixed("x1", &pose(0.1)),
        fixed("p0", point),
        block("bundles.md", "toml", "interpolated"),
    ];
    let folder = folder(&[("clocks.toml", &document.concat())]);
    let json = manifactor(&format!("solve {} --json", path(&folder, "clocks.toml"))).ended(0).json();
    // the pixel is right of the centre by 0.07 of the depth, for a camera at x = 0.06
    let offset = json["values"]["offset"]["position"][0].as_f64().unwrap();
    assert!((offset - 0.02).abs() < 1e-9, "{json}");
}
