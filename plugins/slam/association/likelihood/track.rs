//! The associator's model of one object.
use super::super::MapEstimate;
use super::LikelihoodAssociation;
use super::fit::{BoxNoise, FittedEllipsoid, ObjectPrior, PredictedBox, SIDES, fit, predict};
use super::posed_detections::{PosedDetection, PosedDetections};
use indexmap::IndexMap;
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, Camera};
use manifactor_recording::class::ClassAliases;
use manifactor_recording::measurement::{Quantities, ROWS};
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{ClassScores, Detection, ObjectId};
use nalgebra::allocator::Allocator;
use nalgebra::{
    Cholesky, DMatrix, DVector, DefaultAllocator, Dim, Matrix3, Matrix6, OMatrix, OVector, SMatrix, Vector6,
};
use std::f64::consts::TAU;

/// The model of an object: ellipsoid, classes and boxes.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub id: ObjectId,
    /// Summed score of the best class of each box.
    pub votes: IndexMap<String, f64>,
    pub belief: ObjectPrior,
    pub fitted: FittedEllipsoid,
    pub detections: PosedDetections,
    /// All its boxes, at most one per image, in order.
    pub boxes: Vec<TrackBox>,
    /// Time of the last detection, in seconds.
    pub last_seen_s: Option<f64>,
    /// Number of boxes at which it is compared with its neighbours again.
    pub next_merge_check: usize,
}

/// A box of an object.
#[derive(Debug, Clone)]
pub(super) struct TrackBox {
    /// Unit: seconds.
    pub timestamp: f64,
    /// Index among the detections of its frame.
    pub index: usize,
    /// Its frame is the index in the map.
    pub detection: Detection,
}

/// Predicted box of an object, with the covariance of its sides.
pub(super) struct ExpectedBox<'a> {
    pose: &'a Se3,
    fitted: &'a FittedEllipsoid,
    settings: &'a LikelihoodAssociation,
    /// Variances of the drift of the camera: rad², m².
    drift: Vector6<f64>,
    predicted: PredictedBox,
    /// Covariance of the sides, in square pixels.
    covariance: SMatrix<f64, SIDES, SIDES>,
}

/// Uncertainty of the offset between two objects, relative to their sizes, above which their places count as
/// unknown.
const MAX_OFFSET_SIGMA_OF_SIZE: f64 = 0.5;
/// Boxes of an object at its first comparison with neighbours.
const FIRST_MERGE_CHECK_BOXES: usize = 3;
/// Growth of the number of boxes until the next check.
const CHECK_GROWTH: f64 = 1.3;

impl Track {
    /// Creates the track of a new object; `None` if the fit of the ellipsoid fails.
    pub(super) fn new(
        id: ObjectId,
        belief: ObjectPrior,
        first: &PosedDetection,
        noise: &BoxNoise,
    ) -> Option<Self> {
        let fitted = fit(&belief, belief.initial_quadric(), std::slice::from_ref(first), noise)?;
        Some(Self::without_boxes(id, belief, fitted))
    }

    /// Creates a track without boxes.
    pub(super) fn without_boxes(id: ObjectId, belief: ObjectPrior, fitted: FittedEllipsoid) -> Self {
        Self {
            id,
            votes: IndexMap::new(),
            belief,
            fitted,
            detections: PosedDetections::default(),
            boxes: vec![],
            last_seen_s: None,
            next_merge_check: FIRST_MERGE_CHECK_BOXES,
        }
    }

    /// Creates the track of an object of a prior map.
    pub(super) fn of_prior_object(object: &PriorObject) -> Self {
        let fitted = FittedEllipsoid { quadric: object.quadric, covariance: object.covariance() };
        let votes = object.classes.sums().clone();
        Self { votes, ..Self::without_boxes(object.id, ObjectPrior::from_estimate(&fitted), fitted) }
    }

    /// Returns whether the object is part of a prior map.
    pub(super) fn is_known(&self) -> bool {
        matches!(self.belief, ObjectPrior::Known { .. })
    }

    /// Returns whether one of two objects contains the centre of the other, and both places are known well
    /// enough.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.fitted.overlaps(&other.fitted)
            && self.offset_sigma(other) < MAX_OFFSET_SIGMA_OF_SIZE * self.size_sum(other)
    }

    /// Returns the standard deviation of the offset between two centres, in metres.
    pub(super) fn offset_sigma(&self, other: &Self) -> f64 {
        (self.centre_covariance() + other.centre_covariance()).trace().sqrt()
    }

    /// Returns the sum of the sizes of two objects, in metres.
    pub(super) fn size_sum(&self, other: &Self) -> f64 {
        self.fitted.quadric.semi_axes.norm() + other.fitted.quadric.semi_axes.norm()
    }

    /// Returns the distance from a camera, in metres.
    pub(super) fn distance(&self, from: &Se3) -> f64 {
        (self.fitted.quadric.centroid() - from.translation).norm()
    }

    /// Returns the standard deviation of the centre, relative to the distance from the last camera.
    pub(super) fn relative_centre_sigma(&self) -> f64 {
        let last = self.detections.all().last();
        let distance = last.map_or(0.0, |last| self.distance(&last.world_from_camera));
        self.centre_covariance().trace().sqrt() / distance
    }

    /// Returns the covariance of the centre, in square metres.
    pub(super) fn centre_covariance(&self) -> Matrix3<f64> {
        self.fitted.covariance.fixed_view::<3, 3>(3, 3).into_owned()
    }

    /// Adds the class of a box, with weight `times`: 1 adds it, -1 takes it back.
    pub(super) fn add_class_vote(&mut self, scores: &ClassScores, aliases: &ClassAliases, times: f64) {
        if let Some((class, score)) = scores.best() {
            let votes = self.votes.entry(aliases.canonical(class)).or_default();
            *votes = (*votes + times * score).max(0.0);
        }
    }

    /// Returns the share of a class among all votes; 1 without votes.
    pub(super) fn class_share(&self, class: &str) -> f64 {
        let all: f64 = self.votes.values().sum();
        if all > 0.0 { self.votes.get(class).copied().unwrap_or_default() / all } else { 1.0 }
    }

    /// Predicts the box seen from `pose`, `seconds` after the last detection; `None` if the object is not
    /// visible.
    pub(super) fn expected_box<'a>(
        &'a self,
        seconds: f64,
        pose: &'a Se3,
        camera: &Camera,
        settings: &'a LikelihoodAssociation,
    ) -> Option<ExpectedBox<'a>> {
        let predicted = predict(pose, &self.fitted.quadric, camera)?;
        let [turn, shift] = [settings.drift_rad, settings.drift_m].map(|drift| *drift * *drift * seconds);
        let drift = Vector6::new(turn, turn, turn, shift, shift, shift);
        let by_drift = predicted.by_pose * Matrix6::from_diagonal(&drift) * predicted.by_pose.transpose();
        let by_quadric = predicted.by_quadric * self.fitted.covariance * predicted.by_quadric.transpose();
        let noise = settings.noise();
        let sigma = noise.deviations(&predicted.bounding_box) * *settings.lasting;
        let by_detector = SMatrix::from_diagonal(&sigma.component_mul(&sigma));
        let (fitted, covariance) = (&self.fitted, by_quadric + by_drift + by_detector);
        Some(ExpectedBox { pose, fitted, settings, drift, predicted, covariance })
    }

    /// Returns the intersection over union of a box with the projection of the ellipsoid.
    pub(super) fn overlap(&self, detection: &PosedDetection) -> f64 {
        let camera = &detection.camera.model;
        let predicted = predict(&detection.world_from_camera, &self.fitted.quadric, camera);
        predicted.map_or(0.0, |predicted| predicted.bounding_box.iou(&detection.bounding_box))
    }

    /// Adds a box. If the fit fails, the ellipsoid stays unchanged.
    pub(super) fn add_box(&mut self, seen: TrackBox, pose: Se3, map: &dyn MapEstimate, noise: &BoxNoise) {
        self.last_seen_s = Some(seen.timestamp);
        self.detections.update_poses(map);
        self.detections.add(seen.from(&pose), &self.fitted.quadric.centroid());
        self.boxes.push(seen);
        self.refit(noise);
    }

    /// Fits the ellipsoid to the detections, from the current one.
    pub(super) fn refit(&mut self, noise: &BoxNoise) {
        let fitted = fit(&self.belief, self.fitted.quadric, self.detections.all(), noise);
        self.fitted = fitted.unwrap_or(self.fitted);
    }

    /// Returns the id if a comparison with the neighbours is due, and schedules the next one.
    pub(super) fn due_merge_check(&mut self, frame: usize) -> Option<ObjectId> {
        let is_due = self.is_seen_in(frame) && self.boxes.len() >= self.next_merge_check;
        is_due.then(|| {
            self.next_merge_check = self.next();
            self.id
        })
    }

    fn is_seen_in(&self, frame: usize) -> bool {
        self.boxes.last().is_some_and(|last| last.frame() == frame)
    }

    fn next(&self) -> usize {
        (self.boxes.len() as f64 * CHECK_GROWTH).ceil() as usize + 1
    }
}

impl TrackBox {
    pub(super) fn frame(&self) -> usize {
        self.detection.frame
    }

    /// Returns the frame and the index of the camera.
    pub(super) fn image(&self) -> (usize, usize) {
        (self.detection.frame, self.detection.camera.index)
    }

    /// Returns the detection with the pose of its camera, from the pose of its frame.
    pub(super) fn from(&self, world_from_first: &Se3) -> PosedDetection {
        let Detection { frame, ref camera, bounding_box, ref quantities, .. } = self.detection;
        let (world_from_camera, camera) = (camera.pose(world_from_first), camera.clone());
        PosedDetection { frame, camera, world_from_camera, bounding_box, quantities: quantities.clone() }
    }
}

impl ExpectedBox<'_> {
    /// Returns the predicted box without further measurements.
    pub(super) fn bounding_box(&self) -> &BoundingBox {
        &self.predicted.bounding_box
    }

    /// Returns -2 ln of the density of a detection: d² + ln det 2πS over its box and its other measurements.
    pub(super) fn cost(&self, b: &BoundingBox, quantities: &Quantities) -> f64 {
        let error = self.predicted.error(b);
        if quantities.is_empty() {
            return cost(&error, self.covariance);
        }
        // jointly, since box sides and further measurements depend on the same object and pose
        let mut innovations = vec![];
        for measurement in quantities.iter() {
            let Some(innovation) = measurement.innovation(self.pose, &self.fitted.quadric) else {
                return f64::INFINITY;
            };
            innovations.push((measurement, innovation));
        }
        let n = SIDES + innovations.iter().map(|(_, innovation)| innovation.rows.min(ROWS)).sum::<usize>();
        let (mut all, mut by_detector) = (DVector::zeros(n), DMatrix::zeros(n, n));
        let (mut by_pose, mut by_object) = (DMatrix::zeros(n, 6), DMatrix::zeros(n, 9));
        all.rows_mut(0, SIDES).copy_from(&error);
        by_pose.rows_mut(0, SIDES).copy_from(&self.predicted.by_pose);
        by_object.rows_mut(0, SIDES).copy_from(&self.predicted.by_quadric);
        let noise = self.settings.noise();
        let sides = noise.deviations(&self.predicted.bounding_box) * *self.settings.lasting;
        (0..SIDES).for_each(|i| by_detector[(i, i)] = sides[i] * sides[i]);
        let mut first = SIDES;
        for (measurement, innovation) in innovations {
            let sigma = measurement.deviations(&noise.others, &innovation.residual) * *self.settings.lasting;
            for i in 0..innovation.rows.min(ROWS) {
                all[first] = innovation.residual[i];
                by_pose.row_mut(first).copy_from(&innovation.by_pose.row(i));
                by_object.row_mut(first).copy_from(&innovation.by_object.row(i));
                by_detector[(first, first)] = sigma[i] * sigma[i];
                first += 1;
            }
        }
        let of_object = &by_object * self.fitted.covariance * by_object.transpose();
        let of_drift = &by_pose * Matrix6::from_diagonal(&self.drift) * by_pose.transpose();
        cost(&all, of_object + of_drift + by_detector)
    }
}

/// Returns d² + ln det 2πS.
fn cost<N: Dim>(error: &OVector<f64, N>, covariance: OMatrix<f64, N, N>) -> f64
where
    DefaultAllocator: Allocator<N> + Allocator<N, N>,
{
    let rows = error.len() as f64;
    let Some(factor) = Cholesky::new(covariance) else { return f64::INFINITY };
    error.dot(&factor.solve(error)) + factor.ln_determinant() + rows * TAU.ln()
}
