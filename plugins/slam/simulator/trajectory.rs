//! Motion of the camera: an arc around the scene with waves in height and distance, directed at the objects.
use manifactor_geometry::{Se3, So3};
use manifactor_graph::checked::{Count, Finite, NotNegative, Positive};
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// An arc around the origin. `seed` determines its first angle, its waves and the points that the camera
/// looks at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrajectorySettings {
    /// Seed of the trajectory. It also changes the noise.
    pub seed: u64,
    /// Number of images.
    pub frames: Count<2, 1_000_000>,
    /// Time between two images. Unit: seconds.
    pub interval: Positive,
    /// Angle of the arc. Unit: degrees.
    pub sweep: Finite,
    /// Mean distance from the vertical axis. Unit: metres.
    pub radius: Positive,
    /// Mean height above the plane. Unit: metres.
    pub height: Finite,
    /// Amplitudes of the waves in distance and height. Unit: metres.
    pub waves: [NotNegative; 2],
    /// Amplitude of the viewed point's motion around the centre of the scene. Unit: metres.
    pub wander: NotNegative,
}

impl Default for TrajectorySettings {
    fn default() -> Self {
        Self {
            seed: 1,
            frames: Count::literal(200),
            interval: Positive::literal(0.1),
            sweep: Finite::literal(300.0),
            radius: Positive::literal(2.2),
            height: Finite::literal(1.1),
            waves: [NotNegative::literal(0.3), NotNegative::literal(0.3)],
            wander: NotNegative::literal(0.3),
        }
    }
}

impl TrajectorySettings {
    /// Returns `world_from_camera` for each image, for objects that rest at the height `ground`.
    pub(crate) fn poses(&self, ground: f64, rng: &mut Pcg64) -> Vec<Se3> {
        let start = rng.random::<f64>() * TAU;
        let mut wave = |size: f64| {
            let (turns, phase) = (rng.random_range(1.0..3.0), rng.random::<f64>() * TAU);
            move |t: f64| size * (turns * TAU * t + phase).sin()
        };
        let [out, up] = self.waves;
        let (out, up, x, y) = (wave(*out), wave(*up), wave(*self.wander), wave(*self.wander));
        let pose = |i: usize| {
            let t = i as f64 / (*self.frames - 1) as f64;
            let angle = start + self.sweep.to_radians() * t;
            let radius = (*self.radius + out(t)).max(0.1);
            let eye = Vector3::new(
                radius * angle.cos(),
                radius * angle.sin(),
                ground + (*self.height + up(t)).max(0.1),
            );
            looking(eye, Vector3::new(x(t), y(t), ground + 0.1))
        };
        (0..*self.frames).map(pose).collect()
    }
}

/// Returns the pose of an upright camera at `eye` that looks at `target`: z forward, x right, y down.
fn looking(eye: Vector3<f64>, target: Vector3<f64>) -> Se3 {
    let forward = (target - eye).normalize();
    let right = forward.cross(&Vector3::z());
    // any right direction is valid for a view straight up or down
    let right = right.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let down = forward.cross(&right);
    Se3::new(So3::from_matrix(&Matrix3::from_columns(&[right, down, forward])), eye)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_looks_at_its_target_with_its_head_up() {
        let pose = looking(Vector3::new(2.0, 1.0, 1.5), Vector3::new(0.0, 0.1, 0.0));
        let seen = pose.inverse_act(&Vector3::new(0.0, 0.1, 0.0));
        assert!(seen.x.abs() < 1e-12 && seen.y.abs() < 1e-12 && seen.z > 0.0);
        let above = pose.inverse_act(&Vector3::new(0.0, 0.1, 0.5));
        assert!(above.y < 0.0 && above.x.abs() < 1e-12);
        assert!(looking(Vector3::z(), Vector3::zeros()).matrix().iter().all(|x| x.is_finite()));
    }
}
