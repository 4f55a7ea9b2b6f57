//! The tables of a run's page.
use super::page::Page;
use super::verdict::{percent, relative};
use manifactor_graph::Key;
use manifactor_slam::mapping::MappedObject;
use manifactor_slam::record::VariantRecord;
use manifactor_slam::report::{
    ClusteredMean, ObjectReport, Prediction, RunReport, VariantReport, VariantRow,
};
use manifactor_slam::variance::{CrossValidationScore, MotionComponent};

pub(super) fn words<const N: usize>(words: [&str; N]) -> Vec<String> {
    words.map(str::to_owned).into()
}

/// Returns the header and the rows of a table of all variants.
pub(super) fn overview(report: &RunReport) -> (Vec<String>, Vec<Vec<String>>) {
    let header = [
        "variant",
        "odometry ATE (m)",
        "ATE (m)",
        "position (m)",
        "shape",
        "quality",
        "volume",
        "objects",
        "boxes",
        "factors",
        "cost",
        "iterations",
        "converged",
    ];
    let number = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.5}"));
    let table = report.table();
    let first = table.first().cloned();
    // the error of a row, with its change against the first row
    let error = |row: &VariantRow, of: fn(&VariantRow) -> Option<f64>| {
        let before = first.as_ref().filter(|first| first.variant != row.variant).and_then(of);
        let change = before.zip(of(row)).and_then(|(before, after)| relative(before, after));
        number(of(row)) + &change.map(|change| format!(" ({})", percent(change))).unwrap_or_default()
    };
    let row = |row: &VariantRow| {
        vec![
            row.variant.clone(),
            number(row.odometry_ate),
            error(row, |row| row.ate),
            error(row, |row| row.position),
            error(row, |row| row.shape),
            error(row, |row| row.quality),
            error(row, |row| row.volume),
            row.objects.to_string(),
            row.boxes.to_string(),
            row.semantic_factors.to_string(),
            format!("{:.3}", row.final_cost),
            row.iterations.to_string(),
            if row.converged { "yes" } else { "no" }.into(),
        ]
    };
    (words(header), table.iter().map(row).collect())
}

/// Adds the noise, if it was estimated.
pub(super) fn noise(page: &mut Page, report: &VariantReport) {
    let Some(noise) = report.variance_components.last() else { return };
    let rounds = report.variance_components.len();
    page.subheading("Noise").paragraph(&format!("As it was estimated, in {rounds} rounds."));
    let alone = |name: &str, sigma: f64| {
        [vec![name.to_owned(), format!("{sigma:.3e}")], vec![String::new(); 3]].concat()
    };
    let mut rows = vec![];
    if let Some(choice) = noise.odometry {
        let MotionComponent { rotation, translation, pivot } = choice.noise;
        rows.push(alone("odometry, rotation (rad)", rotation));
        rows.push(alone("odometry, translation (m)", translation));
        rows.push(alone("odometry, pivot (m)", pivot));
        let CrossValidationScore { cost, deviation } = choice.score;
        let kept = if choice.keeps_input() { ": kept as it came in" } else { "" };
        rows.push(alone(&format!("cost of boxes of other objects{kept}"), cost));
        rows.push(alone("its standard error", deviation));
    }
    rows.extend(noise.boxes.iter().map(|(name, c)| {
        let numbers =
            [c.sigma_px, 100.0 * c.of_size, c.correlation_time, c.effective_px].map(|x| format!("{x:.2}"));
        std::iter::once(format!("boxes: {name} (px)")).chain(numbers).collect()
    }));
    page.table(
        &words(["noise", "σ", "grows by (% of the size)", "correlation time", "σ in the graph"]),
        &rows,
    );
}

/// Adds the prediction of held-out boxes, by class.
pub(super) fn held_out(page: &mut Page, report: &VariantReport) {
    let Some(held_out) = &report.held_out else { return };
    let unmapped = held_out.unmapped;
    page.subheading("Boxes held out").paragraph(&format!(
        "Predicted by an estimate that did without them; {unmapped} more are of objects that are not in the map. Errors are standard \
         errors over objects."
    ));
    let number = |mean: ClusteredMean, digits: usize| {
        let error = mean.error.map(|error| format!(" ± {error:.digits$}")).unwrap_or_default();
        format!("{:.digits$}{error}", mean.mean)
    };
    let row = |name: &str, p: &Prediction| {
        let counts = [p.boxes, p.objects, p.out_of_view].map(|n| n.to_string());
        let [boxes, objects, lost] = counts;
        vec![name.to_owned(), boxes, objects, lost, number(p.iou, 3), number(p.pixels, 1)]
    };
    let mut rows = vec![row("all", &held_out.all)];
    rows.extend(held_out.classes.iter().map(|(class, prediction)| row(class, prediction)));
    page.table(&words(["class", "boxes", "objects", "out of view", "IoU", "error (px)"]), &rows);
}

/// Adds the variables from the run's document.
pub(super) fn own_variables(page: &mut Page, record: &VariantRecord) {
    if record.variables.is_empty() {
        return;
    }
    page.subheading("Variables of this run").paragraph("As documents write them, in the frame of the map.");
    let rows =
        record.variables.iter().map(|v| vec![v.key.clone(), v.initial.to_string(), v.estimate.to_string()]);
    page.table(&words(["variable", "before", "estimate"]), &rows.collect::<Vec<_>>());
}

/// Adds each object with its factors.
pub(super) fn objects(page: &mut Page, report: &VariantReport) {
    page.subheading("Objects").paragraph("What was applied to each, and why.");
    page.table(&words(OBJECTS), &report.objects.iter().map(object_row).collect::<Vec<_>>());
}

const OBJECTS: [&str; 9] = [
    "object",
    "class",
    "score",
    "detections",
    "boxes",
    "applied",
    "semi-axes (m)",
    "position error (m)",
    "not mapped because",
];

fn object_row(report: &ObjectReport) -> Vec<String> {
    let object = &report.object;
    let axes = |q: &manifactor_quadric::DualQuadric| {
        q.semi_axes.iter().map(|s| format!("{s:.3}")).collect::<Vec<_>>().join(" × ")
    };
    vec![
        object.key.to_string(),
        object.class.as_ref().map_or("-".into(), |class| class.name.clone()),
        object.class.as_ref().map_or("-".into(), |class| format!("{:.2}", class.score)),
        object.detections.to_string(),
        object.boxes.to_string(),
        applied(object),
        report.estimate.as_ref().map_or(String::new(), axes),
        report.error.as_ref().map_or(String::new(), |error| format!("{:.4}", error.position)),
        report.rejected_because.clone().unwrap_or_default(),
    ]
}

/// Lists the semantic factors with their reasons, then the candidates that were not applied with theirs.
fn applied(object: &MappedObject) -> String {
    let own = |key: &&Key| **key != object.key;
    let applied = object.semantic_factors.iter().map(|a| {
        let others: Vec<_> = a.keys.iter().filter(own).map(|key| format!(" with {key}")).collect();
        format!("{}{}: {}", a.factor, others.concat(), a.because)
    });
    let left_out = object.left_out.iter().map(|l| format!("not {}: {}", l.factor, l.because));
    applied.chain(left_out).collect::<Vec<_>>().join("; ")
}
