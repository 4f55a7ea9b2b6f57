//! Noise of simulated measurements.
use manifactor_geometry::Se3;
use manifactor_graph::Manifold;
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_quadric::{BoundingBox, Camera};
use manifactor_recording::ellipse::ImageEllipse;
use manifactor_recording::measurement::{DepthMeasurement, Quantities};
use manifactor_recording::sequence::ClassScores;
use nalgebra::{Matrix2, Vector2, Vector3, Vector6};
use rand::RngExt;
use rand_distr::{Distribution, Poisson, StandardNormal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Noise of the odometry: zero-mean and Gaussian, proportional to each motion, applied through retract.
///
/// The paper gives 5 % of translation and 15 % of rotation, but not the reference of these shares: see
/// `spread`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotionNoise {
    /// Standard deviation as a share of the translation.
    pub translation: NotNegative,
    /// Standard deviation as a share of the rotation.
    pub rotation: NotNegative,
    /// Length that the shares refer to: the length of the motion, for the whole error or for each axis, or
    /// the component of the motion along each axis.
    pub spread: NoiseSpread,
}

impl Default for MotionNoise {
    fn default() -> Self {
        Self {
            translation: NotNegative::literal(0.05),
            rotation: NotNegative::literal(0.15),
            spread: NoiseSpread::default(),
        }
    }
}

/// Reference of the shares of a motion's noise.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Spread")]
pub enum NoiseSpread {
    /// The length of the motion gives the whole error: each axis has the share / √3.
    #[default]
    Total,
    /// The length of the motion gives the error along each axis.
    PerAxis,
    /// The component of the motion along an axis gives the error along this axis.
    Component,
}

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

impl MotionNoise {
    /// Returns a relative pose with noise.
    pub(super) fn add_noise(&self, motion: &Se3, rng: &mut Pcg64) -> Se3 {
        let turn = self.sigmas(&motion.rotation.log(), *self.rotation);
        let shift = self.sigmas(&motion.translation, *self.translation);
        let sigmas = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
        motion.retract(&Vector6::from_iterator(sigmas.into_iter().map(|s| s * normal(rng))))
    }
    fn sigmas(&self, motion: &Vector3<f64>, share: f64) -> Vector3<f64> {
        match self.spread {
            NoiseSpread::Total => Vector3::repeat(share * motion.norm() / 3.0_f64.sqrt()),
            NoiseSpread::PerAxis => Vector3::repeat(share * motion.norm()),
            NoiseSpread::Component => motion.abs() * share,
        }
    }
}

/// Errors of an accelerometer: white noise, and a constant offset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AccelerometerNoise {
    /// Standard deviation of the white noise of each axis. Unit: m/s².
    pub sigma: NotNegative,
    /// Standard deviation of the offset of each axis. Unit: m/s².
    pub bias: NotNegative,
}

impl Default for AccelerometerNoise {
    fn default() -> Self {
        Self { sigma: NotNegative::literal(0.1), bias: NotNegative::literal(0.05) }
    }
}

/// Reading of an accelerometer at rest. Unit: m/s².
const GRAVITY: f64 = 9.81;

impl AccelerometerNoise {
    /// Returns the reading at each pose, in the camera frame: up plus the acceleration of the camera, from
    /// finite differences over `interval` seconds.
    pub(super) fn read(&self, poses: &[Se3], interval: f64, rng: &mut Pcg64) -> Vec<Vector3<f64>> {
        let bias = Vector3::from_fn(|_, _| *self.bias * normal(rng));
        let at = |i: usize| poses[i.min(poses.len() - 1)].translation;
        let reading = |i: usize| {
            // the first and last pose use the acceleration of their neighbour; two poses determine none
            let middle = i.clamp(1, poses.len().saturating_sub(2).max(1));
            let moved = at(middle + 1) - at(middle) * 2.0 + at(middle - 1);
            let moved = if poses.len() < 3 { Vector3::zeros() } else { moved };
            let felt = Vector3::z() * GRAVITY + moved / interval.powi(2);
            let noise = Vector3::from_fn(|_, _| *self.sigma * normal(rng));
            poses[i].rotation.inverse().act(&felt) + bias + noise
        };
        (0..poses.len()).map(reading).collect()
    }
}

/// A detector and its errors. Shares and rates are from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Detector")]
pub struct DetectorSettings {
    /// Standard deviation of each side of a box. The paper gives a variance of 4 px², and its authors' code
    /// draws with 2 px, which is equal. Unit: pixels.
    pub sigma_px: NotNegative,
    /// Additional standard deviation, as a share of width and height. The variances add up.
    pub sigma_of_size: NotNegative,
    /// Correlation time of the noise of an object's boxes: after this time 1/e of the noise remains. 0 for
    /// independent noise in each frame. Unit: seconds.
    pub noise_lasts_s: NotNegative,
    /// Mean number of false boxes per image.
    pub false_boxes: NotNegative,
    /// Boxes with a shorter side are not detected. Unit: pixels.
    pub min_size_px: NotNegative,
    /// Objects are detected only if at least this share of them is inside the image.
    pub min_visible: Share,
    /// Rate of missed detections.
    pub missed: Share,
    /// Rate of partial occlusions: the box loses part of one side.
    pub occluded: Share,
    /// Largest share of its width or height that such a box loses.
    pub occlusion: Share,
    /// Lets nearer objects hide the objects behind them. A box then encloses the visible part, to four pixels
    /// or a thousandth of the image, and `min_visible` refers to this part.
    pub occluded_by_objects: bool,
    /// Rate of boxes that are assigned to a wrong object of the scene, as by a tracker's mistake.
    pub wrong_object: Share,
    /// Share of the objects that are detected under a wrong class in most of their images.
    pub misclassified: Share,
    /// Rate of boxes with a class other than the object's usual one.
    pub confused: Share,
    /// Standard deviation of the measured depth of an object's centre, as a fraction of the depth. Default:
    /// no depths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_error: Option<Positive>,
    /// Standard deviation of the centre and the semi-axes of ellipses with the moments of the convex hull of an object's
    /// outline. Default: no ellipses. Unit: pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ellipse_error: Option<Positive>,
}

impl Default for DetectorSettings {
    fn default() -> Self {
        Self {
            sigma_px: NotNegative::literal(2.0),
            sigma_of_size: NotNegative::literal(0.0),
            noise_lasts_s: NotNegative::literal(0.0),
            false_boxes: NotNegative::literal(0.0),
            min_size_px: NotNegative::literal(8.0),
            min_visible: Share::literal(0.3),
            missed: Share::literal(0.0),
            occluded: Share::literal(0.0),
            occlusion: Share::literal(0.4),
            occluded_by_objects: false,
            wrong_object: Share::literal(0.0),
            misclassified: Share::literal(0.0),
            confused: Share::literal(0.0),
            depth_error: None,
            ellipse_error: None,
        }
    }
}

impl DetectorSettings {
    /// Returns the detected box; `None` if the object is not detected. `visible` is the visible share of the
    /// object. `noise` is the noise of its previous box in standard deviations, and is updated to this box;
    /// `seconds` have passed in between.
    pub(super) fn draw_box(
        &self,
        bounding_box: &BoundingBox,
        visible: f64,
        camera: &Camera,
        (noise, seconds): (&mut [f64; 4], f64),
        rng: &mut Pcg64,
    ) -> Option<BoundingBox> {
        // equal draws for each box, detected or not, so that one setting changes only its own effect
        let (missed, hidden) = (rng.random_bool(*self.missed), rng.random_bool(*self.occluded));
        let (side, share) = (rng.random_range(0..4), rng.random::<f64>() * *self.occlusion);
        let left = if self.noise_lasts_s > NotNegative::literal(0.0) {
            (-seconds / *self.noise_lasts_s).exp()
        } else {
            0.0
        };
        noise.iter_mut().for_each(|n| *n = left * *n + (1.0 - left * left).sqrt() * normal(rng));
        let (width, height) = (bounding_box.width(), bounding_box.height());
        let sigma = [width, height].map(|size| self.sigma_px.hypot(*self.sigma_of_size * size));
        let mut b = bounding_box.bounds();
        if hidden {
            let extent = b[side % 2 + 2] - b[side % 2];
            b[side] += if side < 2 { share * extent } else { -share * extent };
        }
        (0..4).for_each(|i| b[i] += sigma[i % 2] * noise[i]);
        let size = camera.size();
        for axis in 0..2 {
            let (low, high) = (b[axis].min(b[axis + 2]), b[axis].max(b[axis + 2]));
            (b[axis], b[axis + 2]) = (low.clamp(0.0, size[axis]), high.clamp(0.0, size[axis]));
        }
        let large = b[2] - b[0] >= *self.min_size_px && b[3] - b[1] >= *self.min_size_px;
        (!missed && large && visible >= *self.min_visible).then(|| BoundingBox::new(b).ok()).flatten()
    }

    /// Returns the detected class of an object whose usual class is `usual`.
    pub(super) fn draw_class(&self, usual: &str, classes: &[&str], rng: &mut Pcg64) -> ClassScores {
        let (confused, score) = (rng.random_bool(*self.confused), rng.random_range(0.5..1.0));
        let other = draw_different_class(usual, classes, rng);
        ClassScores::single(if confused { other } else { usual }, score)
    }
}

impl DetectorSettings {
    /// Returns the measurements besides the box, of an object at this depth in metres: its depth, if it is in
    /// front of the camera.
    pub(super) fn draw_measurements(&self, depth: f64, rng: &mut Pcg64) -> Quantities {
        let Some(relative) = self.depth_error else { return Quantities::NONE };
        let error = relative.get() * normal(rng);
        let measured = Positive::new(depth * (1.0 + error));
        measured.map_or(Quantities::NONE, |measured| Quantities::one(DepthMeasurement(measured)))
    }

    /// Returns the measured ellipse of an outline.
    pub(super) fn draw_ellipse(
        &self,
        outline: Option<ImageEllipse>,
        rng: &mut Pcg64,
    ) -> Option<ImageEllipse> {
        let sigma = self.ellipse_error?.get();
        let [x, y, a, b, c] = [(); 5].map(|()| sigma * normal(rng));
        let outline = outline?;
        // noise of the square root of the shape is noise of the semi-axes
        let off = c / std::f64::consts::SQRT_2;
        let root = outline.root() + Matrix2::new(a, off, off, b);
        ImageEllipse::from_shape(Vector2::from(outline.centre) + Vector2::new(x, y), root * root.transpose())
    }

    /// Returns the false boxes of an image.
    pub(super) fn draw_false_boxes(
        &self,
        camera: &Camera,
        classes: &[&str],
        rng: &mut Pcg64,
    ) -> Vec<(BoundingBox, ClassScores)> {
        let count = Poisson::new(*self.false_boxes).map_or(0, |poisson| poisson.sample(rng) as usize);
        let size = camera.size();
        let mut one = || {
            let mut ends = |length: f64| {
                let (a, b) = (rng.random::<f64>() * length, rng.random::<f64>() * length);
                (a.min(b), a.max(b))
            };
            let ((xmin, xmax), (ymin, ymax)) = (ends(size.x), ends(size.y));
            let class = classes.get(rng.random_range(0..classes.len().max(1)))?;
            let scores = ClassScores::single(*class, rng.random_range(0.3..0.6));
            Some((BoundingBox::new([xmin, ymin, xmax, ymax]).ok()?, scores))
        };
        (0..count).filter_map(|_| one()).collect()
    }
}

/// Returns the object that a box is assigned to, out of `objects`: a wrong one at this rate.
pub(super) fn draw_assigned_object(rate: f64, own: usize, objects: usize, rng: &mut Pcg64) -> usize {
    let (wrong, step) = (rng.random_bool(rate), rng.random_range(1..objects.max(2)));
    if wrong { (own + step) % objects.max(1) } else { own }
}

/// Returns a different class, if there is one.
pub(super) fn draw_different_class<'a>(class: &'a str, classes: &[&'a str], rng: &mut Pcg64) -> &'a str {
    let others: Vec<&str> = classes.iter().copied().filter(|c| *c != class).collect();
    let i = rng.random_range(0..others.len().max(1));
    others.get(i).copied().unwrap_or(class)
}
