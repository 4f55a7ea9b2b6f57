//! Trajectories in TUM RGB-D format: `timestamp tx ty tz qx qy qz qw`, one pose per line.
//!
//! Seconds, metres and a unit quaternion; the pose is `world_from_camera`. Timestamps must increase, with two
//! exceptions that published files need. A line that is late by at most 0.05 s is moved to its place. Of two
//! lines with equal timestamps, the first is used. Both cases are reported.
use crate::error::{FormatError, Mistake, ProblemList};
use crate::lines::{Fields, lines};
use crate::text::words::{count, list};
use crate::text::{read_text, write_text};
use manifactor_geometry::{Se3, So3};
use manifactor_graph::Manifold;
use std::fmt::Write;
use std::path::Path;

/// A pose with its timestamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedPose {
    /// Timestamp, in seconds.
    pub timestamp: f64,
    /// The pose `world_from_camera`.
    pub pose: Se3,
}

impl StampedPose {
    /// Returns the pose at a time between this one and `to`, on the geodesic of SE(3) with constant twist.
    pub fn interpolate(&self, to: &Self, timestamp: f64) -> Se3 {
        let share = (timestamp - self.timestamp) / (to.timestamp - self.timestamp);
        self.pose.retract(&(self.pose.local(&to.pose) * share))
    }
}

/// Maximum lateness of a line relative to the previous one, in seconds.
pub(crate) const MAX_LATENESS_S: f64 = 0.05;

/// A trajectory, and the repairs that its file needed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    /// Poses with strictly increasing timestamps.
    pub poses: Vec<StampedPose>,
    /// Lines, from 1, that were late and were moved to their place.
    pub moved: Vec<usize>,
    /// Lines, from 1, that repeat a timestamp and were omitted.
    pub dropped: Vec<usize>,
}

/// Reads a trajectory.
///
/// # Errors
/// If the columns are separated by commas. If a line has missing, extra or non-finite fields, a quaternion
/// whose length differs from 1 by more than 0.001, or a timestamp more than 0.05 s before the previous one;
/// the error lists all such lines. If the file has no pose.
pub fn read(path: impl AsRef<Path>) -> Result<Trajectory, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path)
}

/// Works like [`read`], for a given text; `path` is used only in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Trajectory, FormatError> {
    let mut problems = ProblemList::of(path.as_ref(), text);
    let mut trajectory = Trajectory::default();
    let mut empty = true;
    if let Some((line, _)) = lines(text).next().filter(|(_, first)| first.contains(',')) {
        // one error for the whole file instead of one per line
        problems.push(line, Mistake::Commas);
        return problems.finish().map(|()| trajectory);
    }
    for (line, text) in lines(text) {
        empty = false;
        let added = stamped_pose(text).and_then(|pose| trajectory.add(line, pose));
        problems.ok(line, added);
    }
    if empty {
        problems
            .push(0, Mistake::Empty { expected: "poses (timestamp tx ty tz qx qy qz qw)", unknown: vec![] });
    }
    problems.finish().map(|()| trajectory)
}

impl Trajectory {
    /// Returns notes about lines that are not where or what they should be.
    pub fn notes(&self) -> Vec<String> {
        let lines = |lines: &[usize]| format!("{} ({})", count(lines.len(), "line"), list(lines.iter()));
        let mut notes = vec![];
        if !self.dropped.is_empty() {
            let those = lines(&self.dropped);
            notes.push(format!(
                "{those} with the timestamp of an earlier line: left out; the first line counts"
            ));
        }
        if !self.moved.is_empty() {
            notes.push(format!("{} late: moved to their place by time", lines(&self.moved)));
        }
        notes
    }

    fn add(&mut self, line: usize, pose: StampedPose) -> Result<(), Mistake> {
        let latest = self.poses.last().map_or(f64::NEG_INFINITY, |p| p.timestamp);
        if pose.timestamp < latest - MAX_LATENESS_S {
            return Err(Mistake::NotIncreasing { previous: latest, found: pose.timestamp });
        }
        let place = self.poses.partition_point(|p| p.timestamp < pose.timestamp);
        if self.poses.get(place).is_some_and(|p| p.timestamp == pose.timestamp) {
            self.dropped.push(line);
            return Ok(());
        }
        if place < self.poses.len() {
            self.moved.push(line);
        }
        self.poses.insert(place, pose);
        Ok(())
    }
}

fn stamped_pose(text: &str) -> Result<StampedPose, Mistake> {
    let mut fields = Fields::of(text, "timestamp tx ty tz qx qy qz qw")?;
    let timestamp = fields.number()?;
    Ok(StampedPose { timestamp, pose: pose(&mut fields)? })
}

/// Parses `x y z qx qy qz qw`.
pub(crate) fn pose(fields: &mut Fields<'_>) -> Result<Se3, Mistake> {
    let translation = fields.numbers::<3>()?.into();
    Ok(Se3::new(So3::from_quaternion_xyzw(fields.numbers()?)?, translation))
}

pub(crate) fn check_increasing(previous: Option<f64>, found: f64) -> Result<(), Mistake> {
    match previous {
        Some(previous) if found <= previous => Err(Mistake::NotIncreasing { previous, found }),
        _ => Ok(()),
    }
}

/// Returns the text of a trajectory; [`parse`] reads it back bit for bit.
pub fn format(trajectory: &[StampedPose]) -> String {
    let mut text = String::from("# timestamp tx ty tz qx qy qz qw\n");
    for StampedPose { timestamp, pose } in trajectory {
        let [x, y, z]: [f64; 3] = pose.translation.into();
        let [qx, qy, qz, qw] = pose.rotation.quaternion_xyzw();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{timestamp} {x} {y} {z} {qx} {qy} {qz} {qw}");
    }
    text
}

/// Writes a trajectory.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: impl AsRef<Path>, trajectory: &[StampedPose]) -> Result<(), FormatError> {
    write_text(path.as_ref(), &format(trajectory))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector3, Vector6};
    use proptest::prelude::*;

    fn errors(text: &str) -> String {
        parse(text, "t.txt").unwrap_err().to_string()
    }

    #[test]
    fn every_malformed_line_is_reported_with_its_place() {
        let text = "# t\n0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0\n2 0 0 nan 0 0 0 1\n3 0 0 0 0 0 1 1\n";
        assert_eq!(
            errors(text),
            "t.txt:3: expected 8 fields (timestamp tx ty tz qx qy qz qw), got 7\n\
             t.txt:4: expected a finite number, got `nan`\n\
             t.txt:5: expected a unit quaternion (x, y, z, w), got [0.0, 0.0, 1.0, 1.0] of length \
             1.4142135623730951; its length has to be 1 to within 0.001"
        );
    }

    #[test]
    fn commas_are_one_error() {
        let text = "#timestamp,tx,ty,tz,qx,qy,qz,qw\n1,0,0,0,0,0,0,1\n2,0,0,0,0,0,0,1\n";
        let found = errors(text);
        assert!(found.starts_with("t.txt:2: ") && found.lines().count() == 1, "{found}");
        assert!(found.contains("replace the commas"), "{found}");
    }

    #[test]
    fn time_has_to_increase() {
        let text = "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n1.94 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1";
        assert_eq!(errors(text), "t.txt:3: time stamps have to increase: 1.94 follows 2");
    }

    #[test]
    fn a_late_line_is_moved_and_a_repeated_time_stamp_dropped() {
        let text = "1 0 0 0 0 0 0 1\n1.01 0 0 0 0 0 0 1\n1.005 2 0 0 0 0 0 1\n1.01 9 9 9 0 0 0 1";
        let trajectory = parse(text, "t").unwrap();
        let x: Vec<_> = trajectory.poses.iter().map(|p| (p.timestamp, p.pose.translation.x)).collect();
        assert_eq!(x, [(1.0, 0.0), (1.005, 2.0), (1.01, 0.0)]);
        assert_eq!((trajectory.moved, trajectory.dropped), (vec![3], vec![4]));
    }

    #[test]
    fn a_file_without_poses_is_an_error() {
        assert!(errors("# nothing\n\n").starts_with("t.txt: expected poses"));
    }

    #[test]
    fn the_first_twenty_problems_are_reported_and_the_rest_is_counted() {
        let text = errors(&"x\n".repeat(30));
        assert_eq!(text.lines().count(), 21);
        assert!(text.ends_with("\nand 10 more"));
    }

    proptest! {
        #[test]
        fn a_written_trajectory_reads_back_bit_for_bit(
            steps in prop::collection::vec((1e-6..1e3f64, prop::array::uniform6(-5.0..5.0f64)), 1..20)
        ) {
            let mut timestamp = 1_305_031_449.799_6;
            let trajectory: Vec<_> = steps.iter().map(|(dt, xi)| {
                timestamp += dt;
                let pose = Se3::exp(&Vector6::from(*xi));
                // The length of a product may deviate from 1 by more than the reader accepts as rounding.
                let rotation = So3::from_quaternion_xyzw(pose.rotation.quaternion_xyzw()).unwrap();
                StampedPose { timestamp, pose: Se3::new(rotation, pose.translation * 1e3 + Vector3::repeat(0.1)) }
            }).collect();
            prop_assert_eq!(parse(&format(&trajectory), "t").unwrap().poses, trajectory);
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in "([-+0-9.eEna#x \t]{0,60}\n){0,5}") {
            let _ = parse(&text, "t");
        }
    }
}
