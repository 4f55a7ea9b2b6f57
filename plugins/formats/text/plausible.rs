//! Plausibility checks: signs that a file uses different units or a different order of numbers.
use manifactor_geometry::Se3;

/// Minimum number of steps between poses for a meaningful median.
const MIN_STEPS: usize = 3;
/// Largest plausible distance between poses, in metres.
const MAX_DISTANCE_M: f64 = 100.0;
/// Largest plausible speed, in metres per second.
const MAX_SPEED: f64 = 50.0;
/// Largest plausible time between frames, in seconds.
const MAX_INTERVAL_S: f64 = 10.0;
/// Smallest x entry of a quaternion that counts as nearly half a turn about x.
const MIN_HALF_TURN_X: f64 = 0.9;

/// Returns doubts about poses that are relative to the previous one, as text.
pub fn relative_pose_doubts<'a>(relative: impl Iterator<Item = &'a Se3>) -> Vec<String> {
    let (lengths, turned): (Vec<f64>, Vec<bool>) =
        relative.map(|step| (step.translation.norm(), is_turned(step))).unzip();
    let mut doubts = vec![];
    if lengths.len() < MIN_STEPS {
        return doubts;
    }
    if 2 * turned.iter().filter(|turned| **turned).count() > turned.len() {
        doubts.push(
            "most poses are half a turn about x from the one before, as 1 0 0 0 reads: quaternions are x y z w here; are these \
             w x y z?"
                .to_owned(),
        );
    }
    let length = median(lengths);
    if length > MAX_DISTANCE_M {
        doubts.push(format!(
            "by the median, a pose is {length:.0} m from the one before: lengths are metres here; are these millimetres?"
        ));
    }
    doubts
}

/// Returns doubts about a trajectory with times in seconds, as text.
pub fn trajectory_doubts(poses: impl Iterator<Item = (f64, Se3)>) -> Vec<String> {
    let poses: Vec<(f64, Se3)> = poses.collect();
    let mut doubts = vec![];
    if poses.len() <= MIN_STEPS {
        return doubts;
    }
    // Odometry usually begins at its origin, with the identity quaternion.
    if poses.first().is_some_and(|(_, pose)| pose.rotation.quaternion_xyzw()[0].abs() == 1.0) {
        doubts.push(
            "the first pose is turned by half a turn about x, as 1 0 0 0 reads: quaternions are x y z w here; are these \
             w x y z?"
                .to_owned(),
        );
    }
    let steps = poses.windows(2).filter_map(|pair| match pair {
        [(t, a), (next, b)] => Some((next - t, (b.translation - a.translation).norm())),
        _ => None,
    });
    let (times, speeds): (Vec<f64>, Vec<f64>) = steps.map(|(t, length)| (t, length / t)).unzip();
    let (time, speed) = (median(times), median(speeds));
    if time > MAX_INTERVAL_S {
        doubts.push(format!(
            "by the median, a frame is {time:.3e} s after the one before: time stamps are seconds here; are these milli- or \
             nanoseconds?"
        ));
    }
    if speed > MAX_SPEED {
        doubts.push(format!(
            "by the median, the camera moves at {speed:.0} m/s: lengths are metres here; are these millimetres?"
        ));
    }
    doubts
}

fn is_turned(step: &Se3) -> bool {
    step.rotation.quaternion_xyzw()[0].abs() > MIN_HALF_TURN_X
}

/// Returns the median; 0 for an empty list.
pub fn median(mut list: Vec<f64>) -> f64 {
    list.sort_unstable_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use nalgebra::Vector3;

    fn walk(xyzw: [f64; 4], unit: f64, second: f64) -> Vec<(f64, Se3)> {
        let rotation = So3::from_quaternion_xyzw(xyzw).unwrap();
        let at = |i: f64| (i * second / 30.0, Se3::new(rotation, Vector3::new(0.01 * i * unit, 0.0, 0.0)));
        (0..9).map(|i| at(f64::from(i))).collect()
    }
    fn doubts(xyzw: [f64; 4], unit: f64, second: f64) -> String {
        trajectory_doubts(walk(xyzw, unit, second).into_iter()).join("; ")
    }

    #[test]
    fn other_units_and_another_order_are_reported_and_usual_ones_are_not() {
        const NONE: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
        assert_eq!(doubts(NONE, 1.0, 1.0), "");
        assert_eq!(doubts([0.6, 0.0, 0.0, 0.8], 100.0, 1.0), "");
        assert!(doubts(NONE, 1000.0, 1.0).contains("moves at 300 m/s"));
        assert!(doubts([1.0, 0.0, 0.0, 0.0], 1.0, 1.0).contains("are these w x y z?"));
        assert!(doubts(NONE, 1.0, 1e9).contains("seconds here"));
    }

    #[test]
    fn steps_are_looked_at_without_time_too() {
        let step = |xyzw, length| Se3::new(So3::from_quaternion_xyzw(xyzw).unwrap(), Vector3::x() * length);
        let steps = |xyzw, length| relative_pose_doubts([step(xyzw, length); 5].iter()).join("; ");
        assert_eq!(steps([0.1, 0.0, 0.0, 0.995], 1.0), "");
        assert!(steps([0.995, 0.1, 0.0, 0.0], 1.0).contains("are these w x y z?"));
        assert!(steps([0.0, 0.0, 0.0, 1.0], 1000.0).contains("are these millimetres?"));
        assert_eq!(relative_pose_doubts([].iter()), Vec::<String>::new());
    }
}
