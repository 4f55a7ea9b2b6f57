//! What a trial is measured by.
use crate::class::Aliases;
use crate::estimate::Estimate;
use crate::report::{TrajectoryError, VariantReport, alignment_name};
use crate::semantics::{Rule, table_one};
use indexmap::IndexMap;
use manifactor_quadric::DualQuadric;

/// Everything that is measured of an estimate, by name. What is not known, or not finite, is left out.
///
/// Lengths are in metres, angles in radians. `ate_*` and `rpe_*` are RMSEs by alignment, `odometry_*` the same of the
/// odometry alone, `gain_*` by how much of it the ATE fell; `position` is an RMSE, `position_mean` a mean; `shape` and
/// `quality` are mean Jaccard distances; `initial_*` are of the objects before the solve. `c_vertical` is the mean of
/// |m · up| over objects that the paper's Table I has as vertical, m their longest axis; `c_horizontal` likewise.
pub fn measures(estimate: &Estimate, report: &VariantReport) -> IndexMap<String, f64> {
    let mut all = IndexMap::new();
    let mut put = |name: &str, value: f64| {
        if value.is_finite() {
            all.insert(name.to_owned(), value);
        }
    };
    for trajectory in &report.trajectory {
        let name = alignment_name(trajectory.alignment);
        let (before, after) = (&trajectory.odometry, &trajectory.estimate);
        put(&format!("ate_{name}"), after.ate.rmse);
        put(&format!("odometry_ate_{name}"), before.ate.rmse);
        put(&format!("gain_{name}"), 1.0 - after.ate.rmse / before.ate.rmse);
        for (prefix, error) in [("", after), ("odometry_", before)] {
            relative(error, |what, value| put(&format!("{prefix}rpe_{what}_{name}"), value));
        }
    }
    if let Some(landmarks) = &report.landmarks {
        for (prefix, summary) in [("", landmarks.estimate), ("initial_", landmarks.initial)] {
            put(&format!("{prefix}position"), summary.rmse.position);
            put(&format!("{prefix}position_mean"), summary.mean.position);
            put(&format!("{prefix}shape"), summary.mean.shape);
            put(&format!("{prefix}quality"), summary.mean.quality);
        }
        put("scored", landmarks.objects as f64);
    }
    for (name, factor) in [("c_vertical", "vertical_orientation"), ("c_horizontal", "horizontal_orientation")]
    {
        if let Some(c) = mean_alignment(estimate, factor) {
            put(name, c);
        }
    }
    if let Some(components) = estimate.components.last() {
        if let Some([turn, shift]) = components.odometry {
            put("sigma_rotation", turn);
            put("sigma_translation", shift);
        }
        let boxes: Vec<f64> = components.boxes.values().map(|component| component.effective_px).collect();
        put("sigma_box_px", boxes.iter().sum::<f64>() / boxes.len() as f64);
        put("variance_rounds", estimate.components.len() as f64);
    }
    let (counts, solve) = (&report.counts, &report.solve);
    put("objects_detected", counts.objects_detected as f64);
    put("objects", counts.objects as f64);
    put("boxes", counts.boxes as f64);
    put("semantic_factors", counts.semantic_factors as f64);
    put("unsound", unsound(estimate) as f64);
    put("inactive", solve.inactive as f64);
    put("initial_cost", solve.initial_cost);
    put("final_cost", solve.final_cost);
    put("iterations", solve.iterations as f64);
    all
}

fn relative(error: &TrajectoryError, mut put: impl FnMut(&str, f64)) {
    if let Some(rpe) = &error.rpe {
        put("translation", rpe.translation.rmse);
        put("rotation", rpe.rotation.rmse);
    }
}

/// Objects with a semi-axis that is not positive, or a number that is none.
fn unsound(estimate: &Estimate) -> usize {
    let sound = |q: &DualQuadric| {
        let numbers = q.semi_axes.iter().chain(q.pose.translation.iter());
        numbers.copied().all(f64::is_finite) && q.semi_axes.min() > 0.0
    };
    estimate.landmarks().iter().filter(|landmark| !sound(landmark.quadric)).count()
}

/// The mean of |m · up| over mapped objects of classes that Table I gives this factor.
fn mean_alignment(estimate: &Estimate, factor: &str) -> Option<f64> {
    let up = estimate.mapping.frame.up?;
    let (rules, aliases) = (table_one().ok()?, Aliases::default());
    let applies = |class: &str| {
        let applies = |rule: &Rule| rule.factor.name() == factor && rule.applies(class, &aliases);
        rules.iter().any(applies)
    };
    let landmarks = estimate.landmarks();
    let of_class =
        |l: &&crate::estimate::Landmark<'_>| l.object.class.as_ref().is_some_and(|c| applies(&c.name));
    let cosines: Vec<f64> =
        landmarks.iter().filter(of_class).map(|l| l.quadric.major_axis().dot(&up).abs()).collect();
    (!cosines.is_empty()).then(|| cosines.iter().sum::<f64>() / cosines.len() as f64)
}
