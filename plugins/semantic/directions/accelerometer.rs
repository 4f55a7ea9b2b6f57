//! Gravity as a variable, measured by an accelerometer.
use crate::S2;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::prelude::*;

/// An accelerometer at rest measures the up direction: r = R⁻¹ g - a, of length 2 sin(angle / 2).
///
/// Variables: the pose of the body, with rotation R, and the up direction g in the world. a is the measured
/// specific force, which points up at rest; its length does not matter. σ is in radians close to alignment;
/// an acceleration b of the body causes an error of about b / 9.81. Invariant to rotating the body about g
/// and to moving it, so it does not constrain yaw. Smooth and defined everywhere; if a points straight down,
/// the derivative of the cost vanishes.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "g"]
/// factor = { type = "accelerometer", measured = [0.1, -9.7, 0.4] }
/// noise  = { sigma = 0.05 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Accelerometer {
    /// The specific force in the frame of the pose, of any length but zero.
    pub measured: Direction,
}

impl Residual for Accelerometer {
    type Variables = (Se3, S2);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (pose, up): Lifted<Self::Variables, T>) -> Vector3<T> {
        pose.rotation.inverse().act(&up) - self.measured.lift()
    }
}
register_factor!("accelerometer", Accelerometer);
register_invariance!(Accelerometer, "turning about up, and moving", |_, (pose, up), random| {
    let turn = So3::exp(&(*up.direction * random(3.0)));
    let translation = Vector3::new(random(5.0), random(5.0), random(5.0));
    (Se3::new(turn.compose(&pose.rotation), translation), *up)
});

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::{Graph, Noise, Values};
    use manifactor_solve::{LevenbergMarquardt, Silent, solve};
    use manifactor_testing::factor_laws;

    factor_laws! { accelerometer }

    #[test]
    fn the_error_of_a_tilt_is_known() {
        let tilted = Se3::new(So3::exp(&Vector3::new(0.2, 0.0, 0.0)), Vector3::zeros());
        let r = Accelerometer::default().residual::<f64>((tilted, Vector3::z()));
        assert!((r.norm() - 2.0 * 0.1f64.sin()).abs() < 1e-12);
    }

    #[test]
    fn two_poses_find_up() {
        let up = Direction::new(Vector3::new(0.3, -0.9, 0.2)).unwrap();
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for (key, omega) in [("x0", Vector3::new(0.1, 0.2, 0.3)), ("x1", Vector3::new(-1.0, 0.4, 2.0))] {
            let pose = Se3::new(So3::exp(&omega), Vector3::zeros());
            let measured = Direction::new(pose.rotation.inverse().act(&up)).unwrap();
            graph.fix(key);
            graph.add([key, "g"], Accelerometer { measured }).noise(Noise::sigma(0.05).unwrap());
            values.insert(key, pose);
        }
        values.insert("g", S2::new(Direction::Z));
        let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent).unwrap();
        let found: &S2 = solution.values.get("g").unwrap();
        assert!((*found.direction - *up).norm() < 1e-9);
    }
}
