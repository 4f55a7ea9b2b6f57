//! True, odometry and estimated position and orientation over time, as in evo.
use super::clock;
use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Picture, TIME, figure};
use manifactor_geometry::Se3;
use manifactor_slam::record::{FrameRecord, VariantRecord};

type Part = fn(&FrameRecord) -> Option<Se3>;
const TRACKS: [(&str, Ink, Part); 3] = [
    ("true", Ink::Truth, |f| f.truth),
    ("odometry", Ink::Odometry, |f| Some(f.odometry.pose)),
    ("estimated", Ink::Estimate, |f| Some(f.estimate.pose)),
];

/// Draws x, y and z.
pub(super) fn positions(variant: &VariantRecord, width: f64) -> Option<Picture> {
    let of = |poses: &[Se3]| poses.iter().map(|pose| pose.translation.into()).collect();
    picture(variant, "xyz", "position over time", ["x (m)", "y (m)", "z (m)"], of, width)
}

/// Draws roll, pitch and yaw, the successive rotations about x, y and z.
pub(super) fn angles(variant: &VariantRecord, width: f64) -> Option<Picture> {
    let of = |poses: &[Se3]| {
        let angles = poses.iter().map(|pose| {
            let (roll, pitch, yaw) = pose.rotation.quaternion().euler_angles();
            [roll, pitch, yaw].map(f64::to_degrees)
        });
        unwrapped(angles.collect())
    };
    picture(variant, "rpy", "roll, pitch and yaw over time", ["roll (°)", "pitch (°)", "yaw (°)"], of, width)
}

fn picture(
    variant: &VariantRecord,
    name: &str,
    text: &str,
    labels: [&str; 3],
    numbers: impl Fn(&[Se3]) -> Vec<[f64; 3]>,
    width: f64,
) -> Option<Picture> {
    let clock = clock(variant);
    let mut panels = labels.map(|y| Chart { y: y.to_owned(), ..Chart::default() });
    for (name, ink, of) in TRACKS {
        let poses: Vec<Option<Se3>> = variant.frames.iter().map(of).collect();
        let mut numbers = numbers(&poses.iter().copied().flatten().collect::<Vec<_>>()).into_iter();
        let numbers: Vec<_> =
            poses.iter().map(|pose| pose.and_then(|_| numbers.next()).unwrap_or([f64::NAN; 3])).collect();
        for (i, panel) in panels.iter_mut().enumerate() {
            let points = variant.frames.iter().zip(&numbers).map(|(f, n)| (clock(f.timestamp), n[i]));
            let curve = Curve::new(name, ink, points.collect());
            panel.curves.push(if ink == Ink::Truth { curve.dashed() } else { curve });
        }
    }
    // the truth is drawn over the remaining curves
    panels.iter_mut().for_each(|panel| panel.curves.rotate_left(1));
    let sheet = figure(text, TIME, false, &panels, width, 0.9 * width)?;
    Some(Picture::new(name, text, sheet))
}

/// Removes jumps by a whole turn from angles in degrees.
fn unwrapped(mut angles: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let mut before: Option<[f64; 3]> = None;
    for angle in &mut angles {
        if let Some(before) = before {
            for (own, before) in angle.iter_mut().zip(before) {
                *own -= 360.0 * ((*own - before) / 360.0).round();
            }
        }
        before = Some(*angle);
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::unwrapped;

    #[test]
    fn a_whole_turn_is_no_jump() {
        let angles =
            unwrapped(vec![[170.0, 0.0, 0.0], [-170.0, 1.0, 0.0], [-150.0, 2.0, 0.0], [170.0, 0.0, 0.0]]);
        assert_eq!(angles.iter().map(|a| a[0]).collect::<Vec<_>>(), [170.0, 190.0, 210.0, 170.0]);
    }
}
