use super::*;
use crate::{BoundingBoxFactor, BoxModel};
use manifactor_geometry::So3;
use manifactor_graph::checked::NotNegative;
use manifactor_testing::{catalogue::documentation_law, check};
use nalgebra::{Matrix3, SVector};
use proptest::prelude::*;

fn camera() -> Camera {
    Camera::new([525.0, 520.0, 320.0, 240.0], 640, 480).unwrap()
}

/// A camera at `eye`, facing the origin.
fn looking_from(eye: Vector3<f64>) -> Se3 {
    let z = -eye.normalize();
    let x = z.cross(&Vector3::z()).normalize();
    Se3::new(So3::from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z])), eye)
}

/// Eyes on an arc of `radians` at some distance, at varying heights.
fn arc(count: usize, radians: f64, distance: f64) -> Vec<Se3> {
    let eye = |i: usize| {
        let a = radians * i as f64 / count as f64;
        let h = 0.4 + 0.3 * (5.0 * a).sin();
        looking_from(Vector3::new(a.cos(), a.sin(), h) * distance)
    };
    (0..count).map(eye).collect()
}

/// Boxes of the true object in each view, with up to `noise` pixels of error on the sides, and the depth of
/// the surface on the line through the box centre.
fn views(truth: &DualQuadric, poses: &[Se3], noise: f64) -> Vec<ObjectView> {
    let blank = BoundingBoxFactor {
        bounding_box: BoundingBox::new([0.0; 4]).unwrap(),
        camera: camera(),
        model: BoxModel::Standard,
    };
    let one = |(i, pose): (usize, &Se3)| {
        let mut bounds = blank.predict(pose, truth).unwrap().bounds();
        for (k, bound) in bounds.iter_mut().enumerate() {
            *bound += noise * (12.9898 * (4 * i + k) as f64 + 1.0).sin();
        }
        let view = ObjectView::new(*pose, camera(), BoundingBox::new(bounds).unwrap());
        ObjectView { depth: surface(truth, &view), ..view }
    };
    poses.iter().enumerate().map(one).collect()
}

/// Depth at which the line through the box centre enters the true object.
fn surface(truth: &DualQuadric, view: &ObjectView) -> Option<f64> {
    let ray = view.camera.ray(view.bounding_box.centre());
    let local = truth.pose.between(&view.world_from_camera);
    let (o, d) = (local.translation, local.rotation.act(&ray));
    let (o, d) = (o.component_div(&truth.semi_axes), d.component_div(&truth.semi_axes));
    let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - 1.0);
    let root = b * b - a * c;
    (root >= 0.0).then(|| (-b - root.sqrt()) / a)
}

fn any_object() -> impl Strategy<Value = DualQuadric> {
    let (axes, turn, at) = (
        prop::array::uniform3(0.05..0.3f64),
        prop::array::uniform3(-1.5..1.5),
        prop::array::uniform3(-0.3..0.3),
    );
    (axes, turn, at).prop_map(|(s, w, t)| DualQuadric {
        pose: Se3::new(So3::exp(&w.into()), t.into()),
        semi_axes: s.into(),
    })
}

fn iou(a: &DualQuadric, b: &DualQuadric) -> f64 {
    a.axes_aligned_box().iou(&b.axes_aligned_box())
}

#[test]
fn svd_finds_the_object_from_exact_boxes() {
    for normalised in [true, false] {
        let svd = SvdInitialiser { normalised, ..SvdInitialiser::default() };
        check(any_object(), |truth| {
            let found = svd.initialise(&views(&truth, &arc(8, 4.0, 2.0), 0.0)).unwrap();
            let error = (found.matrix() - truth.matrix()).norm();
            assert!(error < 1e-6, "{error:e}");
            Ok(())
        });
    }
}

/// Mean IoU over 40 objects at this distance from the world origin; a failed estimate counts as 0.
fn mean_iou(svd: &SvdInitialiser, distance: f64, noise: f64) -> f64 {
    let away = Se3::new(So3::identity(), Vector3::new(1.0, -0.7, 0.2) * distance);
    let poses: Vec<_> = arc(12, 1.5, 2.0).iter().map(|p| away.compose(p)).collect();
    let one = |i: usize| {
        let mut truth = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::new(0.1, 0.15, 0.25) };
        truth = truth.retract(&SVector::from_fn(|k, _| 0.3 * (7.1 * (9 * i + k) as f64).sin()));
        truth.pose = away.compose(&truth.pose);
        svd.initialise(&views(&truth, &poses, noise)).map_or(0.0, |q| iou(&q, &truth))
    };
    (0..40).map(one).sum::<f64>() / 40.0
}

#[test]
fn svd_does_not_mind_where_the_world_s_origin_is_when_it_is_normalised() {
    for distance in [0.0, 100.0, 1e4] {
        let [scaled, raw] = [true, false].map(|normalised| {
            mean_iou(&SvdInitialiser { normalised, ..SvdInitialiser::default() }, distance, 2.0)
        });
        println!("{distance} m away: mean IoU {scaled:.3} normalised, {raw:.3} not");
        assert!(scaled > 0.9);
        assert!(distance < 1e4 || raw < 0.5);
    }
}

#[test]
fn sides_at_the_border_are_left_out() {
    let truth = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::new(0.1, 0.15, 0.25) };
    let mut views = views(&truth, &arc(12, 4.0, 2.0), 0.0);
    for view in views.iter_mut().step_by(2) {
        view.bounding_box.xmin = view.bounding_box.xmax - 3.0;
        view.observed[0] = false;
    }
    let svd = SvdInitialiser::default().initialise(&views).unwrap();
    assert!((svd.matrix() - truth.matrix()).norm() < 1e-6);
    let rays = iou(&RaysInitialiser::default().initialise(&views).unwrap(), &truth);
    assert!(rays > 0.6, "{rays}");
    let few: Vec<_> =
        views[..3].iter().map(|v| ObjectView { observed: [true, true, false, false], ..*v }).collect();
    assert_eq!(
        SvdInitialiser::default().initialise(&few),
        Err(InitialiseError::TooFewSides { found: 6, needed: 9 })
    );
    assert_eq!(
        RaysInitialiser::default().initialise(&few),
        Err(InitialiseError::TooFewSides { found: 0, needed: 6 })
    );
}

#[test]
fn rays_meet_at_the_object_whatever_the_noise() {
    check((any_object(), 0.0..3.0f64), |(truth, noise)| {
        let found = RaysInitialiser::default().initialise(&views(&truth, &arc(10, 3.0, 2.0), noise)).unwrap();
        let (size, truth_norm) = (truth.semi_axes.max(), truth.semi_axes.norm());
        let off = (found.centroid() - truth.centroid()).norm();
        assert!(off < 0.1 * size + 0.02, "{off}");
        // Axes along the world axes cannot follow a leaning stick, but the size is right.
        let ratio = found.semi_axes.norm() / truth_norm;
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
        Ok(())
    });
}

#[test]
fn two_views_are_enough_for_rays() {
    let truth = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::repeat(0.2) };
    let found = RaysInitialiser::default().initialise(&views(&truth, &arc(2, 1.0, 2.0), 0.0)).unwrap();
    assert!(found.centroid().norm() < 0.02 && (found.semi_axes - truth.semi_axes).norm() < 0.02);
}

#[test]
fn one_view_with_a_depth_is_enough() {
    check((any_object(), 0.0..6.0f64), |(truth, angle)| {
        let from = looking_from(Vector3::new(2.0 * angle.cos(), 2.0 * angle.sin(), 0.8));
        let views = views(&truth, &[from], 0.0);
        let found = DepthInitialiser::default().initialise(&views).unwrap();
        let off = (found.centroid() - truth.centroid()).norm();
        assert!(off < truth.semi_axes.max(), "{off}");
        Ok(())
    });
    let ball = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::repeat(0.2) };
    let found = DepthInitialiser::default().initialise(&views(&ball, &arc(1, 1.0, 2.0), 0.0)).unwrap();
    assert!(found.centroid().norm() < 0.01 && (found.semi_axes - ball.semi_axes).norm() < 0.01);
    let far = DepthInitialiser { thickness: NotNegative::literal(0.0) }
        .initialise(&views(&ball, &arc(1, 1.0, 2.0), 0.0))
        .unwrap();
    assert!((far.centroid().norm() - 0.2).abs() < 0.01, "the surface, taken for the centre");
}

#[test]
fn what_cannot_be_initialised_says_why() {
    let truth = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::new(0.1, 0.15, 0.25) };
    let good = views(&truth, &arc(6, 3.0, 2.0), 0.0);
    let all: [&dyn Initialiser; 3] =
        [&SvdInitialiser::default(), &RaysInitialiser::default(), &DepthInitialiser::default()];
    for initialiser in all {
        assert!(matches!(initialiser.initialise(&[]), Err(InitialiseError::TooFewViews { found: 0, .. })));
        let mut nan = good.clone();
        nan[4].world_from_camera.translation.x = f64::NAN;
        assert_eq!(initialiser.initialise(&nan), Err(InitialiseError::NotFinite { view: 4 }));
    }
    let deep: Vec<_> = good.iter().map(|v| ObjectView { depth: None, ..*v }).collect();
    assert_eq!(DepthInitialiser::default().initialise(&deep), Err(InitialiseError::NoDepth));
    let same = [good[0]; 5];
    assert!(matches!(
        RaysInitialiser::default().initialise(&same),
        Err(InitialiseError::TooLittleParallax { .. })
    ));
    assert!(SvdInitialiser::default().initialise(&same).is_err());
    assert_eq!(
        RaysInitialiser { min_parallax: NotNegative::literal(0.0), ..RaysInitialiser::default() }
            .initialise(&same),
        Err(InitialiseError::Undetermined)
    );

    // Cameras that face away from the intersection of their lines of sight.
    let away = So3::exp(&(Vector3::y() * std::f64::consts::PI));
    let mut behind = good.clone();
    for view in &mut behind {
        view.world_from_camera.rotation = view.world_from_camera.rotation.compose(&away);
        let b = view.bounding_box;
        view.bounding_box = BoundingBox { xmin: 640.0 - b.xmax, xmax: 640.0 - b.xmin, ..b };
    }
    for initialiser in [&SvdInitialiser::default() as &dyn Initialiser, &RaysInitialiser::default()] {
        assert_eq!(initialiser.initialise(&behind), Err(InitialiseError::Behind { view: 0 }));
    }
    let both = FirstOfInitialiser {
        initialisers: vec![Box::new(SvdInitialiser::default()), Box::new(RaysInitialiser::default())],
    };
    let text = both.initialise(&behind).unwrap_err().to_string();
    assert!(text.starts_with("svd: ") && text.contains("; rays: the object came out behind"), "{text}");
    assert!(both.initialise(&good).is_ok());
}

#[test]
fn boxes_of_different_objects_are_no_ellipsoid_and_say_so() {
    let truth = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::new(0.1, 0.15, 0.25) };
    let mut rejected = 0;
    for i in 0..20 {
        let mut mixed = views(&truth, &arc(6, 3.0, 2.0), 0.0);
        for (k, view) in mixed.iter_mut().enumerate() {
            let [x, y] = [(i * 37 + k * 211) % 500, (i * 91 + k * 173) % 350].map(|n| n as f64);
            view.bounding_box = BoundingBox::new([x, y, x + 60.0, y + 90.0]).unwrap();
        }
        match SvdInitialiser::default().initialise(&mixed) {
            Ok(q) => assert!(q.is_finite() && mixed.iter().all(|v| q.is_in_front_of(&v.world_from_camera))),
            Err(_) => rejected += 1,
        }
    }
    println!("{rejected} of 20 rejected");
    assert!(rejected > 0);
}

#[test]
fn initialisers_are_in_the_catalogue_with_docs_and_examples() {
    let entries = manifactor_graph::catalogue::entries("initialiser");
    let names: Vec<_> = entries.iter().map(|e| e.name).collect();
    assert_eq!(names, ["depth", "first_of", "rays", "svd"]);
    for entry in entries {
        documentation_law(entry).unwrap();
    }
    let text = r#"{"type":"first_of","initialisers":[{"type":"depth","thickness":0.5}]}"#;
    let read: Box<dyn Initialiser> = serde_json::from_str(text).unwrap();
    assert_eq!(serde_json::to_string(&read).unwrap(), text);
}
