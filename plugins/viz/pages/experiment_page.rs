//! The page of an experiment: means, comparisons, distributions, curves, and every trial.
use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Distribution, Intervals, Mean, Picture, figure};
use crate::pages::page::{PRINT, Page, VALUES};
use crate::pages::run_page::{WIDTH, version};
use manifactor_formats::table::{DataColumn, DataTable};
use manifactor_slam::experiment::{Experiment, ExperimentSummary};

/// Draws the pictures of an experiment. Each metric has a picture of its differences from the baseline, if
/// there is one. It also has curves over the column that the summary names, or
/// distributions. Unit of `width`: pixels.
pub fn experiment_pictures(
    experiment: &Experiment,
    summary: &ExperimentSummary,
    trials: &DataTable,
    width: f64,
) -> Vec<Picture> {
    let picture = |metric: &String| match &experiment.summary.curve {
        Some(x) => {
            let text = format!("{metric} over {x}");
            let curves = curves(summary, x, metric);
            let log_x = curves.iter().flat_map(|curve| &curve.points).all(|(x, _)| *x > 0.0);
            let panel = Chart { y: metric.clone(), curves, ..Chart::default() };
            let sheet = figure(&text, x, log_x, &[panel], width, 0.55 * width)?;
            Some(Picture::new(&format!("{metric}_over_{x}"), text, sheet))
        }
        None => {
            let sheet = distribution(summary, trials, metric).sheet(width)?;
            Some(Picture::new(metric, format!("how {metric} is distributed over trials"), sheet))
        }
    };
    let differences = summary.metrics.iter().filter_map(|metric| differences(summary, metric, width));
    differences.chain(summary.metrics.iter().filter_map(picture)).collect()
}

/// Draws the mean differences of a metric from the baseline, with their confidence intervals.
fn differences(summary: &ExperimentSummary, metric: &str, width: f64) -> Option<Picture> {
    let mean = |group: &manifactor_slam::experiment::TrialGroup| {
        let comparison = group.comparisons.get(metric)?;
        let percent = 100.0 / comparison.baseline.abs();
        let difference = comparison.difference;
        let interval = difference.low.zip(difference.high);
        Some(Mean {
            name: group.labels.join(", "),
            mean: percent * difference.mean,
            interval: interval.map(|(low, high)| [percent * low, percent * high]),
        })
    };
    let intervals = Intervals {
        title: format!("{metric}: difference from the baseline"),
        x: "difference (% of the baseline)".to_owned(),
        are_differences: true,
        means: summary.groups.iter().filter_map(mean).collect(),
    };
    let text = format!("{metric}: mean differences from the baseline with 95 % intervals");
    Some(Picture::new(&format!("{metric}_differences"), text, intervals.sheet(width)?))
}

/// Largest number of trials in the page.
const TRIALS: usize = 1000;

/// Returns the page of an experiment. `trials` is the table of trials, `config` the text of the document.
pub fn experiment_page(
    experiment: &Experiment,
    summary: &ExperimentSummary,
    trials: &DataTable,
    config: &str,
) -> String {
    let mut page = Page::new(&experiment.title);
    let done = experiment.trials.len() - summary.open;
    page.paragraph(&format!("{done} of {} trials. {}", experiment.trials.len(), version()));
    page.contents();
    page.heading("Summary");
    page.cards(&summary.header(), &summary.rows().collect::<Vec<_>>());
    page.paragraph(
        "Means over trials. In brackets: the mean difference from the baseline over pairs of trials, as a share of the mean of the \
         baseline, with the 95 % interval of a bootstrap.",
    );
    let pictures = experiment_pictures(experiment, summary, trials, WIDTH);
    let (differences, others): (Vec<&Picture>, Vec<&Picture>) =
        pictures.iter().partition(|picture| picture.name.ends_with("_differences"));
    if !differences.is_empty() {
        page.heading("Differences");
        let caption = "Differences from the baseline. Grey: the interval contains zero, so these trials do not show a difference.";
        page.pictures(differences.into_iter().map(|picture| (picture, caption.to_owned())));
    }
    let caption = match &experiment.summary.curve {
        Some(x) => {
            page.heading(&format!("Over {x}"));
            "Means over trials."
        }
        None => {
            page.heading("Distributions");
            "Over trials: boxes span the quartiles, and whiskers end at the last value within one and a half times that span. A group \
             of at most five trials has a dot for each."
        }
    };
    page.pictures(others.into_iter().map(|picture| (picture, caption.to_owned())));
    page.heading("Trials");
    let rows = trials.rows().unwrap_or_default();
    if rows > TRIALS {
        page.paragraph(&format!("The first {TRIALS} of {rows}; trials.csv has all."));
    }
    let header: Vec<String> = trials.columns.iter().map(|(name, _)| name.clone()).collect();
    let cell = |column: &DataColumn, row| match column {
        DataColumn::Text(cells) => cells.get(row).cloned().unwrap_or_default(),
        DataColumn::Number(cells) => cells.get(row).copied().flatten().map_or(String::new(), short),
    };
    let row = |row| trials.columns.iter().map(|(_, column)| cell(column, row)).collect();
    page.table(&header, &(0..rows.min(TRIALS)).map(row).collect::<Vec<Vec<String>>>());
    page.heading("Config");
    page.folded("The experiment", config);
    page.own("", VALUES);
    page.own("", PRINT);
    page.html()
}

fn short(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e9 { x.to_string() } else { format!("{x:.5}") }
}

/// Returns the values of a metric by group of the summary.
fn distribution(summary: &ExperimentSummary, trials: &DataTable, metric: &str) -> Distribution {
    let column = |name: &str| trials.columns.iter().find(|(own, _)| own == name).map(|(_, column)| column);
    let texts = |name: &String| match column(name) {
        Some(DataColumn::Text(cells)) => cells.as_slice(),
        _ => &[],
    };
    let values = match column(metric) {
        Some(DataColumn::Number(cells)) => cells.as_slice(),
        _ => &[],
    };
    let labels: Vec<&[String]> = summary.columns.iter().map(texts).collect();
    let group = |group: &manifactor_slam::experiment::TrialGroup| {
        let belongs =
            |row: usize| labels.iter().zip(&group.labels).all(|(cells, label)| cells.get(row) == Some(label));
        let own = values.iter().enumerate().filter(|(row, _)| belongs(*row)).filter_map(|(_, value)| *value);
        (group.labels.join(", "), own.collect())
    };
    Distribution {
        title: metric.to_owned(),
        x: metric.to_owned(),
        groups: summary.groups.iter().map(group).collect(),
    }
}

/// Returns the means of a metric over a numeric column: one curve for each combination of the remaining
/// columns.
fn curves(summary: &ExperimentSummary, x: &str, metric: &str) -> Vec<Curve> {
    let place = summary.columns.iter().position(|column| column == x);
    let mut curves: Vec<Curve> = vec![];
    for group in &summary.groups {
        let number = place.and_then(|place| group.labels.get(place)?.parse().ok());
        let (Some(number), Some(mean)) = (number, group.means.get(metric)) else { continue };
        let others = group.labels.iter().enumerate().filter(|(i, _)| Some(*i) != place);
        let name = others.map(|(_, label)| label.as_str()).collect::<Vec<_>>().join(", ");
        match curves.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => curve.points.push((number, mean.mean)),
            None => {
                let ink = Ink::Series(curves.len());
                curves.push(Curve::new(&name, ink, vec![(number, mean.mean)]).with_dots());
            }
        }
    }
    curves.iter_mut().for_each(|curve| curve.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    curves
}
