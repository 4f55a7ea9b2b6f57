//! Positions by satellites, as factors on the poses of images.
use crate::georeference::{ENU_FROM_MAP, Geodetic, Georeference};
use crate::pose_graph::{PoseFactor, PoseFactorKey};
use crate::sequence::Frame;
use crate::source::interpolation::pose_at;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::{Coordinates, ExternalPosition, PointPairs, Se3};
use manifactor_graph::checked::Positive;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Direction, Noise};
use manifactor_ros::messages::NavSatFix;
use nalgebra::{DMatrix, Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Largest standard deviation of the rotation between odometry and fixes, in radians.
const MAX_ROTATION_SIGMA: f64 = 0.3;
/// Largest ratio of the extents of odometry and fixes.
const MAX_EXTENT_RATIO: f64 = 2.0;

/// Positions of a satellite receiver in a recording (`sensor_msgs/NavSatFix`).
///
/// Each position is a factor [`external_position_se3`](#external_position_se3) on the pose of the nearest image. The variable
/// `enu_from_map` is the pose of the map in a frame with the axes east, north and up, whose origin is the first position.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct McapFixes {
    /// Topic. Default: the only one of its type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// Position of the antenna in the frame of the body, in metres. Default: from the transforms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub antenna: Option<Coordinates<3>>,
    /// Standard deviation of each coordinate, in metres. Default: the covariances of the messages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<Positive>,
    /// Robust loss, for reflected signals. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
}

/// A position by satellites.
pub(super) struct Fix {
    timestamp: f64,
    latitude_longitude: [f64; 2],
    altitude: Option<f64>,
    covariance: Option<Matrix3<f64>>,
}

impl Fix {
    /// Reads a message.
    ///
    /// # Errors
    /// If the receiver has no position.
    pub(super) fn of(message: &NavSatFix) -> Result<Self, &'static str> {
        Ok(Self {
            timestamp: message.header.stamp.seconds(),
            latitude_longitude: message.latitude_longitude()?,
            altitude: message.altitude,
            covariance: message.covariance(),
        })
    }

    /// Returns the position; without an altitude, at that of `level`.
    fn geodetic(&self, level: f64) -> Geodetic {
        let [latitude, longitude] = self.latitude_longitude;
        Geodetic { latitude, longitude, altitude: self.altitude.unwrap_or(level) }
    }

    /// Returns the noise of the coordinates to the east, to the north and upwards, and the larger standard deviation of
    /// the horizontal ones.
    fn noise(&self, sigma: Option<Positive>) -> Result<(Noise, f64), String> {
        let (noise, horizontal) = match (sigma, self.covariance) {
            (Some(sigma), _) => (Noise::sigma(sigma.get()), sigma.get()),
            (None, Some(mut covariance)) => {
                if self.altitude.is_none() {
                    // any value: this row is not observed
                    covariance.fill_column(2, 0.0);
                    covariance.fill_row(2, 0.0);
                    covariance[(2, 2)] = 1.0;
                }
                let horizontal = covariance[(0, 0)].max(covariance[(1, 1)]).sqrt();
                (Noise::covariance(DMatrix::from_column_slice(3, 3, covariance.as_slice())), horizontal)
            }
            (None, None) => {
                return Err("the receiver does not know its covariance: set `source.fixes.sigma`".into());
            }
        };
        let noise = noise.map_err(|error| format!("its covariance cannot be used: {error}"))?;
        let noise = if self.altitude.is_none() { noise.observing(&[true, true, false]) } else { noise };
        Ok((noise, horizontal))
    }
}

/// A position that can be used.
struct UsedFix {
    /// Index of the nearest image, and its time.
    frame: (usize, f64),
    /// Position of the antenna, in the frame of the camera at that image.
    lever_arm: Vector3<f64>,
    /// Position of the antenna in the odometry frame.
    by_odometry: Vector3<f64>,
    east_north_up: Vector3<f64>,
    noise: Noise,
    /// Standard deviation of a horizontal coordinate. Unit: metres.
    sigma: f64,
}

/// The odometry with which positions are compared.
pub(super) struct FixedOdometry<'a> {
    /// Poses of the camera in the odometry frame, sorted by time.
    pub poses: &'a [StampedPose],
    pub frames: &'a [Frame],
    /// Largest time between two poses, and between a position and an image. Unit: seconds.
    pub max_gap: f64,
    /// Up direction in the odometry frame, if known.
    pub up: Option<Direction>,
}

/// Place of the odometry on the Earth, with the factors of the positions and the index of the image of each.
pub(super) type Georeferenced = (Georeference, Vec<(usize, PoseFactor)>);

/// Relates positions to the odometry. `antenna` is the position of the antenna in the frame of the camera. Positions that are left
/// out are reported in `unused`.
///
/// # Errors
/// If no positions can be used, the reason.
pub(super) fn georeference(
    fixes: &[Fix],
    settings: &McapFixes,
    antenna: &Vector3<f64>,
    odometry: &FixedOdometry<'_>,
    unused: &mut Vec<String>,
) -> Result<Georeferenced, String> {
    let first = fixes.first().ok_or("no message has a position")?;
    let origin = first.geodetic(first.altitude.unwrap_or(0.0));
    let (mut used, mut away, mut faulty) = (vec![], 0, (0, String::new()));
    for fix in fixes {
        match fix.noise(settings.sigma) {
            Ok(noise) => match odometry.used(fix, noise, antenna, &origin) {
                Some(fix) => used.push(fix),
                None => away += 1,
            },
            Err(fault) if faulty.0 == 0 => faulty = (1, fault),
            Err(_) => faulty.0 += 1,
        }
    }
    let of = fixes.len();
    if faulty.0 > 0 {
        unused.push(format!(
            "{} of {of} positions by satellites are left out, the first: {}",
            faulty.0, faulty.1
        ));
    }
    if away > 0 {
        let gap = odometry.max_gap;
        unused.push(format!(
            "{away} of {of} positions by satellites are left out: they are not between two poses, and near an image, at most {gap} s apart"
        ));
    }
    let enu_from_odometry = odometry.align(&used)?;
    used.sort_by_key(|fix| fix.frame.0);
    let factor = |fix: UsedFix| {
        let coordinates = |x| Coordinates::new(x).map_err(|error| error.to_string());
        let factor = ExternalPosition {
            position: coordinates(fix.east_north_up)?,
            lever_arm: coordinates(fix.lever_arm)?,
        };
        let keys = vec![PoseFactorKey::Key(ENU_FROM_MAP.into()), PoseFactorKey::Timestamp(fix.frame.1)];
        let (noise, loss) = (fix.noise, settings.loss.clone());
        Ok((fix.frame.0, PoseFactor { id: None, keys, factor: Arc::new(factor), noise, loss }))
    };
    let factors = used.into_iter().map(factor).collect::<Result<_, String>>()?;
    Ok((Georeference { origin, enu_from_odometry, is_level: odometry.up.is_some() }, factors))
}

impl FixedOdometry<'_> {
    /// Returns a position with its image; `None` if there is no pose or image near its time.
    fn used(
        &self,
        fix: &Fix,
        (noise, sigma): (Noise, f64),
        antenna: &Vector3<f64>,
        origin: &Geodetic,
    ) -> Option<UsedFix> {
        let pose = pose_at(self.poses, fix.timestamp, self.max_gap).ok()?;
        let after = self.frames.partition_point(|frame| frame.timestamp < fix.timestamp);
        let away = |i: &usize| (self.frames[*i].timestamp - fix.timestamp).abs();
        let around = after.saturating_sub(1)..self.frames.len().min(after + 1);
        let nearest = around.min_by(|a, b| away(a).total_cmp(&away(b)));
        let index = nearest.filter(|i| away(i) <= self.max_gap)?;
        let frame = &self.frames[index];
        Some(UsedFix {
            frame: (index, frame.timestamp),
            lever_arm: frame.world_from_camera.inverse().act(&pose.act(antenna)),
            by_odometry: pose.act(antenna),
            east_north_up: origin.east_north_up(&fix.geodetic(origin.altitude)),
            noise,
            sigma,
        })
    }

    /// Returns the pose of the odometry frame with axes east, north and up. Positions that are far off, as after a reflection,
    /// are left out of this alignment.
    fn align(&self, used: &[UsedFix]) -> Result<Se3, String> {
        /// Number of alignments, each without the positions that were far off in the one before.
        const ALIGNMENTS: usize = 5;
        /// A position is far off if its distance is larger than this multiple of the median.
        const FAR: f64 = 4.0;
        let mut near: Vec<&UsedFix> = used.iter().collect();
        for _ in 1..ALIGNMENTS {
            let Some(pose) = PositionPairs::new(&near, self.up).and_then(|pairs| pairs.align(self.up)) else {
                break;
            };
            let distance = |fix: &UsedFix| (pose.act(&fix.by_odometry) - fix.east_north_up).norm();
            let mut distances: Vec<f64> = used.iter().map(distance).collect();
            distances.sort_by(f64::total_cmp);
            let most = (FAR * distances[distances.len() / 2]).max(f64::MIN_POSITIVE);
            near = used.iter().filter(|fix| distance(fix) <= most).collect();
        }
        let pairs = PositionPairs::new(&near, self.up).ok_or("none of them can be used")?;
        pairs.check(self.up)?;
        pairs.align(self.up).ok_or_else(|| "they do not determine a rotation".into())
    }
}

/// Positions by odometry and by satellites, without their means. If up is known, only their horizontal parts.
struct PositionPairs {
    means: [Vector3<f64>; 2],
    pairs: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// Root mean square of the standard deviations. Unit: metres.
    sigma: f64,
}

impl PositionPairs {
    /// Returns `None` without a position.
    fn new(fixes: &[&UsedFix], up: Option<Direction>) -> Option<Self> {
        if fixes.is_empty() {
            return None;
        }
        let count = fixes.len() as f64;
        let mean =
            |x: fn(&UsedFix) -> Vector3<f64>| fixes.iter().map(|fix| x(fix)).sum::<Vector3<f64>>() / count;
        let means = [mean(|fix| fix.by_odometry), mean(|fix| fix.east_north_up)];
        let horizontal = |x: Vector3<f64>, up: Option<Direction>| match up {
            Some(up) => x - *up * up.dot(&x),
            None => x,
        };
        let pair = |fix: &&UsedFix| {
            let x = horizontal(fix.by_odometry - means[0], up);
            (x, horizontal(fix.east_north_up - means[1], up.map(|_| Direction::Z)))
        };
        let sigma = (fixes.iter().map(|fix| fix.sigma * fix.sigma).sum::<f64>() / count).sqrt();
        Some(Self { means, pairs: fixes.iter().map(pair).collect(), sigma })
    }

    /// Returns the rigid motion from the odometry to east, north and up; `None` if it is not determined.
    fn align(&self, up: Option<Direction>) -> Option<Se3> {
        let mut all = PointPairs::new(self.pairs.iter().map(|(x, y)| (*x, *y, 1.0)));
        if let Some(up) = up {
            all.add_direction(&up, &Vector3::z(), 1.0);
        }
        let rotation = all.rigid(0.0)?.rotation;
        Some(Se3::new(rotation, self.means[1] - rotation.act(&self.means[0])))
    }

    /// Returns the extents along the principal axes, the largest first, as sums over all positions. Unit: metres.
    fn extents(&self, of: impl Fn(&(Vector3<f64>, Vector3<f64>)) -> Vector3<f64>) -> [f64; 3] {
        let scatter: Matrix3<f64> = self.pairs.iter().map(|pair| of(pair) * of(pair).transpose()).sum();
        let mut extents: [f64; 3] = scatter.symmetric_eigen().eigenvalues.map(|x| x.max(0.0).sqrt()).into();
        extents.sort_by(|a, b| b.total_cmp(a));
        extents
    }

    /// Checks that the positions determine the rotation, and have the extent of the odometry.
    fn check(&self, up: Option<Direction>) -> Result<(), String> {
        let sigma = self.sigma;
        let [by_odometry, by_fixes] = [self.extents(|pair| pair.0), self.extents(|pair| pair.1)];
        let root = (self.pairs.len() as f64).sqrt();
        let [moved, measured] = [by_odometry[0], by_fixes[0]].map(|extent| extent / root);
        if sigma > MAX_ROTATION_SIGMA * by_odometry[0] {
            return Err(format!(
                "their noise of {sigma:.1} m does not show the direction of a path with an extent of {moved:.2} m"
            ));
        }
        if up.is_none() && sigma > MAX_ROTATION_SIGMA * by_odometry[1] {
            return Err("they are on a line, and leave the rotation about it open: set `source.up`".into());
        }
        if measured - 3.0 * sigma > MAX_EXTENT_RATIO * moved
            || moved > MAX_EXTENT_RATIO * (measured + 3.0 * sigma)
        {
            return Err(format!(
                "they have an extent of {measured:.2} m, and the odometry of {moved:.2} m: is its unit metres?"
            ));
        }
        Ok(())
    }
}
