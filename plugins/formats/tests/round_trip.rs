//! A graph written as a g2o file reads back unchanged.
use manifactor_formats::{g2o, pose_graph};
use manifactor_geometry::{Between, Landmark, Point2, Point3, Prior, Se2, Se3, So3};
use manifactor_graph::loss::Huber;
use manifactor_graph::{Graph, Key, Manifold, Noise, Values};
use nalgebra::{DMatrix, Vector2, Vector3, Vector6};
use pose_graph::PoseGraphOptions;
use proptest::prelude::*;

fn parse(text: &str) -> pose_graph::PoseGraph {
    pose_graph::parse(text, "g", &PoseGraphOptions { anchor: false, ..PoseGraphOptions::default() }).unwrap()
}

/// A positive definite matrix of `n` rows from arbitrary numbers.
fn information(n: usize, numbers: &[f64]) -> Noise {
    let root = DMatrix::from_fn(n, n, |r, c| numbers[(r * n + c) % numbers.len()]);
    let m = &root * root.transpose() + DMatrix::identity(n, n);
    Noise::information(DMatrix::from_fn(n, n, |r, c| m[(r.min(c), r.max(c))])).unwrap()
}

fn se3(xi: [f64; 6]) -> Se3 {
    Se3::identity().retract(&Vector6::from(xi))
}

fn json(graph: &Graph, values: &Values) -> String {
    // Through a JSON value, so that numbers are compared rather than their spelling.
    serde_json::to_value((graph, values)).unwrap().to_string()
}

proptest! {
    #[test]
    fn graphs_read_back_bit_for_bit(
        poses in prop::collection::vec(prop::array::uniform6(-3.0..3.0f64), 2..8),
        numbers in prop::collection::vec(-2.0..2.0f64, 7),
        scale in 1e-9..1e9f64,
    ) {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for (i, xi) in poses.iter().enumerate() {
            let pose = se3(*xi);
            values.insert(Key::indexed("x", i), Se3::new(pose.rotation, pose.translation * scale));
            let planar = Se2::identity().retract(&Vector3::new(xi[0] * scale, xi[1], xi[2]));
            values.insert(Key::indexed("x", 100 + i), planar);
            if i > 0 {
                let pair = |first: usize| [Key::indexed("x", first + i - 1), Key::indexed("x", first + i)];
                graph.add(pair(0), Between { relative: se3(*xi) }).noise(information(6, &numbers));
                graph.add(pair(100), Between { relative: planar }).noise(information(3, &numbers));
            }
        }
        values.insert("l200", Point2::new(Vector2::new(scale, -1.0)));
        values.insert("l201", Point3::new(Vector3::new(0.1, scale, -1.0 / scale)));
        let seen = Landmark::<2> { position: vec![0.5, scale].try_into().unwrap() };
        graph.add(["x100", "l200"], seen).noise(information(2, &numbers));
        graph.fix("x0");

        let (text, omitted) = g2o::format(&graph, &values);
        prop_assert_eq!(omitted, g2o::G2oOmissions::default());
        let back = parse(&text);
        prop_assert_eq!(json(&back.graph, &back.values), json(&graph, &values));
    }

    #[test]
    fn no_text_makes_the_reader_panic(
        lines in prop::collection::vec((0..8usize, "[-0-9. enx]{0,40}"), 0..8),
        repair in prop::sample::select(vec![pose_graph::InformationRepair::Clamp, pose_graph::InformationRepair::Reject]),
    ) {
        let tags = ["VERTEX_SE2", "EDGE_SE2", "VERTEX_SE3:QUAT", "EDGE_SE2_XY", "FIX", "EQUIV", "EDGE2", "?"];
        let text: String = lines.iter().map(|(tag, rest)| format!("{} {rest}\n", tags[*tag])).collect();
        let _ = pose_graph::parse(&text, "g", &PoseGraphOptions { repair, ..PoseGraphOptions::default() });
    }
}

#[test]
fn landmarks_in_space_read_back() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("x0", Se3::new(So3::exp(&Vector3::new(0.1, 0.2, 0.3)), Vector3::x()));
    values.insert("l1", Point3::new(Vector3::y()));
    let seen = Landmark::<3> { position: vec![1.0, 2.0, 3.0].try_into().unwrap() };
    graph.add(["x0", "l1"], seen).noise(Noise::sigma(0.5).unwrap());
    let back = parse(&g2o::format(&graph, &values).0);
    let noise = back.graph.factors()[0].noise.information_matrix(3).unwrap();
    assert!((noise - DMatrix::identity(3, 3) * 4.0).norm() < 1e-15);
    assert_eq!(back.graph.check(&back.values), []);
}

#[test]
fn what_g2o_has_no_word_for_is_counted() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("first", Se2::identity());
    values.insert("second", Se2::identity());
    values.insert("attitude", So3::identity());
    graph.add(["first"], Prior { value: Se2::identity() });
    graph.add(["attitude"], Prior { value: So3::identity() });
    graph.add(["first", "second"], Between { relative: Se2::identity() }).loss(Huber::default());
    graph.add(["second", "first"], Between { relative: Se2::identity() }).noise =
        Noise::unit().observing(&[true, true, false]);
    graph.fix_directions("second", &["theta"]);
    let (text, omitted) = g2o::format(&graph, &values);
    assert_eq!(omitted.factors.into_iter().collect::<Vec<_>>(), [("between_se2", 1), ("prior_so3", 1)]);
    assert_eq!(omitted.variables.into_iter().collect::<Vec<_>>(), [("so3", 1)]);
    assert_eq!((omitted.losses, omitted.partly_fixed), (1, vec![Key::from("second")]));
    let renamed = [("first", 0), ("second", 1), ("attitude", 2)].map(|(k, n)| (Key::from(k), n));
    assert_eq!(omitted.renamed, renamed);
    assert_eq!(parse(&text).graph.factors().len(), 2);
}
