//! Pose-graph reader: valid and malformed lines.
use manifactor_formats::pose_graph::{InformationRepair, PoseGraph, PoseGraphOptions, parse};
use manifactor_geometry::{Between, Landmark, Point2, Point3, Se2, Se3, Tree};
use manifactor_graph::{Factor, Fixed, Key};
use manifactor_solve::Problem;
use nalgebra::{DMatrix, Vector3, Vector6, dmatrix};
use std::any::Any;

const EDGE: &str = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";

fn read(text: &str) -> PoseGraph {
    parse(text, "g.g2o", &PoseGraphOptions::default()).unwrap()
}

fn errors(text: &str) -> String {
    parse(text, "g.g2o", &PoseGraphOptions::default()).unwrap_err().to_string()
}

fn factor<F: Any>(loaded: &PoseGraph, i: usize) -> &F {
    Factor::erased(&*loaded.graph.factors()[i].factor).as_any().downcast_ref().unwrap()
}

fn information(loaded: &PoseGraph, i: usize, rows: usize) -> DMatrix<f64> {
    loaded.graph.factors()[i].noise.information_matrix(rows).unwrap()
}

fn keys(names: &[&str]) -> Vec<Key> {
    names.iter().map(|name| Key::from(*name)).collect()
}

#[test]
fn poses_and_landmarks_in_the_plane_are_read() {
    let loaded = read(
        "VERTEX_SE2 3 1.0  2.0 0.5 \r\nVERTEX_XY 7 4 5\n# a comment\n\nEDGE_SE2_XY 3 7 0.5 0.25 2 0.5 3\n",
    );
    let pose: &Se2 = loaded.values.get("x3").unwrap();
    assert_eq!((pose.translation.y, pose.rotation.angle()), (2.0, 0.5));
    assert_eq!(loaded.values.get::<Point2>("l7").unwrap().y, 5.0);
    assert_eq!(factor::<Landmark<2>>(&loaded, 0).position.x, 0.5);
    assert_eq!(information(&loaded, 0, 2), dmatrix![2.0, 0.5; 0.5, 3.0]);
    assert_eq!(loaded.graph.check(&loaded.values), []);
}

#[test]
fn information_in_space_is_turned_to_rotation_first() {
    let diagonal = "1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6";
    let loaded = read(&format!("EDGE_SE3:QUAT 0 1 1 2 3 0 0 0.6 0.8 {diagonal}"));
    assert_eq!(information(&loaded, 0, 6).diagonal().as_slice(), [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
    let between: &Between<Se3> = factor(&loaded, 0);
    assert_eq!(between.relative.rotation.quaternion_xyzw(), [0.0, 0.0, 0.6, 0.8]);
    assert_eq!(between.relative.translation, Vector3::new(1.0, 2.0, 3.0));
}

#[test]
fn a_point_seen_by_a_turned_sensor_is_read_in_the_frame_of_the_pose() {
    let loaded = read(
        "PARAMS_SE3OFFSET 4 1 0 0 0 0 0.7071067811865476 0.7071067811865476\n\
         VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_TRACKXYZ 1 1 2 0\n\
         EDGE_SE3_TRACKXYZ 0 1 4 2 0 0 9 0 0 1 0 1\n",
    );
    let seen = factor::<Landmark<3>>(&loaded, 0).position.vector();
    assert!((seen - Vector3::new(1.0, 2.0, 0.0)).norm() < 1e-15);
    // The sensor is certain along its x axis, which is the vehicle's y axis.
    let expected = DMatrix::from_diagonal(&Vector3::new(1.0, 9.0, 1.0).as_slice().to_vec().into());
    assert!((information(&loaded, 0, 3) - expected).norm() < 1e-14);
    assert_eq!(loaded.values.get::<Point3>("l1").unwrap().y, 2.0);
}

#[test]
fn every_bad_line_is_reported_with_what_was_expected() {
    let text = "VERTEX_SE2 0 0 0\nVERTEX_SE2 1 0 0 nan\nVERTEX_SE2 -1 0 0 0\nVERTEX_SE2 2 0 0 0\n\
                VERTEX_SE2 2 0 0 0\nVERTEX_SE3:QUAT 3 0 0 0 0 0 0 2\nEDGE_SE2 2 2 0 0 0 1 0 0 1 0 1\n\
                EDGE_SE2 2 4 0 0 0 1 0 0 -1 0 1\nEDGE_SE3:QUAT 2 5 0 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 \
                0 0 1 0 0 1 0 1\nFIX 77\nEDGE_SE3_TRACKXYZ 5 6 0 1 1 1 1 0 0 1 0 1\nFIX\n";
    let expected = [
        "g.g2o:1: expected 4 fields (id x y theta), got 3",
        "g.g2o:2: expected a finite number, got `nan`",
        "g.g2o:3: expected a whole number from 0, got `-1`",
        "g.g2o:5: vertex 2 is defined twice, first in line 4; remove one of the two",
        "g.g2o:6: expected a unit quaternion (x, y, z, w), got [0.0, 0.0, 0.0, 2.0] of length 2; its \
         length has to be 1 to within 0.001",
        "g.g2o:7: the edge connects vertex 2 with itself",
        "g.g2o:8: information matrix: the matrix is not positive definite: its smallest eigenvalue is \
         -1e0; to go on without it, choose the repair `reject` or `clamp`",
        "g.g2o:9: vertex 2 is a 2D pose (line 4), but is used as a 3D pose here",
        "g.g2o:10: there is no vertex 77",
        "g.g2o:11: there is no PARAMS_SE3OFFSET 0",
        "g.g2o:12: expected the numbers of vertices after FIX, got ``",
    ];
    assert_eq!(errors(text).lines().collect::<Vec<_>>(), expected);
}

#[test]
fn a_file_of_something_else_is_an_error_that_names_its_tags() {
    let text = errors("VERTEX_CAM 0 1 2\nPOSE 1\nPOSE 2\n");
    assert_eq!(
        text,
        "g.g2o: expected vertices or edges of a g2o or TORO file, found none; unknown tags: `POSE`, `VERTEX_CAM`"
    );
    assert!(errors("").contains("found none"));
}

#[test]
fn unknown_tags_are_named_once_and_counted() {
    let text = format!("{EDGE}EDGE_PRIOR 0 1\nEDGE_PRIOR 1 2 3\nedge_se2 1 2\n");
    let expected = "g.g2o:2: unknown tags, 3 lines: `EDGE_PRIOR`, `edge_se2`; check their spelling, or leave these lines out with \
                    --lenient";
    assert_eq!(errors(&text), expected);
    let loaded =
        parse(&text, "g", &PoseGraphOptions { lenient: true, ..PoseGraphOptions::default() }).unwrap();
    let unknown: Vec<_> = loaded.report.unknown.iter().map(|(tag, n)| (tag.as_str(), *n)).collect();
    assert_eq!(unknown, [("EDGE_PRIOR", 2), ("edge_se2", 1)]);
    assert_eq!(loaded.graph.factors().len(), 1);
}

#[test]
fn many_unknown_tags_are_counted_and_ten_are_named() {
    let tags: String = (0..500).map(|i| format!("TAG_{i}_{} 1\n", "X".repeat(300))).collect();
    let error = errors(&format!("{EDGE}{tags}"));
    assert!(error.contains("500 lines") && error.len() < 1000, "{error}");
    let options = PoseGraphOptions { lenient: true, ..PoseGraphOptions::default() };
    let notes = parse(format!("{EDGE}{tags}").as_str(), "g", &options).unwrap().report.notes();
    assert!(notes.iter().any(|note| note == "490 more unknown tags: 490 lines left out"), "{notes:?}");
}

/// Cost of a graph at its initial values.
fn cost(text: &str) -> f64 {
    let loaded = read(text);
    Problem::compile(&loaded.graph, &loaded.values).unwrap().cost().cost
}

#[test]
fn absolute_measurements_are_read_and_hold_the_graph() {
    let text = "VERTEX_SE2 0 1 2 0.5\nEDGE_PRIOR_SE2 0 1 2 0.4 1 0 0 1 0 100\n";
    assert!((cost(text) - 0.5).abs() < 1e-12);
    let text = "VERTEX_SE2 0 1 2 0.5\nEDGE_PRIOR_SE2_XY 0 1.5 2 4 0 9\n";
    assert!((cost(text) - 0.5).abs() < 1e-12);
    assert!(read(text).report.anchored.is_empty());
    // The point is at 45 degrees, with a measurement error of 0.1 rad.
    let angle = std::f64::consts::FRAC_PI_4 + 0.1;
    let text = format!("VERTEX_SE2 0 0 0 0\nVERTEX_XY 1 3 3\nFIX 0\nEDGE_BEARING_SE2_XY 0 1 {angle} 100\n");
    assert!((cost(&text) - 0.5).abs() < 1e-9, "{}", cost(&text));
}

#[test]
fn absolute_measurements_are_written_and_read_back() {
    let text = "VERTEX_SE2 0 1 2 0.5\nVERTEX_XY 1 3 3\nVERTEX_SE3:QUAT 2 1 2 3 0 0 0 1\nPARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n\
                EDGE_PRIOR_SE2 0 1 2 0.4 1 0 0 1 0 100\nEDGE_PRIOR_SE2_XY 0 1.5 2 4 0 9\nEDGE_BEARING_SE2_XY 0 1 0.3 100\n\
                EDGE_SE3_PRIOR 2 0 1 2 4 0 0 0 1 1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n";
    let loaded = read(text);
    let (written, omitted) = manifactor_formats::g2o::format(&loaded.graph, &loaded.values);
    assert!(omitted.factors.is_empty(), "{:?}", omitted.factors);
    assert!((cost(&written) - cost(text)).abs() < 1e-12 * cost(text), "{written}");
    let none = text.replace("0.3 100", "0.3 0");
    let repaired = parse(
        &none,
        "g",
        &PoseGraphOptions { repair: InformationRepair::Reject, ..PoseGraphOptions::default() },
    )
    .unwrap();
    assert_eq!((repaired.graph.factors().len(), repaired.report.rejected.len()), (3, 1));
}

#[test]
fn the_prior_of_a_pose_is_that_of_its_sensor() {
    let pose = |x: &Se3| {
        let (t, q) = (x.translation, x.rotation.quaternion().coords);
        format!("{} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
    };
    let exp = |w: [f64; 6]| Se3::exp(&Vector6::from(w));
    let (x, offset) = (exp([0.3, -0.2, 0.5, 1.0, 2.0, 3.0]), exp([1.0, 0.4, -0.3, 0.2, -0.1, 0.4]));
    // Tangents here are rotation first, the information in the file translation first.
    let error = [0.01, -0.02, 0.03, 0.1, 0.2, -0.1];
    let measured = x.compose(&offset).compose(&exp(error));
    let information = [1.0, 2.0, 3.0, 10.0, 20.0, 30.0];
    let triangle: Vec<String> = (0..6)
        .flat_map(|r| (r..6).map(move |c| if r == c { information[r] } else { 0.0 }))
        .map(|x| x.to_string())
        .collect();
    let text = format!(
        "VERTEX_SE3:QUAT 4 {}\nPARAMS_SE3OFFSET 7 {}\nEDGE_SE3_PRIOR 4 7 {} {}\n",
        pose(&x),
        pose(&offset),
        pose(&measured),
        triangle.join(" ")
    );
    let expected: f64 = (0..6).map(|i| 0.5 * information[(i + 3) % 6] * error[i] * error[i]).sum();
    assert!((cost(&text) - expected).abs() < 1e-12, "{} for {expected}", cost(&text));
    let twice = text.replace("EDGE_SE3_PRIOR", "PARAMS_SE3OFFSET 7 0 0 0 0 0 0 1\nEDGE_SE3_PRIOR");
    assert_eq!(
        errors(&twice),
        "g.g2o:3: PARAMS_SE3OFFSET 7 is defined twice, first in line 2; remove one of the two"
    );
}

#[test]
fn edges_after_a_comment_or_a_fix_are_read() {
    let loaded = read(&format!("VERTEX_SE2 0 0 0 0\nFIX 0\n{EDGE}# half\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\n"));
    assert_eq!(loaded.graph.factors().len(), 2);
    assert_eq!(loaded.graph.fixed().get("x0"), Some(&Fixed::Whole(true)));
    assert!(loaded.report.anchored.is_empty());
}

#[test]
fn what_is_not_positive_definite_is_repaired_by_policy_and_counted() {
    let text = format!("{EDGE}EDGE_SE2 1 2 1 0 0 1 0 0 -1 0 1\nEDGE_SE2 1 2 1 0 0 0 0 0 0 0 0\n");
    let repair = |repair| parse(&text, "g", &PoseGraphOptions { repair, ..PoseGraphOptions::default() });
    assert!(repair(InformationRepair::Error).is_err());
    let rejected = repair(InformationRepair::Reject).unwrap();
    assert_eq!((rejected.graph.factors().len(), rejected.report.rejected), (1, vec![2, 3]));
    let clamped = repair(InformationRepair::Clamp).unwrap();
    assert_eq!((clamped.report.clamped, clamped.report.rejected), (vec![2], vec![3]));
    assert_eq!(clamped.graph.factors().len(), 2);
    // The vertex is still placed along the omitted edge. It is held, as no other factor constrains it.
    assert_eq!(rejected.values.get::<Se2>("x2").unwrap().translation.x, 2.0);
    assert_eq!(rejected.report.anchored, keys(&["x0", "x2"]));
}

#[test]
fn missing_vertices_are_filled_along_the_edges_in_both_directions() {
    let loaded = read(
        "VERTEX_SE2 5 10 0 0\nEDGE_SE2 4 5 1 0 0 1 0 0 1 0 1\nEDGE_SE2 5 6 2 0 0 1 0 0 1 0 1\n\
         EDGE_SE2_XY 6 9 0 3 1 0 1\n",
    );
    let x = |key: &str| loaded.values.get::<Se2>(key).unwrap().translation.x;
    assert_eq!((x("x4"), x("x6")), (9.0, 12.0));
    assert_eq!(loaded.values.get::<Point2>("l9").unwrap().0, nalgebra::Vector2::new(12.0, 3.0));
    assert_eq!(loaded.report.filled, keys(&["x4", "x6", "l9"]));
}

#[test]
fn a_pose_that_only_sees_points_starts_at_the_origin() {
    let loaded = read("EDGE_SE2_XY 4 9 1 2 1 0 1\nEDGE_SE2_XY 5 9 0 2 1 0 1\n");
    assert_eq!(*loaded.values.get::<Se2>("x5").unwrap(), Se2::identity());
    assert_eq!(loaded.values.get::<Point2>("l9").unwrap().0, nalgebra::Vector2::new(1.0, 2.0));
    assert_eq!(loaded.graph.check(&loaded.values), []);
}

#[test]
fn the_spanning_tree_is_chosen_by_an_option() {
    let text = format!("{EDGE}EDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\nEDGE_SE2 0 2 3 0 0 1 0 0 1 0 1\n");
    let x2 = |tree| {
        let loaded = parse(&text, "g", &PoseGraphOptions { tree, ..PoseGraphOptions::default() }).unwrap();
        loaded.values.get::<Se2>("x2").unwrap().translation.x
    };
    assert_eq!((x2(Tree::Chain), x2(Tree::Shallow)), (2.0, 3.0));
}

#[test]
fn each_connected_part_is_held_once() {
    let text = format!("{EDGE}EDGE_SE2 7 8 1 0 0 1 0 0 1 0 1\nEDGE_SE2 2 8 1 0 0 1 0 0 1 0 1\n");
    assert_eq!(read(&text).report.anchored, keys(&["x0", "x2"]));
    assert_eq!(read(&format!("{text}FIX 7\n")).report.anchored, keys(&["x0"]));
    let free = parse(&text, "g", &PoseGraphOptions { anchor: false, ..PoseGraphOptions::default() }).unwrap();
    assert!(free.graph.fixed().is_empty() && free.report.anchored.is_empty());
}

#[test]
fn an_equivalence_adds_a_factor_only_where_there_is_no_edge() {
    let text = "EDGE2 1 0 -1 0 0 1 0 1 1 0 0\nEDGE2 2 1 -1 0 0 1 0 1 1 0 0\nEQUIV 0 1\nEQUIV 2 0\n";
    let loaded = read(text);
    assert_eq!((loaded.report.equivalences_by_edge, loaded.report.equivalences_added), (1, 1));
    assert_eq!(loaded.graph.factors().len(), 3);
    assert_eq!(factor::<Between<Se2>>(&loaded, 2).relative, Se2::identity());
    assert!((information(&loaded, 2, 3)[(0, 0)] - 1e6).abs() < 1e-3);
    assert!(errors("EDGE2 1 0 -1 0 0\nEQUIV 0 9").contains("g.g2o:2: there is no vertex 9"));
}
