//! An object in balance.
use super::S2;
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// An object rests: any one of its principal axes is vertical.
///
/// r = up × Q up / ‖Q‖, Q = R diag(s²) Rᵀ. -Q up points from the centre to the lowest point of the ellipsoid.
/// An object in balance, lying or standing, has this point directly below its centre. No class has to define
/// which axis is up: a book that stands among books fits as well as one that lies. For an axis of length a
/// tilted by θ from the vertical, and length b across it, r is (a² - b²)/√(Σ s⁴) · sin θ cos θ. An object
/// that is as wide as high is therefore free to rotate, and there is no jump when a different axis becomes
/// the longest. σ is in these units: radians for a thin rod, less for all other shapes. Invariant to moving
/// and scaling; rotating about `up` rotates r. An axis halfway between two directions in balance is a
/// maximum, at which the derivative of the cost vanishes. Defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["book"]
/// factor = { type = "resting" }
/// noise  = { sigma = 0.01 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Resting {
    /// The world's up direction, of any length but zero. Default: z.
    #[serde(default)]
    pub up: Up,
}

impl Residual for Resting {
    type Variables = (DualQuadric,);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector3<T> {
        imbalance(&quadric, &self.up.lift())
    }
}
register_factor!("resting", Resting, up);
register_invariance!(Resting, "moving and growing", |_factor, (quadric,), random| {
    let mut moved = *quadric;
    moved.pose.translation += Vector3::new(random(5.0), random(5.0), random(5.0));
    moved.semi_axes *= random(2.0).exp();
    (moved,)
});

/// An object rests, with the up direction as a variable: r = g × Q g / ‖Q‖.
///
/// Variables: the object, and the direction g, for example of gravity. Resting objects then also determine
/// the up direction, which is useful if no other sensor measures it. All else is as in `resting`.
///
/// ```toml
/// [[factors]]
/// keys   = ["book", "g"]
/// factor = { type = "resting_along" }
/// noise  = { sigma = 0.01 }
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestingAlong {}

impl Residual for RestingAlong {
    type Variables = (DualQuadric, S2);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric, up): Lifted<Self::Variables, T>) -> Vector3<T> {
        imbalance(&quadric, &up)
    }
}
register_factor!("resting_along", RestingAlong);

/// Returns up × Q up / ‖Q‖.
fn imbalance<T: Scalar>(quadric: &DualQuadric<T>, up: &Vector3<T>) -> Vector3<T> {
    let (rotation, squares) = (&quadric.pose.rotation, quadric.semi_axes.component_mul(&quadric.semi_axes));
    let touching = rotation.act(&rotation.inverse().act(up).component_mul(&squares));
    up.cross(&touching) / squares.norm_squared().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_quadric::testing::{any_quadric, tilted};
    use manifactor_testing::{check, factor_laws};

    factor_laws! { resting, resting_along }

    fn imbalance_of(quadric: DualQuadric) -> f64 {
        Resting::default().residual::<f64>((quadric,)).norm()
    }

    #[test]
    fn any_axis_may_be_the_one_that_is_vertical() {
        check(any_quadric(), |mut quadric| {
            for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                let turn = manifactor_geometry::So3::exp(&(axis * std::f64::consts::FRAC_PI_2));
                quadric.pose.rotation = turn;
                assert!(imbalance_of(quadric) < 1e-12);
            }
            Ok(())
        });
    }

    #[test]
    fn a_tilt_counts_as_far_as_the_axes_differ() {
        for tilt in [0.0f64, 0.3, 1.2] {
            let quadric = tilted(tilt);
            let squares = quadric.semi_axes.map(|s| s * s);
            let (long, across) = (squares.z, squares.y);
            let expected = (long - across) / squares.norm() * tilt.sin() * tilt.cos();
            assert!((imbalance_of(quadric) - expected).abs() < 1e-12, "{tilt}");
        }
    }

    #[test]
    fn a_ball_rests_however_it_is_turned() {
        assert!(imbalance_of(DualQuadric { semi_axes: Vector3::repeat(0.2), ..tilted(0.4) }) < 1e-15);
    }

    #[test]
    fn what_touches_the_ground_is_as_far_to_the_side_as_it_says() {
        let quadric = tilted(0.3);
        // Points around the ball, in the plane of the tilt.
        let around = (0..100_000).map(|i| f64::from(i) * std::f64::consts::TAU / 1e5);
        let surface = around.map(|a| {
            let on_ball = Vector3::new(0.0, a.sin(), a.cos());
            quadric.pose.rotation.act(&on_ball.component_mul(&quadric.semi_axes))
        });
        let lowest = surface.min_by(|p, q| p.z.total_cmp(&q.z)).unwrap();
        // The lowest point is -Q up / √(upᵀ Q up), at the depth √(upᵀ Q up).
        let to_the_side = imbalance_of(quadric) * quadric.semi_axes.map(|s| s * s).norm() / -lowest.z;
        assert!((lowest.y.abs() - to_the_side).abs() < 1e-5, "{lowest} {to_the_side}");
    }
}
