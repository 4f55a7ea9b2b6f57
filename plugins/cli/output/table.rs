//! The table that a run prints.
use crate::output::text::{self, Table, on_one_line, seconds};
use manifactor::slam::mapping::object_key;
use manifactor::slam::report::{ClusteredMean, Prediction, RunReport, TrajectoryReport, VariantReport};
use manifactor::slam::sequence::ObjectId;
use manifactor::slam::variance::{BoxComponent, CrossValidationScore, MotionComponent};

/// The result of a run, as a table and a few lines. `details` adds the estimated noise, and the condition
/// number and the factor with the largest cost of each variant.
pub(crate) fn of_run(report: &RunReport, details: bool) -> String {
    let header = [
        "",
        "ATE (m)",
        "position (m)",
        "shape",
        "quality",
        "volume",
        "objects",
        "boxes",
        "cost",
        "iterations",
        "time",
    ];
    let mut table = Table::of_numbers(&header).with_priority(&PRIORITY);
    if let Some(first) = report.variants.first() {
        table.row(before(first));
    }
    for variant in &report.variants {
        table.row(after(variant));
    }
    let mut out = format!("{}\n{}\n", on_one_line(&report.title), table.text());
    if let Some(alignment) = report.variants.iter().find_map(|v| v.row().alignment) {
        let line = format!(
            "ATE: RMSE of the camera positions, aligned by {alignment}, over {}.",
            poses_covered(&report.variants)
        );
        out += &(text::wrap(&line) + "\n");
    }
    if report.variants.iter().any(|v| v.landmarks.is_some()) {
        out += &(text::wrap(LANDMARKS) + "\n");
    }
    for variant in &report.variants {
        if let Some(about) = &variant.about {
            let about = format!("{}: {}", on_one_line(&variant.name), on_one_line(about));
            out += &(text::wrap(&about) + "\n");
        }
    }
    if report.variants.iter().any(|v| !v.row().converged) {
        out += "!: the solve did not converge; see the warning below.\n";
    }
    for variant in &report.variants {
        out += &association(variant);
        out += &if details { noise(variant) } else { String::new() };
        out += &held_out(variant);
        out += &prior_map(variant);
        out += &removed(variant);
        out += &stream(variant);
        out += &rejected(variant);
        out += &if details { diagnosis(variant) } else { String::new() };
    }
    for variant in &report.variants {
        for warning in &variant.warnings {
            let (name, warning) = (on_one_line(&variant.name), warning.to_string());
            out += &(text::wrap(&format!("warning: {name}: {}", on_one_line(&warning))) + "\n");
        }
    }
    out
}

/// The poses covered by the trajectory errors: once if all variants agree, else by variant.
fn poses_covered(variants: &[VariantReport]) -> String {
    let covered = |v: &VariantReport| Some((on_one_line(&v.name).into_owned(), over(v.trajectory.first()?)));
    let covered: Vec<(String, String)> = variants.iter().filter_map(covered).collect();
    match covered.first() {
        Some((_, first)) if covered.iter().all(|(_, other)| other == first) => first.clone(),
        _ => covered.iter().map(|(name, over)| format!("{over} in {name}")).collect::<Vec<_>>().join(", "),
    }
}

/// The poses covered by one trajectory error.
fn over(trajectory: &TrajectoryReport) -> String {
    let [covered, poses] = trajectory.covered;
    format!("{covered} of {} (truth: {})", text::count(poses, "pose"), trajectory.truth_poses)
}

/// Explanation of the columns about objects.
const LANDMARKS: &str = "Errors of the objects against the truth. Position: RMSE of the centres. Shape: mean Jaccard distance of \
                         their bounding boxes with equal centres (0: equal, 1: no overlap). Quality: the same with the estimated \
                         centres. Volume: the same for oriented boxes.";

/// Columns that a narrow terminal shows first.
const PRIORITY: [&str; 8] =
    ["ATE (m)", "position (m)", "shape", "quality", "volume", "cost", "iterations", "objects"];

/// For a run frame by frame: the latencies, and the map after the last frame.
fn stream(variant: &VariantReport) -> String {
    let Some(online) = &variant.online else { return String::new() };
    let name = on_one_line(&variant.name);
    let [p50, p99, max] = [online.latencies.p50, online.latencies.p99, online.latencies.max].map(seconds);
    let mut text = format!(
        "{name}: {} processed as they arrived, latency p50 {p50}, p99 {p99}, max {max}; {} added, {} removed; cost {:.3} after \
         the last frame",
        text::count(online.seconds.len(), "frame"),
        text::count(online.initialized, "object"),
        online.removed,
        online.cost
    );
    if let Some(trajectory) = online.trajectory.first() {
        let ate = metres(trajectory.estimate.ate.rmse);
        text += &format!(", ATE of the poses at the time of their frames {ate} m over {}", over(trajectory));
    }
    if online.refusals > 0 {
        text += &format!(", {} rejected", text::count(online.refusals, "frame or change"));
    }
    text::wrap(&text) + "\n"
}

/// The quality of the data association, as far as it is known.
fn association(variant: &VariantReport) -> String {
    let Some(association) = &variant.association else { return String::new() };
    let merged = text::count(association.merged, "object");
    let mut line = format!(
        "{}: data association by {}, {merged} merged, {} reassigned",
        on_one_line(&variant.name),
        association.by,
        text::count(association.moved, "box")
    );
    if let (Some(then), Some(end)) = (&association.at_the_time, &association.in_the_end) {
        line += &format!(
            "; pairwise F1 {:.3} at arrival, {:.3} at the end (precision {:.3}, recall {:.3}); {} with 3 boxes or more, {} true objects",
            then.f1,
            end.f1,
            end.precision,
            end.recall,
            text::count(end.objects, "object"),
            end.true_objects
        );
    }
    text::wrap(&line) + "\n"
}

/// The estimated noise, and the reason if the odometry was kept.
fn noise(variant: &VariantReport) -> String {
    let Some(found) = variant.variance_components.last() else { return String::new() };
    let mut parts = vec![];
    if let Some(choice) = &found.odometry {
        let CrossValidationScore { cost, deviation } = choice.score;
        let MotionComponent { rotation, translation, pivot } = choice.noise;
        let about = if pivot > 0.0 { format!(" about {pivot:.2} m ahead") } else { String::new() };
        parts.push(if choice.keeps_input() {
            format!("odometry noise kept: the best change alters the cross-validated cost of boxes by {cost:+.1} ± {deviation:.1}")
        } else {
            format!(
                "odometry σ {rotation:.1e} rad, {translation:.1e} m{about}: cross-validated cost of boxes {cost:+.1} ± {deviation:.1}"
            )
        });
    }
    parts.extend(found.boxes.iter().map(|(name, boxes)| {
        let BoxComponent { sigma_px, of_size, correlation_time, .. } = boxes;
        let grows = if *of_size > 0.0 {
            format!(" plus {:.1} % of the size", 100.0 * of_size)
        } else {
            String::new()
        };
        format!(
            "boxes ({name}) σ {sigma_px:.1} px{grows}, {correlation_time:.1} consecutive boxes count as one"
        )
    }));
    text::wrap(&format!("{}: {}", on_one_line(&variant.name), parts.join("; "))) + "\n"
}

/// The prediction of held-out boxes.
fn held_out(variant: &VariantReport) -> String {
    let Some(held_out) = &variant.held_out else { return String::new() };
    let Prediction { boxes, objects, out_of_view, iou, pixels } = held_out.all;
    let of = |mean: ClusteredMean, digits: usize| {
        let error = mean.error.map(|error| format!(" ± {error:.digits$}")).unwrap_or_default();
        format!("{:.digits$}{error}", mean.mean)
    };
    let line = format!(
        "{}: {} held-out boxes of {}: IoU {}, error {} px; {out_of_view} predicted out of view; IoU {} with {} of objects not in the map, which count as 0",
        on_one_line(&variant.name),
        boxes,
        text::count(objects, "object"),
        of(iou, 3),
        of(pixels, 1),
        of(held_out.iou_unmapped_as_zero, 3),
        text::count(held_out.unmapped, "box"),
    );
    text::wrap(&line) + "\n"
}

fn keys(objects: &[ObjectId]) -> String {
    objects.iter().map(|id| object_key(*id).to_string()).collect::<Vec<_>>().join(", ")
}

/// Objects that the run itself added and later found removed.
fn removed(variant: &VariantReport) -> String {
    let of_prior = variant.prior_map.as_ref().map_or(&[][..], |prior| &prior.gone);
    let own: Vec<ObjectId> = variant.gone.iter().copied().filter(|id| !of_prior.contains(id)).collect();
    if own.is_empty() {
        return String::new();
    }
    text::wrap(&format!("{}: removed objects: {}", on_one_line(&variant.name), keys(&own))) + "\n"
}

/// Objects of the prior map: seen again, removed, and newly added.
fn prior_map(variant: &VariantReport) -> String {
    let Some(prior) = variant.prior_map.as_ref().filter(|prior| prior.is_located) else {
        return String::new();
    };
    let found = prior.found.as_ref().map(|found| {
        let matches = text::count(found.located.matches.len(), "object");
        format!(" relocalized after {} by {matches},", text::count(found.frame + 1, "frame"))
    });
    let gone = match prior.gone.as_slice() {
        [] => "none removed".to_owned(),
        gone => format!("removed: {}", keys(gone)),
    };
    let line = format!(
        "{}: prior map {},{} {} of {} detected again, {gone}, {} added",
        on_one_line(&variant.name),
        prior.file.display(),
        found.unwrap_or_default(),
        prior.seen.len(),
        text::count(prior.objects, "object"),
        prior.added.len()
    );
    text::wrap(&line) + "\n"
}

/// The number of factors that were rejected as outliers.
fn rejected(variant: &VariantReport) -> String {
    if variant.solve.rejected.is_empty() {
        return String::new();
    }
    let factors = text::count(variant.solve.rejected.len(), "factor");
    text::wrap(&format!("{}: {factors} rejected as outliers", on_one_line(&variant.name))) + "\n"
}

/// The condition number and the factor with the largest cost. The report has the ten largest.
fn diagnosis(variant: &VariantReport) -> String {
    let Some(diagnosis) = &variant.solve.diagnosis else { return String::new() };
    let name = on_one_line(&variant.name);
    let mut line = match diagnosis.condition {
        Some(condition) => format!("{name}: condition number {condition:.1e}"),
        None => format!("{name}: condition number infinite or unknown"),
    };
    if let Some(worst) = diagnosis.worst.first() {
        let (name, keys) = (&worst.name, text::keys(&worst.keys));
        line += &format!("; largest cost {:.3}, of factor {} {name} ({keys})", worst.cost, worst.factor);
    }
    text::wrap(&line) + "\n"
}

/// The row of the input: odometry, and objects as they were initialized.
fn before(variant: &VariantReport) -> Vec<String> {
    let landmarks = variant.landmarks.as_ref().map(|l| &l.initial);
    let cells = [
        variant.row().odometry_ate.map(metres),
        landmarks.map(|l| metres(l.rmse.position)),
        landmarks.map(|l| fraction(l.mean.shape)),
        landmarks.map(|l| fraction(l.mean.quality)),
        landmarks.map(|l| fraction(l.mean.volume)),
        Some(variant.counts.objects.to_string()),
        Some(variant.counts.boxes.to_string()),
        None,
        None,
        None,
    ];
    named("before the solve", cells)
}

fn after(variant: &VariantReport) -> Vec<String> {
    let row = variant.row();
    let cells = [
        row.ate.map(metres),
        row.position.map(metres),
        row.shape.map(fraction),
        row.quality.map(fraction),
        row.volume.map(fraction),
        Some(row.objects.to_string()),
        Some(row.boxes.to_string()),
        Some(format!("{:.2}", row.final_cost)),
        Some(format!("{}{}", row.iterations, if row.converged { "" } else { "!" })),
        Some(seconds(row.seconds)),
    ];
    named(&row.variant, cells)
}

fn named(name: &str, cells: [Option<String>; 10]) -> Vec<String> {
    let cells = cells.into_iter().map(|cell| cell.unwrap_or_else(|| "-".into()));
    std::iter::once(name.to_owned()).chain(cells).collect()
}

fn metres(x: f64) -> String {
    format!("{x:.5}")
}

fn fraction(x: f64) -> String {
    format!("{x:.4}")
}
