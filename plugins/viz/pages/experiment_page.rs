//! The page of an experiment: means, comparisons, distributions, curves, and every trial.
use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Distribution, Picture, figure};
use crate::pages::page::Page;
use crate::pages::run_page::{WIDTH, version};
use manifactor_formats::table::{Column, Table};
use manifactor_slam::experiment::{Experiment, ExperimentSummary};

/// Draws one picture for each metric of an experiment: curves over the column that the summary names, or
/// distributions. Unit of `width`: pixels.
pub fn experiment_pictures(
    experiment: &Experiment,
    summary: &ExperimentSummary,
    trials: &Table,
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
    summary.metrics.iter().filter_map(picture).collect()
}

/// Largest number of trials in the page.
const TRIALS: usize = 1000;

/// Returns the page of an experiment. `trials` is the table of trials, `config` the text of the document.
pub fn experiment_page(
    experiment: &Experiment,
    summary: &ExperimentSummary,
    trials: &Table,
    config: &str,
) -> String {
    let mut page = Page::new(&experiment.title);
    let done = experiment.trials.len() - summary.open;
    page.paragraph(&format!("{done} of {} trials. {}", experiment.trials.len(), version()));
    page.heading("Summary");
    page.table(&summary.header(), &summary.rows().collect::<Vec<_>>());
    page.paragraph(
        "Means over trials; in brackets the difference from the baseline over pairs of trials, with the bootstrap's 95 % \
         interval, as a share of the baseline's mean.",
    );
    match &experiment.summary.curve {
        Some(x) => page.heading(&format!("Over {x}")),
        None => page.heading("Distributions"),
    };
    let caption = match &experiment.summary.curve {
        Some(_) => "Means over trials.",
        None => {
            "Over trials: boxes reach from quartile to quartile, whiskers to the last value within one and a half times that."
        }
    };
    let pictures = experiment_pictures(experiment, summary, trials, WIDTH);
    page.pictures(pictures.iter().map(|picture| (picture, caption.to_owned())));
    page.heading("Trials");
    let rows = trials.rows().unwrap_or_default();
    if rows > TRIALS {
        page.paragraph(&format!("The first {TRIALS} of {rows}; trials.csv has all."));
    }
    let header: Vec<String> = trials.columns.iter().map(|(name, _)| name.clone()).collect();
    let cell = |column: &Column, row| match column {
        Column::Text(cells) => cells.get(row).cloned().unwrap_or_default(),
        Column::Number(cells) => cells.get(row).copied().flatten().map_or(String::new(), short),
    };
    let row = |row| trials.columns.iter().map(|(_, column)| cell(column, row)).collect();
    page.table(&header, &(0..rows.min(TRIALS)).map(row).collect::<Vec<Vec<String>>>());
    page.heading("Config");
    page.folded("The experiment", config);
    page.html()
}

fn short(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e9 { x.to_string() } else { format!("{x:.5}") }
}

/// Returns the values of a metric by group of the summary.
fn distribution(summary: &ExperimentSummary, trials: &Table, metric: &str) -> Distribution {
    let column = |name: &str| trials.columns.iter().find(|(own, _)| own == name).map(|(_, column)| column);
    let texts = |name: &String| match column(name) {
        Some(Column::Text(cells)) => cells.as_slice(),
        _ => &[],
    };
    let values = match column(metric) {
        Some(Column::Number(cells)) => cells.as_slice(),
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
