//! Faults of a recording and their corrections.
use super::Recording;
use manifactor_geometry::{CameraModel, Se3, So3};
use nalgebra::{Matrix3, Vector2, Vector3};
use serde::Serialize;
use std::f64::consts::PI;
use std::fmt;

/// Signed axes: row i of the matrix that they are has its only entry in one column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Axes {
    /// For each axis, the axis that it really is.
    pub axis: [u8; 3],
    /// Whether its sign is wrong.
    pub is_negative: [bool; 3],
}

impl Axes {
    /// Returns all 48 signed permutations, of which half are rotations.
    pub fn all() -> impl Iterator<Item = Self> {
        const ORDERS: [[u8; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        ORDERS.into_iter().flat_map(|axis| {
            (0..8_u8).map(move |signs| Self { axis, is_negative: [0, 1, 2].map(|i| signs >> i & 1 == 1) })
        })
    }

    /// Returns the matrix.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| match usize::from(self.axis[row]) == column {
            true if self.is_negative[row] => -1.0,
            true => 1.0,
            false => 0.0,
        })
    }

    /// Returns the rotation; `None` for a reflection and for no change.
    fn turn(&self) -> Option<So3> {
        let matrix = self.matrix();
        let is_turn = matrix.determinant() > 0.0 && matrix != Matrix3::identity();
        is_turn.then(|| So3::from_matrix(&matrix))
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |i: usize| {
            let sign = if self.is_negative[i] { "-" } else { "" };
            format!("{sign}{}", ["x", "y", "z"][usize::from(self.axis[i])])
        };
        write!(f, "({}, {}, {})", name(0), name(1), name(2))
    }
}

/// A sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// The IMU.
    Imu,
    /// The camera.
    Camera,
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Imu { "IMU" } else { "camera" })
    }
}

/// A fault of a recording or of its calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "fault", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Fault {
    /// Timestamps are in a different unit; times the factor, they are seconds.
    TimeUnit {
        /// The sensor.
        sensor: Sensor,
        /// The unit, in seconds.
        factor: f64,
    },
    /// The clocks have no time in common.
    Clocks {
        /// Seconds to add to the timestamps of the images, so that both begin together.
        seconds: f64,
    },
    /// Pixels are coordinates on the plane at depth one.
    NormalizedPixels,
    /// The gyroscope is in degrees per second.
    GyroscopeInDegrees,
    /// The gyroscope has the opposite sign.
    GyroscopeSign,
    /// The accelerometer is in a different unit.
    AccelerometerUnit {
        /// The unit, in m/s².
        factor: f64,
    },
    /// Gravity was subtracted from the specific force.
    NoGravity,
    /// The accelerometer has the opposite sign.
    AccelerometerSign,
    /// The length of gravity in the settings differs from the recording's.
    Gravity {
        /// Length in the recording, in m/s².
        length: f64,
    },
    /// The pose of the camera is its inverse.
    InverseMounting,
    /// The translation of the camera is in millimetres.
    MountingInMillimetres,
    /// The images are in reverse order.
    ReverseImages,
    /// The time between readings is wrong by a factor.
    Rate {
        /// Factor for the time between readings.
        factor: f64,
    },
    /// The calibration belongs to images of a different size.
    Resolution {
        /// Factor for focal lengths and principal point.
        factor: f64,
    },
    /// The coordinates of the principal point are exchanged.
    ExchangedCentre,
    /// The image's axes are exchanged or mirrored.
    ImageAxes {
        /// Whether u and v are exchanged.
        are_exchanged: bool,
        /// Whether u, and whether v is counted from the other side.
        is_mirrored: [bool; 2],
    },
    /// The camera's axes follow a different convention, at the side of the camera.
    CameraAxes {
        /// The axes.
        axes: Axes,
    },
    /// The camera's axes follow a different convention, at the side of the IMU.
    MountingAxes {
        /// The axes.
        axes: Axes,
    },
    /// The gyroscope has different axes than the accelerometer.
    GyroscopeAxes {
        /// The axes.
        axes: Axes,
    },
    /// The accelerometer has different axes than the gyroscope.
    AccelerometerAxes {
        /// The axes.
        axes: Axes,
    },
    /// The clock of the images is late.
    TimeOffset {
        /// Seconds to add to the timestamps of the images.
        seconds: f64,
    },
    /// The focal lengths are wrong by a factor.
    FocalLength {
        /// Factor for the focal lengths.
        factor: f64,
    },
    /// The pixels have a radial distortion.
    Distortion {
        /// Coefficient k of r² (1 + k r²).
        k: f64,
    },
    /// The camera is turned.
    Mounting {
        /// Rotation of the camera in its own frame, as axis times angle in radians.
        turn: [f64; 3],
    },
}

const DEGREE: f64 = PI / 180.0;

impl Fault {
    /// Returns the faults with no number to be found, the most likely first.
    pub(super) fn all(recording: &Recording) -> Vec<Self> {
        let mut faults = vec![
            Self::GyroscopeInDegrees,
            Self::GyroscopeSign,
            Self::NoGravity,
            Self::AccelerometerSign,
            Self::InverseMounting,
            Self::ReverseImages,
            Self::ExchangedCentre,
        ];
        if !recording.has_no_gravity {
            faults.extend([9.806_65, 9.806_65e-3, 1e-3].map(|factor| Self::AccelerometerUnit { factor }));
        }
        if recording.body_from_camera.translation.norm() > 2.0 {
            faults.push(Self::MountingInMillimetres);
        }
        faults.extend(
            [0.25, 1.0 / 3.0, 0.5, 2.0 / 3.0, 1.5, 2.0, 3.0, 4.0].map(|factor| Self::Resolution { factor }),
        );
        faults.extend([0.5, 2.0].map(|factor| Self::Rate { factor }));
        faults.extend((1..8_u8).map(|bits| Self::ImageAxes {
            are_exchanged: bits & 4 != 0,
            is_mirrored: [bits & 1 != 0, bits & 2 != 0],
        }));
        let turns = || Axes::all().filter(|axes| axes.turn().is_some());
        faults.extend(turns().map(|axes| Self::CameraAxes { axes }));
        faults.extend(turns().map(|axes| Self::MountingAxes { axes }));
        let is_scalar =
            |axes: &Axes| axes.axis == [0, 1, 2] && [[false; 3], [true; 3]].contains(&axes.is_negative);
        let others = || Axes::all().filter(|axes| !is_scalar(axes));
        faults.extend(others().map(|axes| Self::GyroscopeAxes { axes }));
        faults.extend(others().map(|axes| Self::AccelerometerAxes { axes }));
        faults
    }

    /// Returns whether the correction leaves the rotation between images, and the rays of their points, as they are.
    pub(super) fn keeps_rotation(&self) -> bool {
        matches!(
            self,
            Self::NoGravity
                | Self::AccelerometerSign
                | Self::AccelerometerUnit { .. }
                | Self::AccelerometerAxes { .. }
                | Self::Gravity { .. }
                | Self::MountingInMillimetres
        )
    }

    /// Corrects the fault.
    pub(super) fn correct(&self, recording: &mut Recording) {
        let camera = &mut recording.camera;
        let mounting = &mut recording.body_from_camera;
        let mut pixels = |change: &dyn Fn(Vector2<f64>) -> Vector2<f64>| {
            let points = recording.images.iter_mut().flat_map(|(_, points)| points);
            points.for_each(|(_, pixel)| *pixel = change(*pixel));
        };
        match self {
            Self::TimeUnit { sensor: Sensor::Imu, factor } => {
                recording.readings.iter_mut().for_each(|reading| reading.timestamp *= factor);
            }
            Self::TimeUnit { sensor: Sensor::Camera, factor } => {
                recording.images.iter_mut().for_each(|(time, _)| *time *= factor);
            }
            Self::Clocks { seconds } | Self::TimeOffset { seconds } => {
                recording.images.iter_mut().for_each(|(time, _)| *time += seconds);
            }
            Self::NormalizedPixels => {
                let camera = *camera;
                pixels(&|point| camera.project(&point.push(1.0)));
            }
            Self::GyroscopeInDegrees => {
                recording.readings.iter_mut().for_each(|reading| reading.gyroscope *= DEGREE);
            }
            Self::GyroscopeSign => {
                recording.readings.iter_mut().for_each(|reading| reading.gyroscope *= -1.0);
            }
            Self::GyroscopeAxes { axes } => {
                let matrix = axes.matrix();
                recording
                    .readings
                    .iter_mut()
                    .for_each(|reading| reading.gyroscope = matrix * reading.gyroscope);
            }
            Self::AccelerometerUnit { factor } => {
                recording.readings.iter_mut().for_each(|reading| reading.accelerometer *= *factor);
            }
            Self::AccelerometerSign => {
                recording.readings.iter_mut().for_each(|reading| reading.accelerometer *= -1.0);
            }
            Self::AccelerometerAxes { axes } => {
                let matrix = axes.matrix();
                recording
                    .readings
                    .iter_mut()
                    .for_each(|reading| reading.accelerometer = matrix * reading.accelerometer);
            }
            Self::NoGravity => recording.has_no_gravity = true,
            Self::Gravity { length } => recording.gravity = *length,
            Self::InverseMounting => *mounting = mounting.inverse(),
            Self::MountingInMillimetres => mounting.translation *= 1e-3,
            Self::CameraAxes { axes } => {
                let turn = axes.turn().unwrap_or_else(So3::identity);
                *mounting = Se3::new(mounting.rotation.compose(&turn), mounting.translation);
            }
            Self::MountingAxes { axes } => {
                let turn = axes.turn().unwrap_or_else(So3::identity);
                *mounting = Se3::new(turn.compose(&mounting.rotation), turn.act(&mounting.translation));
            }
            Self::Mounting { turn } => {
                let turn = So3::exp(&Vector3::from(*turn));
                *mounting = Se3::new(mounting.rotation.compose(&turn), mounting.translation);
            }
            Self::ReverseImages => {
                let ends = recording.images.first().zip(recording.images.last());
                let sum = ends.map_or(0.0, |((first, _), (last, _))| first + last);
                recording.images.reverse();
                recording.images.iter_mut().for_each(|(time, _)| *time = sum - *time);
            }
            Self::Rate { factor } => {
                let begin = recording.readings.first().map_or(0.0, |reading| reading.timestamp);
                let change = |time: f64| begin + factor * (time - begin);
                recording
                    .readings
                    .iter_mut()
                    .for_each(|reading| reading.timestamp = change(reading.timestamp));
            }
            Self::Resolution { factor } => {
                [&mut camera.fx, &mut camera.fy, &mut camera.cx, &mut camera.cy]
                    .into_iter()
                    .for_each(|x| *x *= factor);
            }
            Self::FocalLength { factor } => {
                [&mut camera.fx, &mut camera.fy].into_iter().for_each(|x| *x *= factor);
            }
            Self::ExchangedCentre => std::mem::swap(&mut camera.cx, &mut camera.cy),
            Self::ImageAxes { are_exchanged, is_mirrored } => {
                let size = camera.size();
                pixels(&|pixel| {
                    let pixel = if *are_exchanged { pixel.yx() } else { pixel };
                    Vector2::from_fn(|i, _| if is_mirrored[i] { size[i] - pixel[i] } else { pixel[i] })
                });
            }
            Self::Distortion { k } => recording.distortion = *k,
        }
    }
}

impl fmt::Display for Fault {
    /// Names the fault and its remedy.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimeUnit { sensor, factor } => {
                write!(f, "the timestamps of the {sensor} are not in seconds: multiply them by {factor:e}")
            }
            Self::Clocks { seconds } => write!(
                f,
                "IMU and camera have no time in common: use one clock; with {seconds} s added to the images, both begin \
                 together"
            ),
            Self::NormalizedPixels => f.write_str(
                "the points lie within a few pixels, as if on the plane at depth one: name their columns `u_norm` and `v_norm`",
            ),
            Self::GyroscopeInDegrees => {
                f.write_str("the gyroscope is in degrees per second: multiply its rates by pi / 180")
            }
            Self::GyroscopeSign => f.write_str("the gyroscope turns the other way: change the sign of its rates"),
            Self::GyroscopeAxes { axes } => {
                write!(f, "the gyroscope has other axes than accelerometer and camera: its (x, y, z) should be {axes}")
            }
            Self::AccelerometerUnit { factor } => {
                let unit = match factor {
                    x if *x > 1.0 => "g",
                    x if *x > 2e-3 => "thousandths of g",
                    _ => "mm/s²",
                };
                write!(f, "the accelerometer is in {unit}: multiply its forces by {factor}")
            }
            Self::AccelerometerSign => {
                f.write_str("the accelerometer has the opposite sign: at rest, it has to point up; change its sign")
            }
            Self::AccelerometerAxes { axes } => {
                write!(f, "the accelerometer has other axes than gyroscope and camera: its (x, y, z) should be {axes}")
            }
            Self::NoGravity => {
                f.write_str("gravity was subtracted from the accelerometer: record the specific force with gravity")
            }
            Self::Gravity { length } => {
                write!(f, "the accelerometer shows a gravity of {length:.2} m/s²: set `settings.gravity`")
            }
            Self::InverseMounting => f.write_str(
                "`body_from_camera` is the inverse of what it should be: give the pose of the camera in the frame of the IMU",
            ),
            Self::MountingInMillimetres => {
                f.write_str("the translation of `body_from_camera` is in millimetres: divide it by 1000")
            }
            Self::CameraAxes { axes } => write!(
                f,
                "the camera's axes follow a different convention (x right, y down, z forward is expected): its (x, y, z) should be {axes}"
            ),
            Self::MountingAxes { axes } => write!(
                f,
                "`body_from_camera` belongs to other axes of the IMU: the (x, y, z) of its frame should be {axes}"
            ),
            Self::Mounting { turn } => {
                let angle = Vector3::from(*turn).norm() / DEGREE;
                write!(f, "the camera is turned by {angle:.1}° from `body_from_camera`: calibrate its rotation")
            }
            Self::ReverseImages => f.write_str("the images are in reverse order: check the direction of time in the tracks"),
            Self::Rate { factor } => {
                write!(f, "the time between readings of the IMU is wrong: multiply it by {factor}")
            }
            Self::Resolution { factor } => write!(
                f,
                "the calibration belongs to images of a different size: multiply fx, fy, cx and cy by {factor:.3}"
            ),
            Self::FocalLength { factor } => write!(f, "the focal lengths are wrong: multiply fx and fy by {factor:.3}"),
            Self::ExchangedCentre => f.write_str("cx and cy are exchanged"),
            Self::ImageAxes { are_exchanged, is_mirrored } => {
                let parts = [
                    are_exchanged.then_some("u and v are exchanged"),
                    is_mirrored[0].then_some("u is counted from the right"),
                    is_mirrored[1].then_some("v is counted from below"),
                ];
                let parts: Vec<&str> = parts.into_iter().flatten().collect();
                write!(f, "the pixels have different axes: {}", parts.join(", "))
            }
            Self::TimeOffset { seconds } => {
                let milliseconds = 1e3 * seconds;
                write!(f, "the clocks of IMU and camera differ: add {milliseconds:.1} ms to the timestamps of the images")
            }
            Self::Distortion { k } => write!(
                f,
                "the points are distorted (radial, k = {k:.3}): remove the distortion, with the model that the lens was calibrated with"
            ),
        }
    }
}
