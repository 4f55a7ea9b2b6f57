//! Tables of visual-inertial recordings: samples of an IMU, tracks of points in images, reference states.
//!
//! The tables are CSV with a header, such as those of the EuRoC dataset. Columns are found by their names, in
//! any order. Rows without a value in any of the required columns belong to a different table, and are
//! skipped; a file may therefore hold several tables.
pub mod accelerometer;
mod columns;

use crate::error::{FormatError, Mistake, ProblemList};
use crate::text::read_text;
use crate::tum::StampedPose;
use columns::Column;
use manifactor_geometry::{Se3, So3};
use manifactor_inertial::{ImuReading, MAX_RATE};
use nalgebra::{Vector2, Vector3};
use std::path::Path;

const TIME: Column = Column { name: "timestamp", others: &["time", "t_abs", "stamp", "t"] };

const IMU: [Column; 7] = [
    TIME,
    Column { name: "wx", others: &["w_RS_S_x", "gx", "gyro_x", "omega_x", "angular_velocity_x"] },
    Column { name: "wy", others: &["w_RS_S_y", "gy", "gyro_y", "omega_y", "angular_velocity_y"] },
    Column { name: "wz", others: &["w_RS_S_z", "gz", "gyro_z", "omega_z", "angular_velocity_z"] },
    Column { name: "ax", others: &["a_RS_S_x", "accel_x", "alpha_x", "linear_acceleration_x"] },
    Column { name: "ay", others: &["a_RS_S_y", "accel_y", "alpha_y", "linear_acceleration_y"] },
    Column { name: "az", others: &["a_RS_S_z", "accel_z", "alpha_z", "linear_acceleration_z"] },
];

/// Range of plausible medians of the specific force, in m/s². A sensor in units of g has a median of one.
const FORCES: [f64; 2] = [3.0, 30.0];

/// Reads the samples of an IMU: columns `timestamp` (s, or ns as `timestamp [ns]`), `wx`, `wy`, `wz` (rad/s),
/// `ax`, `ay`, `az` (m/s²), or their names in EuRoC.
///
/// # Errors
/// If a column is missing, a row is malformed, timestamps do not increase, or the units are implausible.
pub fn read_imu(path: impl AsRef<Path>) -> Result<Vec<ImuReading>, FormatError> {
    read_readings(path.as_ref(), true)
}

/// Reads the samples of an IMU like [`read_imu`], in any unit.
///
/// # Errors
/// If a column is missing, a row is malformed, or timestamps do not increase.
pub fn read_imu_in_any_unit(path: impl AsRef<Path>) -> Result<Vec<ImuReading>, FormatError> {
    read_readings(path.as_ref(), false)
}

fn read_readings(path: &Path, has_units: bool) -> Result<Vec<ImuReading>, FormatError> {
    let text = read_text(path)?;
    let mut problems = ProblemList::of(path, &text);
    let mut rows: Vec<ImuReading> = vec![];
    for (line, [timestamp, wx, wy, wz, ax, ay, az]) in columns::rows(&text, &IMU, &mut problems) {
        let row = ImuReading {
            timestamp,
            gyroscope: Vector3::new(wx, wy, wz),
            accelerometer: Vector3::new(ax, ay, az),
        };
        let rate = row.gyroscope.norm();
        if let Some(previous) = rows.last().map(|row| row.timestamp).filter(|before| timestamp <= *before) {
            problems.push(line, Mistake::NotIncreasing { previous, found: timestamp });
        } else if has_units && rate > MAX_RATE {
            let message = format!("a rate of {rate:.1} rad/s is implausible: convert degrees to radians");
            problems.push(line, Mistake::Row(message));
        } else {
            rows.push(row);
        }
    }
    let mut forces: Vec<f64> = rows.iter().map(|row| row.accelerometer.norm()).collect();
    forces.sort_by(f64::total_cmp);
    let median = forces.get(forces.len() / 2).copied().filter(|_| has_units);
    if let Some(median) = median.filter(|force| !(FORCES[0]..FORCES[1]).contains(force)) {
        let remedy = if (0.8..1.2).contains(&median) {
            "it looks like units of g: multiply by 9.81"
        } else {
            "gravity belongs to the measurement: do not subtract it"
        };
        let message = format!("the median specific force is {median:.2} m/s², expected about 9.8: {remedy}");
        problems.push(0, Mistake::Row(message));
    }
    problems.finish().map(|()| rows)
}

/// A point of a track: a landmark in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackRow {
    /// Timestamp of the image, in seconds.
    pub timestamp: f64,
    /// Number of the landmark, the same in all images.
    pub landmark: u64,
    /// Image point without distortion: a pixel, or on the plane at depth one.
    pub point: Vector2<f64>,
}

/// Above it, two numbers can be one double.
const MAX_LANDMARK: f64 = 9_007_199_254_740_992.0;

/// Points of tracks, in the order of their timestamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks {
    /// The points.
    pub rows: Vec<TrackRow>,
    /// Whether they are on the plane at depth one instead of in pixels.
    pub is_normalized: bool,
}

/// Reads tracks of points: columns `timestamp`, `landmark`, and `u`, `v` (pixels) or `u_norm`, `v_norm` (on the
/// plane at depth one). Distortion has to be removed.
///
/// # Errors
/// If a column is missing, a row is malformed, timestamps decrease, or a landmark is twice in one image.
pub fn read_tracks(path: impl AsRef<Path>) -> Result<Tracks, FormatError> {
    const LANDMARK: Column =
        Column { name: "landmark", others: &["landmark_id", "feature_id", "track_id", "id"] };
    const PIXEL: [Column; 4] = [
        TIME,
        LANDMARK,
        Column { name: "u", others: &["x", "px"] },
        Column { name: "v", others: &["y", "py"] },
    ];
    const NORMALIZED: [Column; 4] =
        [TIME, LANDMARK, Column { name: "u_norm", others: &[] }, Column { name: "v_norm", others: &[] }];
    let path = path.as_ref();
    let text = read_text(path)?;
    let mut problems = ProblemList::of(path, &text);
    let is_normalized = columns::header(&text).any(|name| name == "u_norm");
    let wanted = if is_normalized { &NORMALIZED } else { &PIXEL };
    let mut rows: Vec<TrackRow> = vec![];
    let mut seen = std::collections::BTreeSet::new();
    for (line, [timestamp, landmark, u, v]) in columns::rows(&text, wanted, &mut problems) {
        if !(0.0..MAX_LANDMARK).contains(&landmark) || landmark.fract() != 0.0 {
            let field = Mistake::Field {
                expected: "the number of a landmark, from 0 to 9007199254740991",
                found: landmark.to_string(),
            };
            problems.push(line, field);
            continue;
        }
        let row = TrackRow { timestamp, landmark: landmark as u64, point: Vector2::new(u, v) };
        let previous = rows.last().map_or(f64::NEG_INFINITY, |row| row.timestamp);
        if timestamp > previous {
            seen.clear();
        }
        if timestamp < previous {
            problems.push(line, Mistake::NotIncreasing { previous, found: timestamp });
        } else if !seen.insert(row.landmark) {
            let message =
                format!("landmark {landmark} is twice in the image at {timestamp}: remove one of the two");
            problems.push(line, Mistake::Row(message));
        } else {
            rows.push(row);
        }
    }
    problems.finish().map(|()| Tracks { rows, is_normalized })
}

/// Reads the reference of the EuRoC dataset as a trajectory: columns `timestamp`, `px`, `py`, `pz`, and the
/// quaternion `qw`, `qx`, `qy`, `qz`.
///
/// # Errors
/// If a column is missing, a row is malformed, timestamps do not increase, or a quaternion is no rotation.
pub fn read_states(path: impl AsRef<Path>) -> Result<Vec<StampedPose>, FormatError> {
    const STATES: [Column; 8] = [
        TIME,
        Column { name: "px", others: &["p_RS_R_x", "x", "tx"] },
        Column { name: "py", others: &["p_RS_R_y", "y", "ty"] },
        Column { name: "pz", others: &["p_RS_R_z", "z", "tz"] },
        Column { name: "qw", others: &["q_RS_w"] },
        Column { name: "qx", others: &["q_RS_x"] },
        Column { name: "qy", others: &["q_RS_y"] },
        Column { name: "qz", others: &["q_RS_z"] },
    ];
    let path = path.as_ref();
    let text = read_text(path)?;
    let mut problems = ProblemList::of(path, &text);
    let mut poses: Vec<StampedPose> = vec![];
    for (line, [timestamp, x, y, z, qw, qx, qy, qz]) in columns::rows(&text, &STATES, &mut problems) {
        let previous = poses.last().map_or(f64::NEG_INFINITY, |pose| pose.timestamp);
        if timestamp <= previous {
            problems.push(line, Mistake::NotIncreasing { previous, found: timestamp });
            continue;
        }
        let rotation = So3::from_quaternion_xyzw([qx, qy, qz, qw]).map_err(Mistake::from);
        let pose = rotation
            .map(|rotation| StampedPose { timestamp, pose: Se3::new(rotation, Vector3::new(x, y, z)) });
        poses.extend(problems.ok(line, pose));
    }
    problems.finish().map(|()| poses)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn file(text: &str) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file
    }

    fn imu_error(text: &str) -> String {
        read_imu(file(text).path()).unwrap_err().to_string()
    }

    #[test]
    fn euroc_samples_are_read_in_seconds() {
        let text = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],\
                    a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n\
                    1000000000,0.1,0.2,0.3,8.1,-0.3,-2.4\n1005000000,0.1,0.2,0.3,9.8,0,0\n";
        let rows = read_imu(file(text).path()).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[1].timestamp, 1.005);
        assert_eq!(rows[0].gyroscope, Vector3::new(0.1, 0.2, 0.3));
        assert_eq!(rows[1].accelerometer, Vector3::new(9.8, 0.0, 0.0));
    }

    #[test]
    fn a_file_with_two_tables_gives_both() {
        let text = "kind,t_abs,landmark_id,gx,gy,gz,ax,ay,az,u_norm,v_norm\n\
                    imu,1.0,,0,0,0,0,0,9.8,,\nfeature,1.0,7,,,,,,,0.1,0.2\nimu,1.1,,0,0,0,0,0,9.8,,\n";
        let file = file(text);
        assert_eq!(read_imu(file.path()).unwrap().len(), 2);
        let tracks = read_tracks(file.path()).unwrap();
        assert!(tracks.is_normalized);
        let expected = TrackRow { timestamp: 1.0, landmark: 7, point: Vector2::new(0.1, 0.2) };
        assert_eq!(tracks.rows, [expected]);
    }

    #[test]
    fn wrong_units_are_named() {
        let header = "timestamp,wx,wy,wz,ax,ay,az\n";
        let degrees = imu_error(&format!("{header}1,300,0,0,0,0,9.8\n"));
        assert!(degrees.contains("convert degrees to radians"), "{degrees}");
        let g = imu_error(&format!("{header}1,0,0,0,0,0,1.0\n"));
        assert!(g.contains("units of g: multiply by 9.81"), "{g}");
        let nanoseconds = imu_error(&format!("{header}1403715273262142976,0,0,0,0,0,9.8\n"));
        assert!(nanoseconds.contains("`timestamp [ns]`"), "{nanoseconds}");
    }

    #[test]
    fn wrong_rows_are_named() {
        let header = "timestamp,wx,wy,wz,ax,ay,az\n";
        let missing = imu_error("timestamp,wx,wy,wz,ax,ay\n1,0,0,0,0,0\n");
        assert!(missing.contains("az"), "{missing}");
        let partial = imu_error(&format!("{header}1,0,,0,0,0,9.8\n"));
        assert!(partial.contains("`wy`"), "{partial}");
        let number = imu_error(&format!("{header}1,0,nan,0,0,0,9.8\n"));
        assert!(number.contains("finite number"), "{number}");
        let backward = imu_error(&format!("{header}2,0,0,0,0,0,9.8\n1,0,0,0,0,0,9.8\n"));
        assert!(backward.contains("have to increase"), "{backward}");
        let twice = read_tracks(file("timestamp,landmark,u,v\n1,2,3,4\n1,2,3,5\n").path()).unwrap_err();
        assert!(twice.to_string().contains("landmark 2 is twice"), "{twice}");
    }
}
