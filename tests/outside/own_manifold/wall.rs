use manifactor::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A wall, seen from above: the points p of the plane with p · n = distance and n = (cos angle, sin angle).
/// Tangent (angle, distance), in radians and metres.
///
/// Adding half a turn and changing the sign of the distance gives the same wall, so an initial value on the
/// wrong side stays there.
///
/// ```toml
/// value = { type = "wall", angle = 1.5, distance = 2.0 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Angle of the normal, counter-clockwise from x. Unit: radians.
    pub angle: f64,
    /// Distance from the origin along the normal. Unit: metres.
    pub distance: f64,
}

impl Manifold for Wall {
    type Dim = U2;
    /// The normal and the distance.
    type Of<T: Scalar> = Vector3<T>;
    const TANGENT: &'static [&'static str] = &["angle", "distance"];

    fn lift<T: Scalar>(&self) -> Vector3<T> {
        Vector3::new(self.angle.cos(), self.angle.sin(), self.distance).lift()
    }
    fn seed(&self) -> Vector3<JetOf<U2>> {
        let (sin, cos) = self.angle.sin_cos();
        Vector3::new(
            Jet::with_gradient(cos, &[-sin, 0.0]),
            Jet::with_gradient(sin, &[cos, 0.0]),
            Jet::with_gradient(self.distance, &[0.0, 1.0]),
        )
    }
    fn retract(&self, delta: &Vector2<f64>) -> Self {
        Self { angle: wrap(self.angle + delta.x), distance: self.distance + delta.y }
    }
    fn local(&self, other: &Self) -> Vector2<f64> {
        Vector2::new(wrap(other.angle - self.angle), other.distance - self.distance)
    }
    fn is_finite(&self) -> bool {
        self.angle.is_finite() && self.distance.is_finite()
    }
}
register_manifold!("wall", Wall);
register_quantity!(Wall as Vector3<f64>);

/// Returns the equivalent angle within half a turn of zero.
fn wrap(angle: f64) -> f64 {
    manifactor::geometry::wrap(angle)
}

#[cfg(test)]
mod tests {
    manifactor::testing::manifold_laws! { wall }
}
