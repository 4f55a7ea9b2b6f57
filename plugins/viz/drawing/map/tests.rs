use super::map;
use crate::canvas::Theme;
use crate::drawing::outline::Shape;
use crate::drawing::scene::TRACKS;
use crate::drawing::{Object, Palette, Scene, Track, Viewpoint};
use nalgebra::{Matrix3, Rotation3, Vector3};

fn ellipsoid(centroid: [f64; 3], semi_axes: [f64; 3], yaw: f64) -> Shape {
    let rotation = Rotation3::from_euler_angles(0.0, 0.0, yaw).into_inner();
    Shape { centroid: centroid.into(), axes: rotation * Matrix3::from_diagonal(&Vector3::from(semi_axes)) }
}

/// A camera on a circle around a table with four objects.
fn desk() -> Scene {
    let circle = |radius: f64, drift: f64| -> Vec<Option<Vector3<f64>>> {
        let angle = |k: usize| std::f64::consts::TAU * 0.9 * k as f64 / 100.0;
        let point = |k: usize| {
            let (sin, cos) = angle(k).sin_cos();
            let height = 1.2 + 0.1 * (3.0 * angle(k)).sin();
            Some(Vector3::new(radius * cos + drift * k as f64, radius * sin, height))
        };
        (0..100).map(point).collect()
    };
    let track = |(name, stroke): (&str, _), positions| Track { name: name.into(), stroke, positions };
    let places = [
        ("cup", [0.4, 0.3]),
        ("keyboard", [-0.2, -0.4]),
        ("bottle", [-0.5, 0.4]),
        ("tv & book", [0.3, -0.5]),
    ];
    let object = |(k, (class, [x, y])): (usize, (&str, [f64; 2]))| Object {
        class: class.into(),
        truth: Some(ellipsoid([x, y, 0.8], [0.22, 0.1, 0.08], k as f64)),
        estimate: Some(ellipsoid([x + 0.02, y - 0.03, 0.82], [0.2, 0.12, 0.07], k as f64 + 0.1)),
    };
    Scene {
        title: "desk".into(),
        tracks: vec![
            track(TRACKS[0], circle(1.5, 0.0)),
            track(TRACKS[1], circle(1.5, 0.004)),
            track(TRACKS[2], circle(1.5, 0.0005)),
        ],
        objects: places.into_iter().enumerate().map(object).collect(),
        ..Scene::default()
    }
}

fn svg(scene: &Scene, view: Viewpoint) -> String {
    let palette = Palette::new(scene.objects.iter().map(|object| object.class.as_str()));
    map(scene, view, &palette, 900.0).svg(Theme::Light)
}

#[test]
fn every_class_and_trajectory_is_in_the_legend() {
    for view in [Viewpoint::Top, Viewpoint::Side] {
        let svg = svg(&desk(), view);
        assert!(svg.starts_with("<svg") || svg.starts_with("<?xml"), "{}", &svg[..40]);
        for text in ["true", "odometry", "estimated", "cup", "keyboard", "bottle", "tv &amp; book", "(m)"] {
            assert!(svg.contains(text), "{text} is missing");
        }
    }
}

#[test]
fn a_legend_of_many_classes_ends() {
    let mut scene = desk();
    let object = scene.objects[0].clone();
    scene.objects = (0..5000).map(|i| Object { class: format!("class {i:04}"), ..object.clone() }).collect();
    scene.objects.iter_mut().skip(1).for_each(|object| (object.truth, object.estimate) = (None, None));
    let svg = svg(&scene, Viewpoint::Side);
    assert!(svg.contains("class 0059") && !svg.contains("class 0060") && svg.contains("and 4940 more"));
}

#[test]
fn an_estimate_far_away_does_not_shrink_the_rest() {
    let mut scene = desk();
    scene.objects[0].estimate = Some(ellipsoid([1e5, 0.0, 0.0], [1.0, 1.0, 1.0], 0.0));
    let svg = svg(&scene, Viewpoint::Top);
    assert!(svg.contains("1 of 4 objects outside the picture"));
    // the ticks of a frame of three metres
    assert!(svg.contains(">0.5<") && !svg.contains(">100000<"));
}

#[test]
fn objects_around_a_camera_that_hardly_moved_are_shown() {
    let mut scene = desk();
    scene.objects.iter_mut().for_each(|object| object.truth = None);
    let (track, stroke) = ("estimated".to_owned(), TRACKS[2].1);
    for positions in [vec![Some(Vector3::zeros())], vec![Some(Vector3::zeros()), Some(Vector3::repeat(0.01))]]
    {
        scene.tracks = vec![Track { name: track.clone(), stroke, positions }];
        assert!(!svg(&scene, Viewpoint::Top).contains("outside the picture"));
    }
}

#[test]
fn a_path_is_not_drawn_across_a_gap() {
    let mut scene = desk();
    scene.objects.clear();
    let paths = |scene: &Scene| svg(scene, Viewpoint::Top).matches("stroke-dasharray").count();
    let whole = paths(&scene);
    scene.tracks[0].positions[30..70].fill(None);
    assert_eq!(paths(&scene), whole + 1);
}

#[test]
fn what_is_not_finite_is_left_out() {
    let mut scene = desk();
    scene.tracks[2].positions[3] = None;
    scene.objects[1].estimate = Some(ellipsoid([f64::NAN; 3], [1.0; 3], 0.0));
    assert!(!svg(&scene, Viewpoint::Top).contains("NaN"));
}

#[test]
fn coordinates_whose_margins_overflow_are_left_out() {
    let mut scene = desk();
    scene.tracks[0].positions[3] = Some(Vector3::new(1e308, 0.0, 0.0));
    scene.tracks[2].positions[3] = Some(Vector3::new(-1e308, 0.0, 0.0));
    scene.objects[1].estimate = Some(ellipsoid([0.0, 1e308, 0.0], [1e307; 3], 0.0));
    for view in [Viewpoint::Top, Viewpoint::Side] {
        let svg = svg(&scene, view);
        let bad = svg.find("NaN").or_else(|| svg.find("inf"));
        assert!(bad.is_none(), "{}", bad.map_or("", |at| &svg[at.saturating_sub(80)..at + 40]));
    }
}

#[test]
fn an_empty_scene_is_an_empty_picture() {
    for tracks in [
        vec![],
        vec![Track { name: "one".into(), stroke: TRACKS[0].1, positions: vec![Some(Vector3::zeros())] }],
    ] {
        let svg = svg(&Scene { tracks, ..Scene::default() }, Viewpoint::Top);
        assert!(svg.contains("</svg>"));
    }
}
