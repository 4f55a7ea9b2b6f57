//! Jumps of the odometry, as after a loss of tracking.
use super::Frame;
use manifactor_formats::plausible::median;
use manifactor_geometry::Se3;
use nalgebra::Vector3;
use serde::Serialize;

/// A step of the odometry that no camera can make.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OdometryJump {
    /// Timestamp of the frame after the jump. Unit: seconds.
    pub timestamp: f64,
    /// Time since the frame before. Unit: seconds.
    pub seconds: f64,
    /// Length of the step beyond the motion of its neighbours. Unit: metres.
    pub translation: f64,
    /// Angle of the step beyond the motion of its neighbours. Unit: radians.
    pub rotation: f64,
}

/// Largest acceleration of a camera, five times gravity. Unit: m/s².
const MAX_ACCELERATION: f64 = 50.0;
/// Largest angular acceleration of a camera. Unit: rad/s².
const MAX_ANGULAR_ACCELERATION: f64 = 100.0;
/// A jump exceeds the usual change from step to step by this factor, so that the noise of the odometry is none.
const NOISE_FACTOR: f64 = 10.0;
/// Smaller steps are no jumps at any rate of frames. Unit: m and rad.
const MIN_JUMP: f64 = 0.05;
/// Number of steps that give the usual change.
const WINDOW: usize = 300;

/// Translation and rotation between consecutive frames, and their time difference.
type Step = (Vector3<f64>, Vector3<f64>, f64);

/// Returns all jumps.
pub fn find_jumps(frames: &[Frame]) -> Vec<OdometryJump> {
    (0..frames.len()).filter_map(|frame| jump_at(frames, frame)).collect()
}

/// Returns the jump between a frame and the one before. It needs two frames before and one after: a step is a jump if
/// its speed differs from the speeds of both neighbours by more than a camera can accelerate. `None` if there is no jump.
pub fn jump_at(frames: &[Frame], frame: usize) -> Option<OdometryJump> {
    let [translation, rotation] = excess(frames, frame)?;
    let (_, _, seconds) = step(frames, frame)?;
    let limits =
        [MAX_ACCELERATION, MAX_ANGULAR_ACCELERATION].map(|limit| MIN_JUMP + limit * seconds * seconds);
    // most steps end here, before the neighbours are needed
    if translation <= limits[0] && rotation <= limits[1] {
        return None;
    }
    let around = frame.saturating_sub(WINDOW)..frames.len().min(frame + WINDOW);
    let all: Vec<[f64; 2]> = around.filter_map(|frame| excess(frames, frame)).collect();
    let usual = [0, 1].map(|i| median(all.iter().map(|excess| excess[i]).collect()));
    let is_jump =
        translation > limits[0] + NOISE_FACTOR * usual[0] || rotation > limits[1] + NOISE_FACTOR * usual[1];
    let timestamp = frames.get(frame)?.timestamp;
    is_jump.then_some(OdometryJump { timestamp, seconds, translation, rotation })
}

fn step(frames: &[Frame], frame: usize) -> Option<Step> {
    let [from, to] = [frames.get(frame.checked_sub(1)?)?, frames.get(frame)?];
    let Se3 { rotation, translation } = from.world_from_camera.between(&to.world_from_camera);
    let seconds = to.timestamp - from.timestamp;
    (seconds > 0.0).then(|| (translation, rotation.log(), seconds))
}

/// Returns how far a step exceeds the motion of the more similar one of its neighbours: metres, radians.
fn excess(frames: &[Frame], frame: usize) -> Option<[f64; 2]> {
    let (v, w, seconds) = step(frames, frame)?;
    let beyond = |(of, angle, time): Step| {
        [(v / seconds - of / time).norm() * seconds, (w / seconds - angle / time).norm() * seconds]
    };
    let [before, after] = [beyond(step(frames, frame - 1)?), beyond(step(frames, frame + 1)?)];
    Some([before[0].min(after[0]), before[1].min(after[1])])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    /// A camera that moves and turns, 30 frames per second; from frame 20 on, its odometry is off.
    fn frames(off: &Se3) -> Vec<Frame> {
        let pose =
            |t: f64| Se3::exp(&Vector6::new(0.2 * t.sin(), 0.5 * t, 0.0, t, 0.3 * (2.0 * t).cos(), 0.0));
        let at = |i: u32| {
            let t = f64::from(i) / 30.0;
            let pose = if i < 20 { pose(t) } else { off.compose(&pose(t)) };
            Frame::new(t, pose)
        };
        (0..60).map(at).collect()
    }

    #[test]
    fn a_jump_is_found_and_usual_motion_is_none() {
        assert!(find_jumps(&frames(&Se3::identity())).is_empty());
        for off in [Vector6::new(0.0, 0.0, 0.0, 0.4, 0.0, 0.0), Vector6::new(0.0, 0.4, 0.0, 0.0, 0.0, 0.0)] {
            let found = find_jumps(&frames(&Se3::exp(&off)));
            assert_eq!(found.len(), 1, "{found:?}");
            assert!((found[0].timestamp - 20.0 / 30.0).abs() < 1e-9);
            assert!(found[0].translation.max(found[0].rotation) > 0.3, "{found:?}");
        }
    }

    #[test]
    fn a_gap_in_time_and_noise_are_no_jumps() {
        let mut gap = frames(&Se3::identity());
        gap.drain(20..50);
        assert!(find_jumps(&gap).is_empty());
        let mut noisy = frames(&Se3::identity());
        for (frame, i) in noisy.iter_mut().zip(0..) {
            let wave = f64::from(i * 7919 % 101) / 101.0 - 0.5;
            frame.world_from_camera.translation.x += 0.06 * wave;
        }
        assert!(find_jumps(&noisy).is_empty());
    }
}
