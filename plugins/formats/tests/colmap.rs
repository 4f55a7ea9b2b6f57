//! Models of COLMAP: reading, writing, and solving.
use manifactor_formats::colmap::{Camera, Image, ImagePoint, Lens, Model, Point};
use manifactor_formats::{FormatError, GraphFormat, GraphRead, InformationRepair, ReadOptions};
use manifactor_geometry::{CameraModel, Coordinates, Intrinsics, Radial, Se3, So3, UncalibratedModel};
use manifactor_graph::{Fixed, Graph, Key, Values};
use manifactor_solve::{Auto, GaussNewton, Optimizer, Silent, solve};
use nalgebra::{Vector2, Vector3, Vector5};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn wave(i: u64, k: u64) -> f64 {
    ((i * 37 + k * 61) as f64).sin()
}

/// Eight images of one camera on an arc, that see points on a bowl; the points of the model are off by `error`.
fn model(error: f64) -> Model {
    let lens = Radial::new([700.0, 320.0, 240.0, -0.05, 0.0], 640, 480).unwrap();
    let positions: Vec<_> =
        (0..40).map(|i| Vector3::new(2.0 * wave(i, 1), 2.0 * wave(i, 2), wave(i, 3))).collect();
    let mut images = vec![];
    let mut tracks = vec![vec![]; positions.len()];
    for i in 0..8 {
        let turn = So3::exp(&Vector3::new(0.02 * wave(i, 4), 0.2 * i as f64 - 0.7, 0.1 * wave(i, 5)));
        let pose = Se3::new(turn, turn.act(&Vector3::new(0.0, 0.0, -8.0)));
        // an image point without a point in space comes first
        let mut points =
            vec![ImagePoint { pixel: Coordinates::new(Vector2::new(1.0, 2.0)).unwrap(), point: None }];
        for (j, position) in positions.iter().enumerate().filter(|(j, _)| !(i as usize + j).is_multiple_of(4))
        {
            let noise = Vector2::new(wave(i, 100 + j as u64), wave(i, 200 + j as u64)) * 0.3;
            let pixel = Coordinates::new(lens.project(&pose.inverse_act(position)) + noise).unwrap();
            tracks[j].push((10 + i, points.len() as u64));
            points.push(ImagePoint { pixel, point: Some(500 + j as u64) });
        }
        let name = format!("a folder/image #{i}.jpg");
        images.push(Image { id: 10 + i, world_from_camera: pose, camera: 3, name, points });
    }
    let points = positions.iter().zip(tracks).zip(500..).map(|((position, track), id)| {
        let position = position + Vector3::new(wave(id, 6), wave(id, 7), wave(id, 8)) * error;
        Point { id, position, colour: [200, 100, 50], error: 0.5, track }
    });
    let lens = Lens::Radial(lens);
    let camera = Camera { id: 3, model: manifactor_formats::colmap::CameraModelName::SimpleRadial, lens };
    Model { cameras: vec![camera], images, points: points.collect() }
}

fn written(model: &Model) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in model.texts() {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Replaces a text in one of the files, and returns the mistakes.
fn mistakes(file: &str, from: &str, to: &str) -> String {
    let folder = written(&model(0.0));
    let path = folder.path().join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let error = Model::read(folder.path()).unwrap_err();
    assert!(matches!(error, FormatError::Malformed(_)), "{error}");
    error.to_string().replace(&*folder.path().to_string_lossy(), "")
}

#[test]
fn a_model_reads_back() {
    let model = model(0.0);
    let back = Model::read(written(&model).path()).unwrap();
    assert_eq!((back.cameras, back.points), (model.cameras, model.points));
    for (image, there) in back.images.iter().zip(&model.images) {
        assert!(image.world_from_camera.local_distance(&there.world_from_camera) < 1e-12);
        assert_eq!((&image.name, &image.points, image.camera), (&there.name, &there.points, there.camera));
    }
}

trait LocalDistance {
    fn local_distance(&self, other: &Self) -> f64;
}
impl LocalDistance for Se3 {
    fn local_distance(&self, other: &Self) -> f64 {
        self.between(other).log().norm()
    }
}

#[test]
fn images_share_the_intrinsics_of_their_camera() {
    let GraphRead { graph, values, notes } = model(0.1).graph(true);
    assert_eq!((graph.factors().len(), values.len()), (240, 1 + 8 + 40));
    assert!(graph.factors().iter().all(|entry| entry.keys[2].as_str() == "camera3"));
    let held = |key: &str| graph.fixed().get(&Key::from(key)).cloned();
    let directions =
        |names: &[&str]| Some(Fixed::Directions(names.iter().map(|n| (*n).to_owned()).collect()));
    assert_eq!(held("camera3"), directions(&["cx", "cy", "k2"]));
    assert_eq!(held("image10"), directions(&["rx", "ry", "rz", "x", "y", "z"]));
    assert!(notes.iter().any(|note| note.contains("8 image points without a point in space")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("held pose and scale by image10, image17")), "{notes:?}");
    let solvers: [Box<dyn Optimizer>; 2] = [Box::new(Auto::default()), Box::new(GaussNewton::default())];
    for solver in solvers {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        assert!(solution.outcome.termination.is_converged() && solution.outcome.undetermined.is_none());
        let camera = solution.values.get::<Intrinsics<Radial>>("camera3").unwrap().0.intrinsics();
        // 0.3 px of noise
        let true_one = Vector5::new(700.0, 320.0, 240.0, -0.05, 0.0);
        let off = camera - true_one;
        assert!(
            off[0].abs() < 5.0 && off[3].abs() < 0.05 && [off[1], off[2], off[4]] == [0.0; 3],
            "{camera}"
        );
    }
}

#[test]
fn what_is_free_without_an_anchor_is_named() {
    let GraphRead { graph, values, .. } = model(0.01).graph(false);
    let solution = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap();
    let open = solution.diagnose(&graph).unwrap().undetermined.or(solution.outcome.undetermined).unwrap();
    assert_eq!(open.free, ["position", "orientation", "scale"]);
    assert!(
        open.to_string().starts_with("nothing constrains the position, orientation and scale of the whole;")
    );
}

#[test]
fn what_the_estimate_does_not_change_is_kept() {
    let folder = written(&model(0.05));
    let (format, file) = GraphFormat::of_folder(folder.path()).unwrap();
    assert_eq!((format.name, file.file_name().unwrap().to_str()), ("COLMAP", Some("images.txt")));
    fs::write(folder.path().join("rigs.txt"), "# rigs\n1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 0 0 0\n").unwrap();
    let reading = ReadOptions { repair: InformationRepair::Error, anchor: true, lenient: false };
    let GraphRead { graph, values, notes } =
        (format.parse)(&fs::read_to_string(&file).unwrap(), &file, reading).unwrap();
    assert!(notes.iter().any(|note| note.starts_with("rigs.txt: ")), "{notes:?}");
    let solution = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap();
    let text = format.format.unwrap()(&graph, &solution.values, Some(folder.path())).unwrap();
    assert!(text.notes.is_empty(), "{:?}", text.notes);
    let out = tempfile::tempdir().unwrap();
    for (path, text) in text.at(out.path()) {
        fs::write(path, text).unwrap();
    }
    let (back, before) = (Model::read(out.path()).unwrap(), model(0.05));
    assert!(back.images.iter().zip(&before.images).all(|(a, b)| a.name == b.name && a.points == b.points));
    assert!(back.points.iter().zip(&before.points).all(|(a, b)| a.colour == b.colour && a.track == b.track));
    assert!(back.points.iter().zip(&before.points).all(|(a, b)| a.position != b.position));
    assert_eq!(back.cameras[0].model, before.cameras[0].model);
    // errors are measured again: 0.3 px of noise in each coordinate, less what the estimate takes up
    assert!(back.points.iter().all(|point| (0.02..0.45).contains(&point.error)));
    let again = back.graph(true);
    assert!((again.graph.cost(&again.values).unwrap() - solution.outcome.final_cost).abs() < 1e-9);
}

#[test]
fn a_graph_is_a_model_without_the_folder_it_came_from() {
    let GraphRead { graph, values, .. } = model(0.0).graph(true);
    let format = GraphFormat::of_destination(Path::new("out")).unwrap();
    let text = format.format.unwrap()(&graph, &values, None).unwrap();
    assert!(text.notes.is_empty(), "{:?}", text.notes);
    let folder = tempfile::tempdir().unwrap();
    for (path, text) in text.at(folder.path()) {
        fs::write(path, text).unwrap();
    }
    let back = Model::read(folder.path()).unwrap();
    assert_eq!((back.images.len(), back.points.len(), back.cameras.len()), (8, 40, 1));
    assert_eq!(back.images[1].name, "image11");
    let again = back.graph(true);
    assert!((again.graph.cost(&again.values).unwrap() - graph.cost(&values).unwrap()).abs() < 1e-9);
}

#[test]
fn a_camera_that_its_model_cannot_express_gets_another_model() {
    let folder = written(&model(0.0));
    let GraphRead { graph, mut values, .. } = Model::read(folder.path()).unwrap().graph(true);
    let lens = Radial::new([700.0, 320.0, 240.0, -0.05, 0.02], 640, 480).unwrap();
    values.insert("camera3", Intrinsics(lens));
    let format = GraphFormat::of_destination(Path::new("out")).unwrap().format.unwrap();
    // the model is found by its folder and by its file
    for like in [folder.path().to_owned(), folder.path().join("images.txt")] {
        let text = format(&graph, &values, Some(&like)).unwrap();
        let cameras = &text.files[0].1;
        assert!(cameras.contains("3 RADIAL 640 480 700.0 320.0 240.0 -0.05 0.02"), "{cameras}");
        assert!(text.files[1].1.contains("a folder/image #0.jpg"));
    }
}

#[test]
fn a_graph_without_such_cameras_is_no_model() {
    let format = GraphFormat::of_destination(Path::new("out")).unwrap();
    let error = format.format.unwrap()(&Graph::new(), &Values::new(), None).unwrap_err().to_string();
    assert!(error.contains("so the graph is no model of COLMAP"), "{error}");
}

#[test]
fn few_image_points_hold_what_they_do_not_determine() {
    let mut model = model(0.0);
    for image in &mut model.images[1..] {
        image.points.iter_mut().filter(|point| point.point == Some(501)).for_each(|point| point.point = None);
    }
    model.images[3].points.iter_mut().for_each(|point| point.point = None);
    let GraphRead { graph, notes, .. } = model.graph(true);
    let held = |key: &str| graph.fixed().get(&Key::from(key)) == Some(&Fixed::Whole(true));
    assert!(held("point501") && held("image13") && !held("point502"), "{notes:?}");
    assert!(notes.iter().any(|note| note == "images without points in space: held image13"), "{notes:?}");
    assert!(
        notes.iter().any(|note| note.contains("fewer than two image points: held point501")),
        "{notes:?}"
    );
}

#[test]
fn malformed_models_are_refused_with_the_line() {
    for (file, from, to, expected) in [
        ("cameras.txt", "SIMPLE_RADIAL", "FOV", "cameras.txt:4: expected one of the models SIMPLE_PINHOLE, "),
        ("cameras.txt", "640 480 ", "640 480 1.0 ", "expected 4 parameters of SIMPLE_RADIAL, got 5"),
        ("cameras.txt", "640 480", "640 4.5", "expected a whole number of pixels, got `4.5`"),
        ("cameras.txt", "700.0", "-700.0", "expected fx to be a finite number above zero, got -700"),
        ("cameras.txt", "700.0", "nan", "expected a finite number, got `nan`"),
        ("cameras.txt", "\n3 ", "\n4 ", "images.txt:5: there is no camera in cameras.txt with the number 3"),
        ("images.txt", " 3 a folder/image #0.jpg", "", "images.txt:5: expected 10 fields"),
        (
            "images.txt",
            "\n1.0 2.0 -1 ",
            "\n1.0 -1 ",
            "images.txt:6: expected the image points as x, y and the number",
        ),
        (
            "images.txt",
            " 501",
            " 9501",
            "images.txt:6: there is no point in points3D.txt with the number 9501",
        ),
        ("images.txt", "\n11 ", "\n10 ", "images.txt:7: image 10 is defined twice, first in line 5"),
        ("images.txt", "image #1.jpg", "image #0.jpg", "image a folder/image #0.jpg is defined twice"),
        ("points3D.txt", " 200 100 50 ", " 300 100 50 ", "expected a whole number from 0 to 255, got `300`"),
        ("points3D.txt", "\n501 ", "\n500 ", "points3D.txt:5: point 500 is defined twice, first in line 4"),
        (
            "points3D.txt",
            " 11 1 ",
            " 11 0 ",
            "the track says that image 11 sees point 500 at its image point 0",
        ),
        ("points3D.txt", " 11 1 ", " 11 1 7 ", "expected the track as pairs of image and index"),
    ] {
        let found = mistakes(file, from, to);
        assert!(found.contains(expected), "{file}: {from} -> {to}\n{found}");
    }
    let folder = written(&model(0.0));
    fs::remove_file(folder.path().join("points3D.txt")).unwrap();
    let error = Model::read(folder.path()).unwrap_err().to_string();
    assert!(error.contains("points3D.txt"), "{error}");
}
