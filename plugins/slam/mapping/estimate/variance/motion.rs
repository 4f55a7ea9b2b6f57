//! Noise of odometry, and the search for it.
use super::components::VarianceError;
use super::cross_validation::{CrossValidation, CrossValidationScore};
use crate::estimate::{Estimate, LandmarkEstimate};
use crate::mapping::pose_key;
use manifactor_geometry::Se3;
use manifactor_graph::Noise;
use manifactor_graph::noise::NoiseError;
use manifactor_solve::Observer;
use nalgebra::{DMatrix, Matrix3, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;

/// The noise of a motion: a rotation about a point in front of the camera, and a translation of that point.
///
/// Visual odometry errs by rotating about the observed scene: a rotation that is too large comes with the
/// translation that keeps the scene in view. If the pivot is the camera itself, rotation and translation are
/// independent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MotionComponent {
    /// σ of the rotation about each axis, in rad.
    pub rotation: f64,
    /// σ of the translation of the pivot along each axis, in m.
    pub translation: f64,
    /// Distance of the pivot in front of the camera, in m.
    pub pivot: f64,
}

/// The odometry noise with the best cross-validation score.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MotionChoice {
    /// Noise in the graph: almost zero if the odometry is kept.
    pub noise: MotionComponent,
    /// Smallest noise with a score within one standard error of the best, for data that are too few for the
    /// best noise (the rule of Breiman et al., *Classification and Regression Trees*, 1984). Almost zero if the
    /// odometry is kept.
    #[serde(skip)]
    pub(super) smallest_noise: MotionComponent,
    /// Score of the best noise. The odometry is kept unless the score is significant.
    pub score: CrossValidationScore,
    #[serde(skip)]
    place: GridPoint,
}

/// Noise that leaves the odometry unchanged, in rad and m.
const UNCHANGED_SIGMA: f64 = 1e-5;

impl MotionComponent {
    /// Noise with which the odometry keeps its poses.
    pub(super) const UNCHANGED: Self =
        Self { rotation: UNCHANGED_SIGMA, translation: UNCHANGED_SIGMA, pivot: 0.0 };

    /// Returns the noise of the residual (ω, v) of a motion, in the frame of the later camera: v = p × ω + ε
    /// with the pivot p.
    pub(super) fn noise(&self) -> Result<Noise, NoiseError> {
        let Self { rotation: turn, translation: shift, pivot } = *self;
        if pivot == 0.0 {
            return Noise::sigmas(&[turn, turn, turn, shift, shift, shift]);
        }
        let about = Vector3::new(0.0, 0.0, pivot).cross_matrix();
        let (turned, shifted) = (Matrix3::identity() * turn.powi(2), Matrix3::identity() * shift.powi(2));
        let blocks = [
            [turned, turned * about.transpose()],
            [about * turned, about * turned * about.transpose() + shifted],
        ];
        let mut covariance = DMatrix::zeros(6, 6);
        for (i, row) in blocks.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                covariance.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(block);
            }
        }
        Noise::covariance(covariance)
    }
}

impl MotionChoice {
    /// Returns the choice before the search.
    pub(super) fn initial() -> Self {
        Self {
            noise: component(SEARCH_START, 0.0),
            smallest_noise: component(SEARCH_START, 0.0),
            score: CrossValidationScore { cost: 0.0, deviation: 0.0 },
            place: SEARCH_START,
        }
    }

    /// Returns whether the input odometry is kept.
    pub fn keeps_input(&self) -> bool {
        !self.score.is_better()
    }

    /// Returns whether a standard deviation is the largest of the search, so that the best one may be larger.
    pub fn is_at_limit(&self) -> bool {
        !self.keeps_input() && self.place.0.max(self.place.1) == GRID_LIMITS[1]
    }
}

/// A point of the search grid: both standard deviations in half decades relative to 1e-3, and whether there
/// is a pivot.
type GridPoint = (i32, i32, bool);

/// Start of the search: 1e-3 rad and 1e-3 m, independent of the run document.
const SEARCH_START: GridPoint = (0, 0, false);
/// Limits of the grid: 1e-5 and 1.
const GRID_LIMITS: [i32; 2] = [-4, 6];

fn component((turn, shift, turns): GridPoint, pivot: f64) -> MotionComponent {
    let sigma = |half_decades: i32| 10f64.powf(-3.0 + 0.5 * f64::from(half_decades));
    MotionComponent {
        rotation: sigma(turn),
        translation: sigma(shift),
        pivot: if turns { pivot } else { 0.0 },
    }
}

/// State of the grid search.
struct GridSearch<'a> {
    observer: &'a mut dyn Observer,
    validation: &'a CrossValidation<'a>,
    pivot: f64,
    scores: BTreeMap<GridPoint, CrossValidationScore>,
}

impl GridSearch<'_> {
    fn try_all(&mut self, places: impl Iterator<Item = GridPoint>) -> Result<(), VarianceError> {
        if self.observer.poll().is_break() {
            return Ok(());
        }
        let is_inside = |at: i32| (GRID_LIMITS[0]..=GRID_LIMITS[1]).contains(&at);
        let new: Vec<GridPoint> = places
            .filter(|place| is_inside(place.0) && is_inside(place.1) && !self.scores.contains_key(place))
            .collect();
        let components: Vec<_> = new.iter().map(|place| component(*place, self.pivot)).collect();
        self.scores.extend(new.into_iter().zip(self.validation.scores(&components)?));
        Ok(())
    }

    fn best(&self) -> Option<(GridPoint, CrossValidationScore)> {
        // the first of equal ones
        let best = self.scores.iter().min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        best.map(|(place, score)| (*place, *score))
    }

    /// Moves to the best neighbour of the best point until there is no better one.
    fn descend(&mut self, step: i32) -> Result<(), VarianceError> {
        while let Some(((turn, shift, turns), _)) = self.best() {
            let steps = [-step, 0, step];
            let around = steps.into_iter().flat_map(|i| steps.map(|j| (turn + i, shift + j, turns)));
            let other = (turn, shift, !turns && self.pivot > 0.0);
            self.try_all(around.chain([other]).collect::<Vec<_>>().into_iter())?;
            if self.best().is_some_and(|(best, _)| best == (turn, shift, turns)) {
                break;
            }
        }
        Ok(())
    }
}

/// Returns the smallest noise with a score within one standard error of the best one.
fn smallest(
    scores: &BTreeMap<GridPoint, CrossValidationScore>,
    best: &CrossValidationScore,
) -> Option<GridPoint> {
    let close = scores.iter().filter(|(_, score)| score.cost <= best.cost + best.deviation);
    let size = |(turn, shift, _): &GridPoint| turn + shift;
    let smallest = close.min_by(|a, b| size(a.0).cmp(&size(b.0)).then(a.1.cost.total_cmp(&b.1.cost)));
    smallest.map(|(place, _)| *place)
}

/// Returns the median distance of objects from the camera over all boxes, in metres.
pub(super) fn median_distance(estimate: &Estimate) -> f64 {
    let (values, measurements) = (&estimate.solution.values, &estimate.mapping.measurements);
    let of_object = |landmark: LandmarkEstimate<'_>| {
        let views = measurements.object(landmark.object.id).map_or(&[][..], |measured| &measured.views);
        let poses = views.iter().filter_map(|view| values.get::<Se3>(pose_key(view.frame)).ok());
        poses.map(|pose| (pose.translation - landmark.quadric.centroid()).norm()).collect::<Vec<_>>()
    };
    let mut distances: Vec<f64> = estimate.landmarks().into_iter().flat_map(of_object).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or_default()
}

/// Searches the grid in steps of a decade, then of half a decade. If a noise was chosen `before`, for a
/// different box noise, searches from there in half decades only. `pivot` is the distance of the observed
/// scene, in metres.
///
/// # Errors
/// If the graph of a fold cannot be compiled.
pub(super) fn choose_noise(
    validation: &CrossValidation<'_>,
    pivot: f64,
    before: Option<MotionChoice>,
    observer: &mut dyn Observer,
) -> Result<Option<MotionChoice>, VarianceError> {
    let mut search = GridSearch { observer, validation, pivot, scores: BTreeMap::new() };
    let begin = before.map_or(SEARCH_START, |before| before.place);
    search.try_all([begin].into_iter())?;
    if before.is_none() {
        search.descend(2)?;
    }
    search.descend(1)?;
    let chosen = search.best().map(|(place, score)| {
        let noise_at = |place: GridPoint| {
            if score.is_better() { component(place, pivot) } else { MotionComponent::UNCHANGED }
        };
        let smallest = smallest(&search.scores, &score).unwrap_or(place);
        MotionChoice { noise: noise_at(place), smallest_noise: noise_at(smallest), score, place }
    });
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn the_largest_noise_of_the_search_is_at_its_limit() {
        let choice = |turn, cost| MotionChoice {
            score: CrossValidationScore { cost, deviation: 1.0 },
            place: (turn, 0, false),
            ..MotionChoice::initial()
        };
        assert!(choice(GRID_LIMITS[1], -9.0).is_at_limit());
        assert!(!choice(GRID_LIMITS[1] - 1, -9.0).is_at_limit());
        assert!(!choice(GRID_LIMITS[1], 9.0).is_at_limit(), "the odometry is kept");
    }

    #[test]
    fn the_smallest_noise_is_as_good_as_the_best_within_its_error() {
        let score = |cost| CrossValidationScore { cost, deviation: 10.0 };
        let scores = BTreeMap::from([
            ((0, 0, false), score(-100.0)),
            ((-1, 0, true), score(-95.0)),
            ((0, -1, false), score(-96.0)),
            ((-2, -2, false), score(-89.0)),
            ((2, 2, false), score(-99.0)),
        ]);
        // of two equally small ones, the better
        assert_eq!(smallest(&scores, &score(-100.0)), Some((0, -1, false)));
        assert_eq!(smallest(&scores, &score(-98.0)), Some((-2, -2, false)));
    }

    #[test]
    fn turning_about_the_pivot_moves_what_is_there_by_nothing() {
        let noise = MotionComponent { rotation: 0.1, translation: 0.01, pivot: 2.0 }.noise().unwrap();
        let pivot = Vector3::new(0.0, 0.0, 2.0);
        let squared = |turn: Vector3<f64>, shift: Vector3<f64>| {
            let r = DVector::from_iterator(6, turn.iter().chain(shift.iter()).copied());
            (r.transpose() * noise.information_matrix(6).unwrap() * &r)[(0, 0)]
        };
        // a point p does not move under Exp(ω, v) with v = p × ω
        let turn = Vector3::new(0.1, -0.2, 0.3);
        assert!((squared(turn, pivot.cross(&turn)) - turn.norm_squared() / 0.01).abs() < 1e-9);
        let shift = Vector3::new(0.01, 0.0, 0.02);
        assert!((squared(turn, pivot.cross(&turn) + shift) - (14.0 + 5.0)).abs() < 1e-9);
    }

    #[test]
    fn without_a_pivot_rotation_and_translation_are_independent() {
        let noise = MotionComponent { rotation: 0.1, translation: 0.01, pivot: 0.0 }.noise().unwrap();
        assert_eq!(noise, Noise::sigmas(&[0.1, 0.1, 0.1, 0.01, 0.01, 0.01]).unwrap());
    }
}
