//! Measures of a trial.
use indexmap::IndexMap;
use manifactor_config::quoted_list;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::semantics::{SemanticRule, table_one};
use manifactor_metrics::Alignment;
use manifactor_quadric::DualQuadric;
use manifactor_recording::class::ClassAliases;
use manifactor_run::output::report::{TrajectoryReport, VariantReport, alignment_name};

/// Name of a measure of a trajectory, and the function that computes it.
type TrajectoryMeasure = (&'static str, fn(&TrajectoryReport) -> Option<f64>);
/// Name of a measure of a whole estimate, and the function that computes it.
type EstimateMeasure = (&'static str, fn(&Estimate, &VariantReport) -> Option<f64>);

/// Measures under each alignment: `ate` gives `ate_se3`, `ate_sim3`, ….
const ALIGNMENT_MEASURES: [TrajectoryMeasure; 9] = [
    ("ate", |t| Some(t.estimate.ate.rmse)),
    ("odometry_ate", |t| Some(t.odometry.ate.rmse)),
    ("gain", |t| Some(1.0 - t.estimate.ate.rmse / t.odometry.ate.rmse)),
    ("gain_low", |t| Some(-t.change?.high?)),
    ("gain_high", |t| Some(-t.change?.low?)),
    ("rpe_translation", |t| Some(t.estimate.rpe.as_ref()?.translation.rmse)),
    ("rpe_rotation", |t| Some(t.estimate.rpe.as_ref()?.rotation.rmse)),
    ("odometry_rpe_translation", |t| Some(t.odometry.rpe.as_ref()?.translation.rmse)),
    ("odometry_rpe_rotation", |t| Some(t.odometry.rpe.as_ref()?.rotation.rmse)),
];

/// Measures that do not depend on an alignment.
const ESTIMATE_MEASURES: [EstimateMeasure; 37] = [
    ("position", |_, r| Some(r.landmarks?.estimate.rmse.position)),
    ("position_mean", |_, r| Some(r.landmarks?.estimate.mean.position)),
    ("shape", |_, r| Some(r.landmarks?.estimate.mean.shape)),
    ("quality", |_, r| Some(r.landmarks?.estimate.mean.quality)),
    ("volume", |_, r| Some(r.landmarks?.estimate.mean.volume)),
    ("tilt", |_, r| Some(r.landmarks?.estimate.mean.tilt)),
    ("proportions", |_, r| Some(r.landmarks?.estimate.mean.proportions)),
    ("initial_position", |_, r| Some(r.landmarks?.initial.rmse.position)),
    ("initial_position_mean", |_, r| Some(r.landmarks?.initial.mean.position)),
    ("initial_shape", |_, r| Some(r.landmarks?.initial.mean.shape)),
    ("initial_quality", |_, r| Some(r.landmarks?.initial.mean.quality)),
    ("scored", |_, r| Some(r.landmarks?.objects as f64)),
    ("nees_poses", |_, r| r.consistency?.poses),
    ("nees_objects", |_, r| r.consistency?.objects),
    ("c_vertical", |e, _| mean_alignment(e, "vertical_orientation")),
    ("c_horizontal", |e, _| mean_alignment(e, "horizontal_orientation")),
    ("sigma_rotation", |e, _| Some(e.components.last()?.odometry?.noise.rotation)),
    ("sigma_translation", |e, _| Some(e.components.last()?.odometry?.noise.translation)),
    ("held_out_iou", |_, r| Some(r.held_out.as_ref()?.all.iou.mean)),
    ("held_out_iou_error", |_, r| r.held_out.as_ref()?.all.iou.error),
    ("held_out_iou_unmapped_as_zero", |_, r| Some(r.held_out.as_ref()?.iou_unmapped_as_zero.mean)),
    ("held_out_px", |_, r| Some(r.held_out.as_ref()?.all.pixels.mean)),
    ("pivot", |e, _| Some(e.components.last()?.odometry?.noise.pivot)),
    ("validation", |e, _| Some(e.components.last()?.odometry?.score.cost)),
    ("validation_error", |e, _| Some(e.components.last()?.odometry?.score.deviation)),
    ("sigma_box_px", |e, _| {
        let boxes = &e.components.last()?.boxes;
        Some(boxes.values().map(|component| component.effective_px).sum::<f64>() / boxes.len() as f64)
    }),
    ("variance_rounds", |e, _| e.components.last().map(|_| e.components.len() as f64)),
    ("objects_detected", |_, r| Some(r.counts.objects_detected as f64)),
    ("objects", |_, r| Some(r.counts.objects as f64)),
    ("completeness", |_, r| Some(r.counts.objects as f64 / r.counts.objects_detected as f64)),
    ("boxes", |_, r| Some(r.counts.boxes as f64)),
    ("semantic_factors", |_, r| Some(r.counts.semantic_factors as f64)),
    ("unsound", |e, _| Some(count_unsound_objects(e) as f64)),
    ("inactive", |_, r| Some(r.solve.inactive as f64)),
    ("initial_cost", |_, r| Some(r.solve.initial_cost)),
    ("final_cost", |_, r| Some(r.solve.final_cost)),
    ("iterations", |_, r| Some(r.solve.iterations as f64)),
];

/// Returns all measures of an estimate by name. Unknown and non-finite values are left out.
///
/// Lengths are in metres, angles in radians.
/// - `ate_*` and `rpe_*` are RMSEs by alignment; `odometry_*` are RMSEs of the odometry alone.
/// - `gain_*` is the decrease of the ATE as a share of odometry's ATE. `gain_low_*` and `gain_high_*` are the
///   ends of its 95 % confidence interval, over blocks of ten seconds.
/// - `position` is an RMSE, `position_mean` a mean.
/// - `shape`, `quality` and `volume` are mean Jaccard distances; `volume` is that of oriented cuboids.
/// - `tilt` is the mean angle between the true vertical axis of an object and the nearest principal axis, in rad, and
///   `proportions` the mean RMS error of the logarithms of relative semi-axes.
/// - `held_out_iou` is the mean over held-out boxes of mapped objects; in `held_out_iou_unmapped_as_zero`, boxes
///   of objects that are not in the map count as 0.
/// - `completeness` is the number of objects in the map as a share of the detected ones.
/// - `initial_*` are measures of the objects before the solve.
/// - `nees_*` are normalized errors squared per degree of freedom, 1 if covariances are right.
/// - `c_vertical` is the mean of |m · up| over objects that are vertical by the paper's Table I, with their
///   longest axis m; `c_horizontal` likewise.
pub fn measures(estimate: &Estimate, report: &VariantReport) -> IndexMap<String, f64> {
    let aligned = report.trajectory.iter().flat_map(|trajectory| {
        ALIGNMENT_MEASURES.iter().map(|(name, of)| (aligned(name, trajectory.alignment), of(trajectory)))
    });
    let once = ESTIMATE_MEASURES.iter().map(|(name, of)| ((*name).to_owned(), of(estimate, report)));
    aligned.chain(once).filter_map(|(name, value)| Some((name, value.filter(|x| x.is_finite())?))).collect()
}

/// Returns the names of all measures under these alignments.
pub(crate) fn measure_names(alignments: &[Alignment]) -> Vec<String> {
    let by = alignments.iter().flat_map(|by| ALIGNMENT_MEASURES.iter().map(|(name, _)| aligned(name, *by)));
    by.chain(ESTIMATE_MEASURES.iter().map(|(name, _)| (*name).to_owned())).collect()
}

/// Returns all names in words; `*` stands for an alignment.
pub(super) fn measure_names_in_words() -> String {
    let stems = ALIGNMENT_MEASURES.map(|(name, _)| format!("`{name}_*`")).join(", ");
    let once = ESTIMATE_MEASURES.map(|(name, _)| format!("`{name}`")).join(", ");
    let alignments = quoted_list(&Alignment::ALL.map(alignment_name));
    format!("{stems}, where `*` is an alignment of the run ({alignments}), {once}")
}

fn aligned(name: &str, alignment: Alignment) -> String {
    format!("{name}_{}", alignment_name(alignment))
}

/// Returns the number of objects with a semi-axis that is not positive, or with a number that is not finite.
fn count_unsound_objects(estimate: &Estimate) -> usize {
    let sound = |q: &DualQuadric| {
        let numbers = q.semi_axes.iter().chain(q.pose.translation.iter());
        numbers.copied().all(f64::is_finite) && q.semi_axes.min() > 0.0
    };
    estimate.landmarks().iter().filter(|landmark| !sound(landmark.quadric)).count()
}

/// Returns the mean of |m · up| over mapped objects of classes that have this factor in Table I.
fn mean_alignment(estimate: &Estimate, factor: &str) -> Option<f64> {
    let up = estimate.mapping.frame.up?;
    let (rules, aliases) = (table_one().ok()?, ClassAliases::default());
    let applies = |class: &str| {
        let applies =
            |rule: &SemanticRule| rule.factor.factor_type() == factor && rule.applies(class, &aliases);
        rules.iter().any(applies)
    };
    let landmarks = estimate.landmarks();
    let of_class = |l: &&manifactor_mapping::estimate::LandmarkEstimate<'_>| {
        l.object.class.as_ref().is_some_and(|c| applies(&c.name))
    };
    let cosines: Vec<f64> =
        landmarks.iter().filter(of_class).map(|l| l.quadric.major_axis().dot(&up).abs()).collect();
    (!cosines.is_empty()).then(|| cosines.iter().sum::<f64>() / cosines.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_alignment_has_its_measures_and_each_measure_a_name_of_its_own() {
        let schema = schemars::schema_for!(Alignment);
        let alignments = schema.get("oneOf").and_then(|each| each.as_array()).unwrap();
        assert_eq!(alignments.len(), Alignment::ALL.len(), "{schema:?}");
        let names = measure_names(&Alignment::ALL);
        assert_eq!(names.iter().collect::<HashSet<_>>().len(), names.len());
        assert_eq!(names.len(), ALIGNMENT_MEASURES.len() * alignments.len() + ESTIMATE_MEASURES.len());
    }
}
