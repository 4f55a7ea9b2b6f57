//! A detected box, with the residual in space: for initial values that have no predicted box yet.
use manifactor_geometry::{Camera, Se3};
use manifactor_graph::prelude::*;
use manifactor_quadric::{BoundingBox, DualQuadric, Ellipsoid};
use nalgebra::RowVector3;

/// The planes through a camera and the sides of a box touch the object: rₖ = nₖ · c - eₖ, in metres.
///
/// Variables: the pose of the camera and the object, with centroid c in the camera's frame. nₖ is the unit
/// normal of plane πₖ = Pᵀlₖ, pointing to the inside of the box, and eₖ half the object's extent along it.
/// The algebraic form of this constraint, πₖᵀ Q* πₖ = eₖ² - (nₖ · c)² = 0 (Rubino et al., *3D Object
/// Localisation from Multi-View Object Detections*, 2018), is also zero for an object on the wrong side; this
/// form is not. Rows: left, top, right, bottom.
///
/// Unlike `bounding_box` it is smooth and defined everywhere: also behind the camera, around it and across
/// its plane. It therefore pulls an object into view from a bad initial value; then `bounding_box`, whose
/// noise matches a detector, should take over. An object that shrinks to a point at the camera satisfies it
/// exactly; two views or a size prior prevent this. Use a large initial size: a tiny object behind all
/// cameras shrinks to a point. σ is in metres at the object: σ pixels at depth z are about σ z / f.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "q0"]
/// factor = { type = "tangent_planes", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TangentPlanes {
    /// Measured box: xmin, ymin, xmax, ymax, in pixels.
    #[serde(rename = "box")]
    pub bounding_box: BoundingBox,
    /// The calibrated camera.
    pub camera: Camera,
}

impl TangentPlanes {
    /// Returns the unit normals of the planes through the sides, pointing inside, in the camera's frame.
    fn normals(&self) -> [Vector3<f64>; 4] {
        let [left, top, right, bottom] = self.bounding_box.lines();
        // Kᵀl is the plane of an image line; the signs of the right and bottom sides are flipped to point
        // inside.
        [left, top, -right, -bottom].map(|line| (self.camera.matrix().transpose() * line).normalize())
    }
}

impl Residual for TangentPlanes {
    type Variables = (Se3, DualQuadric);
    type Dim = U4;

    fn residual<T: Scalar>(&self, (pose, quadric): Lifted<Self::Variables, T>) -> Vector4<T> {
        let seen = Ellipsoid::in_camera_frame(&pose, &quadric);
        let normals = self.normals();
        Vector4::from_fn(|k, _| {
            let n: RowVector3<T> = normals[k].map(T::from).transpose();
            (n * seen.centroid).x - (n * seen.axes).norm_squared().sqrt()
        })
    }
}
register_factor!("tangent_planes", TangentPlanes);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use manifactor_graph::{Graph, Noise, Values};
    use manifactor_quadric::testing::any_view;
    use manifactor_quadric::{BoundingBoxFactor, BoxModel};
    use manifactor_solve::{LevenbergMarquardt, Silent, solve};
    use manifactor_testing::{check, factor_laws};

    factor_laws! { tangent_planes }

    fn factor(bounding_box: BoundingBox, camera: Camera) -> BoundingBoxFactor {
        BoundingBoxFactor { bounding_box, camera, model: BoxModel::Standard }
    }

    #[test]
    fn it_is_zero_exactly_where_the_box_is_that_of_the_outline() {
        check(any_view(), |(camera, pose, quadric)| {
            let any = BoundingBox::new([0.0, 0.0, 1.0, 1.0]).unwrap();
            let Some(bounding_box) = factor(any, camera).predict(&pose, &quadric) else { return Ok(()) };
            let r = TangentPlanes { bounding_box, camera }.residual::<f64>((pose, quadric));
            let distance = pose.inverse_act(&quadric.centroid()).norm();
            assert!(r.norm() < 1e-7 * distance, "{r}");
            Ok(())
        });
    }

    fn object(centroid: [f64; 3], semi_axes: [f64; 3]) -> DualQuadric {
        DualQuadric { pose: Se3::new(So3::identity(), centroid.into()), semi_axes: semi_axes.into() }
    }

    const TRUTH: ([f64; 3], [f64; 3]) = ([0.1, -0.1, 3.0], [0.2, 0.3, 0.25]);

    /// Five views of the true object, and an initial value; the rotation is held.
    fn views(start: DualQuadric) -> (Graph, Values) {
        let camera = Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480).unwrap();
        let truth = object(TRUTH.0, TRUTH.1);
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for i in 0..5 {
            let angle = -0.5 + 0.25 * f64::from(i);
            let turn = So3::exp(&Vector3::new(0.2 * angle, angle, 0.0));
            // Around the object, facing it.
            let pose = Se3::new(turn, truth.centroid() - turn.act(&Vector3::z()) * 3.0);
            let any = BoundingBox::new([0.0, 0.0, 1.0, 1.0]).unwrap();
            let bounding_box = factor(any, camera).predict(&pose, &truth).unwrap();
            let key = format!("x{i}");
            graph.fix(key.as_str());
            values.insert(key.as_str(), pose);
            let planes = TangentPlanes { bounding_box, camera };
            graph.add([key.as_str(), "q"], planes).noise(Noise::sigma(0.1).unwrap());
        }
        graph.fix_directions("q", &["rx", "ry", "rz"]);
        values.insert("q", start);
        (graph, values)
    }

    /// Returns whether the true object is found.
    fn finds(start: DualQuadric) -> bool {
        let (graph, values) = views(start);
        let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent).unwrap();
        let (found, truth) = (solution.values.get::<DualQuadric>("q").unwrap(), object(TRUTH.0, TRUTH.1));
        let apart = (found.centroid() - truth.centroid()).norm() + (found.semi_axes - truth.semi_axes).norm();
        solution.outcome.termination.is_converged() && apart < 1e-4
    }

    #[test]
    fn an_object_behind_all_cameras_comes_to_where_it_was_seen() {
        assert!(finds(object([2.0, 1.0, -6.0], [1.0, 1.0, 1.0])));
    }

    #[test]
    fn it_converges_from_anywhere_unless_it_is_tiny_and_behind_all_cameras() {
        let places = [-8.0, 0.0, 8.0];
        let starts = places.iter().flat_map(|x| places.iter().map(move |y| (*x, *y)));
        let starts = starts.flat_map(|(x, y)| places.iter().map(move |z| [x, y, 3.0 + z]));
        let starts = starts.flat_map(|at| [0.02, 0.3, 4.0].map(|size| object(at, [size; 3])));
        let all: Vec<_> = starts.collect();
        let lost: Vec<_> = all.iter().filter(|start| !finds(**start)).collect();
        let tiny_and_behind = |s: &DualQuadric| s.semi_axes.x < 0.1 && s.centroid().z < 0.0;
        assert_eq!(all.len(), 81);
        assert!(lost.iter().all(|start| tiny_and_behind(start)), "{} of {}: {lost:?}", lost.len(), all.len());
    }
}
