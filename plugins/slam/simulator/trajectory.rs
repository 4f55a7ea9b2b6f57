//! How the camera moves: on an arc around the scene, up and down, in and out, its eye on the objects.
use manifactor_geometry::{Se3, So3};
use manifactor_graph::checked::{Count, Finite, NotNegative, Positive};
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// An arc around the origin. Its first angle, its waves and where it looks depend on `seed`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrajectorySettings {
    /// What the trajectory depends on, and nothing else does.
    pub seed: u64,
    /// Number of images.
    pub frames: Count<2, 1_000_000>,
    /// Time between two images, in seconds.
    pub interval: Positive,
    /// How far around it goes, in degrees.
    pub sweep: Finite,
    /// Mean distance from the vertical axis, in metres.
    pub radius: Positive,
    /// Mean height over the plane, in metres.
    pub height: Finite,
    /// By how much distance and height vary, in metres.
    pub waves: [NotNegative; 2],
    /// How far from the scene's centre the eye wanders, in metres.
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
    /// `world_from_camera` for each image, for objects that rest at a height.
    pub fn poses(&self, ground: f64, rng: &mut Pcg64) -> Vec<Se3> {
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

/// A camera at `eye` that looks at `target`, upright: z forward, x right, y down.
fn looking(eye: Vector3<f64>, target: Vector3<f64>) -> Se3 {
    let forward = (target - eye).normalize();
    let right = forward.cross(&Vector3::z());
    // straight up or down, any right will do
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
