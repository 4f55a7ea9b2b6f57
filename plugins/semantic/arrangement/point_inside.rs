//! A point measured on an object.
use manifactor_geometry::{Coordinates, Se3};
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// A measured point belongs to an object: r = max(0, ρ - 1), with ρ = ‖S⁻¹Rᵀ(X p - c)‖ its distance in
/// semi-axes.
///
/// Variables: the pose X of the depth camera or lidar that measured the point p, and the object. Inside the
/// object (ρ < 1) residual and derivative are zero. Outside it, σ = 0.1 allows for a tenth of the object's
/// size. Points alone let an object grow without limit: add a size prior or boxes. With `surface = true` the
/// point is on the surface, r = ρ - 1 on both sides. The hinge has a kink at the surface, but its square has
/// none. At the centre ρ has no derivative: with `surface`, the factor is not defined for ρ below 1e-6.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "q0"]
/// factor = { type = "point_inside", point = [0.1, 0.0, 2.0] }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointInside {
    /// The point in the frame of the pose, in metres.
    pub point: Coordinates<3>,
    /// Whether the point is on the surface. Default: false, inside is enough.
    #[serde(default)]
    pub surface: bool,
}

impl PointInside {
    /// Returns ρ².
    fn squared<T: Scalar>(&self, pose: &Se3<T>, quadric: &DualQuadric<T>) -> T {
        let point: Vector3<T> = self.point.vector().map(T::from);
        let inside = quadric.pose.inverse_act(&pose.act(&point));
        inside.component_div(&quadric.semi_axes).norm_squared()
    }
}

impl Residual for PointInside {
    type Variables = (Se3, DualQuadric);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (pose, quadric): Lifted<Self::Variables, T>) -> Vector1<T> {
        let squared = self.squared(&pose, &quadric);
        let counts = self.surface || squared > T::one();
        Vector1::new(if counts { squared.sqrt() - T::one() } else { T::zero() })
    }
    fn is_defined(&self, (pose, quadric): Refs<'_, Self::Variables>) -> bool {
        !self.surface || self.squared(pose, quadric) > 1e-12
    }
}
register_factor!("point_inside", PointInside);
register_invariance!(PointInside, "moving both together", |_, (pose, quadric), random| {
    let turn = manifactor_geometry::So3::exp(&Vector3::new(random(1.0), random(1.0), random(1.0)));
    let motion = Se3::new(turn, Vector3::new(random(5.0), random(5.0), random(5.0)));
    (motion.compose(pose), DualQuadric { pose: motion.compose(&quadric.pose), ..*quadric })
});

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::testing::any_se3;
    use manifactor_quadric::testing::any_quadric;
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, factor_laws, jacobian_law};

    factor_laws! { point_inside }

    fn error(x: f64, surface: bool) -> f64 {
        let quadric = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::new(2.0, 1.0, 1.0) };
        let point = Coordinates::new(Vector3::new(x, 0.0, 0.0)).unwrap();
        PointInside { point, surface }.residual::<f64>((Se3::identity(), quadric)).x
    }

    #[test]
    fn outside_it_is_the_distance_in_semi_axes() {
        assert!((error(3.0, false) - 0.5).abs() < 1e-12 && error(1.0, false) == 0.0);
        assert!((error(3.0, true) - 0.5).abs() < 1e-12 && (error(1.0, true) + 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_surface_has_a_derivative_on_both_sides() {
        check((any_se3(), any_quadric(), vector::<3>(3.0)), |(pose, quadric, p)| {
            // Around the object, up to about its size inside and outside.
            let seen = pose.inverse_act(&quadric.pose.act(&p.component_mul(&quadric.semi_axes)));
            let point = Coordinates::new(seen).unwrap();
            jacobian_law(&PointInside { point, surface: true }, &[&pose, &quadric])
        });
    }
}
