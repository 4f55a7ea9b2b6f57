//! A simulated flight, for tests: a room of points, an IMU that rests for a second and then moves.
use crate::diagnosis::Image;
use crate::samples::ImuReading;
use manifactor_geometry::{Camera, CameraModel, ImuBias, Se3, So3};
use nalgebra::{Vector2, Vector3, Vector6};

/// Rate of the IMU, in Hz.
const RATE: usize = 200;
/// Readings from one image to the next.
const READINGS_PER_IMAGE: usize = 10;

/// A simulated flight.
#[derive(Debug, Clone)]
pub struct SimulatedFlight {
    /// Readings of the IMU, with bias and noise.
    pub readings: Vec<ImuReading>,
    /// Images at 20 Hz, with a noise of half a pixel. One track in ten is wrong.
    pub images: Vec<Image>,
    /// True pose of the IMU at each image. The world's z axis points up.
    pub poses: Vec<Se3>,
    /// The true bias.
    pub bias: ImuBias,
    /// The camera.
    pub camera: Camera,
    /// Pose of the camera in the frame of the IMU.
    pub body_from_camera: Se3,
}

/// Returns the true pose at a time: at rest in the first second, then a loop of 2 m that takes 6 s.
fn pose(time: f64) -> Se3 {
    let moving = (time - 1.0).max(0.0);
    // speeds up within a second, without a jump of the acceleration
    let phase = moving - (1.0 - (-moving.powi(3)).exp()) * 0.5;
    let angle = std::f64::consts::TAU * phase / 6.0 * (1.0 - (-moving.powi(3)).exp());
    let translation = Vector3::new(angle.sin(), 1.0 - angle.cos(), 0.4 * (2.0 * angle).sin());
    let turn = So3::exp(&(Vector3::new(0.2, 0.3, 0.5) * angle.sin()));
    // about a second axis too, so that the rotation of the camera is determined
    Se3::new(turn.compose(&So3::exp(&(Vector3::new(0.3, -0.2, 0.0) * (2.0 * angle).sin()))), translation)
}

/// Returns a number between -1 and 1 that depends on `seed` as if it were random.
fn noise(seed: u64) -> f64 {
    let mut x = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn noise3(seed: u64) -> Vector3<f64> {
    Vector3::from_fn(|i, _| noise(seed.wrapping_mul(3).wrapping_add(i as u64)))
}

impl SimulatedFlight {
    /// Simulates `seconds` of a flight.
    pub fn new(seconds: f64, seed: u64) -> Self {
        let bias = ImuBias(Vector6::new(0.01, -0.02, 0.03, 0.05, -0.04, 0.06));
        let mounting = So3::exp(&Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0));
        let body_from_camera = Se3::new(mounting, Vector3::new(0.05, 0.1, 0.0));
        let camera =
            Camera { fx: 450.0, fy: 450.0, cx: 376.0, cy: 240.0, skew: 0.0, width: 752, height: 480 };
        let count = (seconds * RATE as f64) as usize;
        let reading = |k: usize| {
            // derivatives of the true motion
            const H: f64 = 1e-3;
            let time = k as f64 / RATE as f64;
            let (before, here, after) = (pose(time - H), pose(time), pose(time + H));
            let rate = before.rotation.between(&after.rotation).log() / (2.0 * H);
            let acceleration = (after.translation - here.translation * 2.0 + before.translation) / (H * H);
            let force = here.rotation.inverse().act(&(acceleration + Vector3::new(0.0, 0.0, 9.81)));
            let seed = seed.wrapping_mul(1_000_003).wrapping_add(2 * k as u64);
            ImuReading {
                timestamp: time,
                gyroscope: rate + bias.gyroscope() + noise3(seed) * 4e-3,
                accelerometer: force + bias.accelerometer() + noise3(seed + 1) * 5e-2,
            }
        };
        let points: Vec<Vector3<f64>> =
            (0..80).map(|i| noise3(i).component_mul(&Vector3::new(4.0, 1.0, 3.0))).collect();
        let points: Vec<Vector3<f64>> = points.iter().map(|p| p + Vector3::new(0.0, 5.0, 0.0)).collect();
        let (mut images, mut poses) = (vec![], vec![]);
        for k in (0..count).step_by(READINGS_PER_IMAGE) {
            let time = k as f64 / RATE as f64;
            let body = pose(time);
            let seen_from = body.compose(&body_from_camera);
            let pixel = |(i, point): (usize, &Vector3<f64>)| {
                let seen = seen_from.inverse_act(point);
                let pixel = camera.sees(&seen).then(|| camera.project(&seen))?;
                let seed = seed.wrapping_add((k * 1000 + i) as u64);
                let error = Vector2::new(noise(2 * seed), noise(2 * seed + 1)) * 0.8;
                // a wrong track drifts away
                let slip = if i % 10 == 0 { time * 15.0 } else { 0.0 };
                let pixel = pixel + error + Vector2::new(slip, -slip);
                let inside = pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < 752.0 && pixel.y < 480.0;
                inside.then_some((i as u64, pixel))
            };
            images.push((time, points.iter().enumerate().filter_map(pixel).collect()));
            poses.push(body);
        }
        Self { readings: (0..count).map(reading).collect(), images, poses, bias, camera, body_from_camera }
    }
}
