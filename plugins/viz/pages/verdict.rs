//! The verdict on a run: one sentence above the map.
use manifactor_quadric::LandmarkError;
use manifactor_slam::record::{ObjectRecord, RunRecord, VariantRecord};
use manifactor_slam::report::{RunReport, VariantReport};

/// Returns one sentence on the last variant. With ground truth it has the changes of the errors against the
/// first variant, or against odometry if there is only one variant. Without ground truth it has the prediction
/// of held-out boxes, or the size of the map.
pub(super) fn verdict(report: &RunReport, record: &RunRecord) -> Option<String> {
    let (first, last) = (report.variants.first()?, report.variants.last()?);
    let records = (record.variants.first()?, record.variants.last()?);
    let changes =
        if report.variants.len() > 1 { changes((first, records.0), (last, records.1)) } else { vec![] };
    let name = &last.name;
    if !changes.is_empty() {
        let changes = changes.join(", ");
        let (before, after) = (first.counts.objects, last.counts.objects);
        let objects = match before == after {
            true => String::new(),
            false => format!("{after} objects in place of {before}; "),
        };
        let first = &first.name;
        return Some(format!("{name} beside {first}: {objects}{changes}. A negative change is better."));
    }
    let parts = [own_errors(last), held_out(first, last), size(last)];
    parts.into_iter().flatten().next().map(|part| format!("{name}: {part}."))
}

/// Returns the changes of the errors from the first to the last variant. Errors of objects are means over the
/// objects that both variants have.
fn changes(
    (first, first_record): (&VariantReport, &VariantRecord),
    (last, last_record): (&VariantReport, &VariantRecord),
) -> Vec<String> {
    let (before, after) = (first.row(), last.row());
    let of_objects = |measure: fn(&LandmarkError) -> f64| mean_errors(first_record, last_record, measure);
    let errors = [
        ("position error", of_objects(|error| error.position)),
        ("volume error", of_objects(|error| error.volume)),
        ("shape error", of_objects(|error| error.shape)),
        ("ATE", before.ate.zip(after.ate).map(|(before, after)| [before, after])),
    ];
    let change = |(name, errors): (&str, Option<[f64; 2]>)| {
        let [before, after] = errors?;
        Some(format!("{name} {}", percent(relative(before, after)?)))
    };
    errors.into_iter().filter_map(change).collect()
}

/// Returns the relative change; `None` if the first number is not positive.
pub(super) fn relative(before: f64, after: f64) -> Option<f64> {
    (before > 0.0 && after.is_finite()).then(|| after / before - 1.0)
}

/// Formats a relative change with its sign.
pub(super) fn percent(change: f64) -> String {
    let percent = 100.0 * change;
    let digits = usize::from(percent.abs() < 9.95);
    let text = format!("{percent:+.digits$}");
    let is_zero = !text.contains(|c: char| ('1'..='9').contains(&c));
    // a no-break space keeps number and unit on one line
    if is_zero { "±0\u{a0}%".to_owned() } else { format!("{text}\u{a0}%") }
}

/// Returns the errors of a run with one variant.
fn own_errors(report: &VariantReport) -> Option<String> {
    let row = report.row();
    let mut parts = vec![];
    if let (Some(before), Some(after)) = (row.odometry_ate, row.ate) {
        let change = relative(before, after).map(|change| format!(" ({} beside odometry)", percent(change)));
        parts.push(format!("ATE {after:.4} m{}", change.unwrap_or_default()));
    }
    parts.extend(row.position.map(|error| format!("position error of the objects {error:.4} m")));
    (!parts.is_empty()).then(|| parts.join(", "))
}

/// Returns the prediction of held-out boxes.
fn held_out(first: &VariantReport, last: &VariantReport) -> Option<String> {
    let own = last.held_out.as_ref()?;
    let other = first.held_out.as_ref().filter(|_| first.name != last.name);
    let other = other.map(|other| format!(", beside {:.3} of {}", other.all.iou.mean, first.name));
    let boxes = own.all.boxes;
    Some(format!(
        "IoU {:.3} of {boxes} held-out boxes with their predictions{}",
        own.all.iou.mean,
        other.unwrap_or_default()
    ))
}

/// Returns the size of the map.
fn size(report: &VariantReport) -> Option<String> {
    let counts = report.counts;
    let end = if report.solve.termination.is_converged() { "converged" } else { "did not converge" };
    Some(format!(
        "{} objects from {} boxes in {} frames, and the solve {end}; there is no ground truth to compare with",
        counts.objects, counts.boxes, counts.frames
    ))
}

/// Returns the mean errors of the objects that both variants have.
fn mean_errors(
    first: &VariantRecord,
    last: &VariantRecord,
    measure: fn(&LandmarkError) -> f64,
) -> Option<[f64; 2]> {
    let error = |object: &ObjectRecord| object.error.as_ref().map(measure).filter(|error| error.is_finite());
    let other = |id| last.objects.iter().find(|object| object.id == id);
    let pair = |object: &ObjectRecord| Some([error(object)?, error(other(object.id)?)?]);
    let pairs: Vec<[f64; 2]> = first.objects.iter().filter_map(pair).collect();
    let mean = |place: usize| pairs.iter().map(|pair| pair[place]).sum::<f64>() / pairs.len() as f64;
    (!pairs.is_empty()).then(|| [mean(0), mean(1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_have_their_sign_and_few_digits() {
        assert_eq!(percent(-0.3), "-30\u{a0}%");
        assert_eq!(percent(0.0213), "+2.1\u{a0}%");
        assert_eq!(percent(-0.0001), "±0\u{a0}%");
        assert_eq!(percent(10.0), "+1000\u{a0}%");
    }

    #[test]
    fn a_change_needs_a_positive_baseline() {
        assert_eq!(relative(2.0, 1.0), Some(-0.5));
        assert_eq!(relative(0.0, 1.0), None);
        assert_eq!(relative(f64::NAN, 1.0), None);
        assert_eq!(relative(1.0, f64::INFINITY), None);
    }
}
