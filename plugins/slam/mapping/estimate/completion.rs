//! Second stage of a run: all objects from all boxes, with the poses of the first stage.
//!
//! Boxes that the image border cuts, and boxes that no ellipsoid explains, would distort the trajectory. So
//! they do not take part in the joint solve, and the objects are completed afterwards, each alone.
use super::refine::{Refiner, object_graph};
use super::{Estimate, EstimateError};
use crate::mapping::measurements::{Measurements, ObjectBox, ObjectMeasurements};
use crate::mapping::rejection::{Rejection, initial_quadric};
use crate::mapping::rules::SemanticFactors;
use crate::mapping::{MappedObject, Mapping, MappingError, Warning, object_key, pose_key};
use crate::settings::RunSettings;
use indexmap::IndexMap;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{FactorEntry, Key, Values};
use manifactor_quadric::{BoundingBoxFactor, BoxModel, DualQuadric};
use manifactor_solve::{
    CompileError, LevenbergMarquardt, Observer, Outcome, Silent, Stall, Stopping, Termination, solve,
};
use serde::Serialize;

/// A box of a stalled fit is removed if it overlaps less with the ellipsoid (intersection over union).
const MIN_BOX_OVERLAP: f64 = 0.1;

/// Number of times that the fit of an object is continued when its iterations run out.
const MAX_CONTINUATIONS: usize = 10;

/// Share of boxes without an ellipsoid that explains them, above which the poses or the camera are probably
/// wrong. On TUM RGB-D it is below 0.02. In a simulated recording with quaternions in the
/// wrong order, poses of the body, inverted poses or wrong intrinsics, it is 0.23 to 0.57.
const MAX_UNEXPLAINED: f64 = 0.2;
/// The limit for less than `FEW_BOXES` boxes, where a single object may have a fifth of them.
const MAX_UNEXPLAINED_OF_FEW: f64 = 0.5;
const FEW_BOXES: usize = 200;

/// Result of the second stage.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CompletionOutcome {
    /// Number of objects in the map of the first stage.
    pub objects_before: usize,
    /// Number of boxes in the map of the first stage.
    pub boxes_before: usize,
    /// Number of objects in the map.
    pub objects: usize,
    /// Number of their boxes.
    pub boxes: usize,
    /// Cost ½ Σ ρ of the complete graph.
    pub cost: f64,
}

/// A complete graph with its fitted values.
struct FittedObjects {
    mapping: Mapping,
    values: Values,
    /// Objects whose fit did not reach a minimum, with the ends of their solves.
    stalled: IndexMap<Key, Termination>,
    interrupted: bool,
}

impl Estimate {
    /// Maps all objects from all their boxes, with the poses of this estimate.
    ///
    /// # Errors
    /// If the graph cannot be created or compiled.
    pub(super) fn complete(
        mut self,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let first = &self.solution.outcome;
        let is_interrupted = first.termination == Termination::Interrupted;
        if !settings.completion.enabled || is_interrupted || !self.solution.weights.is_empty() {
            return Ok(self);
        }
        let settings = settings.of_completion();
        let FittedObjects { mut mapping, values, stalled, interrupted } =
            self.fit_objects(&settings, observer)?;
        let warning = misfit_warning(&mapping);
        if mapping.mapped().next().is_none() {
            self.mapping.warnings.extend(warning);
            return Ok(self);
        }
        mapping.warnings.extend(warning);
        // compiled with free poses, for covariances
        let evaluate = LevenbergMarquardt {
            stop: Stopping { max_iterations: 0, ..Stopping::default() },
            ..LevenbergMarquardt::default()
        };
        let mut solution = solve(&mapping.graph, &values, &evaluate, &mut Silent)?;
        let boxes = |mapping: &Mapping| mapping.mapped().map(|object| object.boxes).sum();
        let completion = CompletionOutcome {
            objects_before: self.mapping.mapped().count(),
            boxes_before: boxes(&self.mapping),
            objects: mapping.mapped().count(),
            boxes: boxes(&mapping),
            cost: solution.outcome.final_cost,
        };
        let Outcome { factors, inactive, inactive_factors, .. } = solution.outcome;
        let first = self.solution.outcome;
        let termination = match stalled.into_values().next() {
            _ if interrupted => Termination::Interrupted,
            Some(termination) if first.termination.is_converged() => termination,
            _ => first.termination.clone(),
        };
        solution.outcome = Outcome { termination, factors, inactive, inactive_factors, ..first };
        Ok(Self { mapping, solution, completion: Some(completion), detections: settings.detections, ..self })
    }

    /// Returns the complete graph and its values. Objects whose fit does not reach a minimum or does not explain
    /// their boxes are left out.
    fn fit_objects(
        &self,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<FittedObjects, EstimateError> {
        let sequence = &*self.sequence;
        let mut measurements = Measurements::gather(sequence, settings);
        let at = |i: usize| {
            let pose = *self.solution.values.get::<Se3>(pose_key(i)).ok()?;
            Some(StampedPose { timestamp: sequence.frames.get(i)?.timestamp, pose })
        };
        let start = |measured: &ObjectMeasurements| {
            let found = initial_quadric(measured, at, settings);
            let before = || self.solution.values.get::<DualQuadric>(object_key(measured.id)).ok().copied();
            found.or_else(|rejection| match rejection {
                Rejection::Initialisation { .. } => before().ok_or(rejection),
                _ => Err(rejection),
            })
        };
        let mut starts: Vec<_> = measurements.objects.iter().map(start).collect();
        let first: Vec<_> =
            measurements.objects.iter().map(|measured| object_key(measured.id)).zip(starts.clone()).collect();
        let mut refine = true;
        loop {
            let mut fitted = self.fit_from(settings, &measurements, starts, refine, observer)?;
            let (mut is_settled, mut untouched) = (true, 0);
            let mut check = |(object, measured): (&MappedObject, &mut ObjectMeasurements)| {
                if let Some(rejection) = &object.rejected {
                    return Err(rejection.clone());
                }
                let checked = fitted.check(object, measured, settings);
                is_settled &= matches!(checked, Ok((_, 0)));
                let (quadric, removed) = checked?;
                untouched += removed;
                Ok(quadric)
            };
            starts = fitted.mapping.objects.iter().zip(&mut measurements.objects).map(&mut check).collect();
            if fitted.interrupted || is_settled {
                // the values before the first stage, which reports compare with the estimate; later ones are fitted
                for (key, quadric) in first.into_iter().filter_map(|(key, start)| Some((key, start.ok()?))) {
                    let before = self.mapping.values.get(&key).ok().copied();
                    if fitted.mapping.values.contains(key.as_str()) {
                        fitted.mapping.values.insert(key, before.unwrap_or(quadric));
                    }
                }
                return Ok(fitted);
            }
            measurements.untouched += untouched;
            refine = false;
        }
    }

    /// Assembles the graph from initial values, and solves it with fixed poses. With `refine`, each object is
    /// first fitted from several initial values.
    fn fit_from(
        &self,
        settings: &RunSettings,
        measurements: &Measurements,
        starts: Vec<Result<DualQuadric, Rejection>>,
        refine: bool,
        observer: &mut dyn Observer,
    ) -> Result<FittedObjects, EstimateError> {
        let frame = self.mapping.frame;
        let decisions =
            SemanticFactors::default().complete_decisions(measurements, starts, settings, frame.up);
        let decisions = decisions.map_err(MappingError::from)?;
        let mut mapping =
            Mapping::assemble(&self.sequence, settings, frame, measurements.clone(), decisions)?;
        if let (Some(found), Some(variance)) = (self.components.last(), &settings.variance_components) {
            found.apply_to_graph(&mut mapping, variance, settings.detections.loss.as_ref())?;
        }
        let mut values = mapping.values.clone();
        for (key, value) in self.solution.values.iter() {
            if !value.erased().as_any().is::<DualQuadric>() && values.contains(key.as_str()) {
                values.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        if refine {
            Refiner::new(&mapping).refine(&mut values);
        }
        Ok(FittedObjects::solve(mapping, values, settings, observer)?)
    }
}

impl FittedObjects {
    /// Solves with fixed poses. Objects that no factor connects are solved one by one, so that one of them
    /// cannot stop the rest.
    fn solve(
        mapping: Mapping,
        mut values: Values,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, CompileError> {
        let (mut stalled, mut interrupted) = (IndexMap::new(), false);
        for (keys, entries) in connected_objects(&mapping) {
            interrupted |= observer.poll().is_break();
            if interrupted {
                break;
            }
            let (graph, start) = object_graph(&keys, entries.into_iter(), &values);
            let mut solved = settings.solver.solve(&graph, &start, &mut Silent)?;
            for _ in 0..MAX_CONTINUATIONS {
                // a small problem takes many cheap iterations to rounding error
                if solved.outcome.termination != Termination::MaxIterations {
                    break;
                }
                solved = settings.solver.solve(&graph, &solved.values, &mut Silent)?;
            }
            for key in keys {
                if let Some(value) = solved.values.variable(key.as_str()) {
                    values.insert_boxed(key.clone(), value.erased().clone_box());
                }
                if !solved.outcome.termination.is_converged() {
                    stalled.insert(key.clone(), solved.outcome.termination.clone());
                }
            }
        }
        Ok(Self { mapping, values, stalled, interrupted })
    }

    /// Returns the ellipsoid of a mapped object if its fit reached a minimum and explains its boxes. If the fit
    /// stalled, removes the boxes that the ellipsoid does not touch, for another fit, and returns their number.
    fn check(
        &self,
        object: &MappedObject,
        measured: &mut ObjectMeasurements,
        settings: &RunSettings,
    ) -> Result<(DualQuadric, usize), Rejection> {
        let missing = Rejection::Views { views: 0, least: settings.objects.min_views };
        let quadric = *self.values.get::<DualQuadric>(&object.key).map_err(|_| missing)?;
        if measured.prior.is_some() {
            return Ok((quadric, 0));
        }
        let overlap_of = |view: &ObjectBox| overlap(view, &quadric, &self.values);
        // at a jump, the cost is least beside it
        let is_jump = |end: &&Termination| matches!(end, Termination::Stalled { reason: Stall::Jump });
        if let Some(termination) = self.stalled.get(&object.key).filter(|end| !is_jump(end)) {
            let before = measured.views.len();
            measured.views.retain(|view| overlap_of(view) > MIN_BOX_OVERLAP);
            if measured.views.len() == before || measured.views.len() < settings.objects.min_views {
                return Err(Rejection::Stalled { termination: termination.to_string() });
            }
            return Ok((quadric, before - measured.views.len()));
        }
        let mut overlaps: Vec<f64> = measured.views.iter().map(overlap_of).collect();
        overlaps.sort_by(f64::total_cmp);
        let overlap = overlaps.get(overlaps.len() / 2).copied().unwrap_or(1.0);
        let limit = *settings.completion.min_overlap;
        if overlap < limit { Err(Rejection::Misfit { overlap, limit }) } else { Ok((quadric, 0)) }
    }
}

/// Returns the mapped objects in groups that factors connect, each with its factors.
fn connected_objects(mapping: &Mapping) -> Vec<(Vec<&Key>, Vec<&FactorEntry>)> {
    let objects: IndexMap<&Key, usize> =
        mapping.mapped().enumerate().map(|(i, object)| (&object.key, i)).collect();
    let mut group: Vec<usize> = (0..objects.len()).collect();
    let members = |entry: &FactorEntry| -> Vec<usize> {
        entry.keys.iter().filter_map(|key| objects.get(key).copied()).collect()
    };
    for entry in mapping.graph.factors() {
        if let [first, rest @ ..] = &members(entry)[..] {
            for other in rest {
                let (from, into) = (group[*other], group[*first]);
                group.iter_mut().filter(|own| **own == from).for_each(|own| *own = into);
            }
        }
    }
    let mut groups: IndexMap<usize, (Vec<&Key>, Vec<&FactorEntry>)> = IndexMap::new();
    for (key, i) in &objects {
        groups.entry(group[*i]).or_default().0.push(*key);
    }
    for entry in mapping.graph.factors() {
        if let Some(group) = members(entry).first().and_then(|i| groups.get_mut(&group[*i])) {
            group.1.push(entry);
        }
    }
    groups.into_values().collect()
}

/// Returns a warning if too many boxes belong to objects without an ellipsoid that explains them.
fn misfit_warning(mapping: &Mapping) -> Option<Warning> {
    let boxes = |of: &dyn Fn(&MappedObject) -> bool| -> usize {
        mapping.objects.iter().filter(|object| of(object)).map(|object| object.boxes).sum()
    };
    let (unexplained, mapped) = (boxes(&is_unexplained), boxes(&|object| object.rejected.is_none()));
    let boxes = unexplained + mapped;
    let limit = match boxes {
        // there is a warning that no object is mapped
        ..FEW_BOXES if mapped == 0 => return None,
        ..FEW_BOXES => MAX_UNEXPLAINED_OF_FEW,
        _ => MAX_UNEXPLAINED,
    };
    (unexplained as f64 > limit * boxes as f64).then_some(Warning::PosesMisfit { unexplained, boxes })
}

fn is_unexplained(object: &MappedObject) -> bool {
    matches!(
        object.rejected,
        Some(Rejection::Misfit { .. } | Rejection::Stalled { .. } | Rejection::Initialisation { .. })
    )
}

/// Returns the intersection over union of a box with the visible part of an ellipsoid's outline.
fn overlap(view: &ObjectBox, quadric: &DualQuadric, values: &Values) -> f64 {
    let Ok(pose) = values.get::<Se3>(pose_key(view.frame)) else { return 0.0 };
    let (bounding_box, camera, pose) = (view.bounding_box, view.camera.model, view.camera_pose(pose));
    let factor = BoundingBoxFactor { bounding_box, camera, model: BoxModel::Truncated };
    let outline = factor.predict(&pose, quadric).filter(|_| quadric.is_in_front_of(&pose));
    outline.map_or(0.0, |outline| outline.iou(&view.bounding_box))
}
