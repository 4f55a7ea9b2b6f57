//! The page of a solved graph: the graph in 3D, its costs by type of factor, and the factors with the largest costs.
use super::page::{PRINT, Page, VALUES};
use super::run_page::{WIDTH, version};
use super::viewer::{self, numbers};
use crate::canvas::{Ink, Theme};
use crate::graph::{GraphScene, is_outlier, weight};
use crate::run::cost;
use manifactor_graph::{Graph, Values};
use manifactor_solve::{Outcome, Solution};
use serde_json::{Value, json};
use std::collections::BTreeMap;

const MARKUP: &str = include_str!("assets/graph.html");
const SCRIPT: &str = include_str!("assets/graph.js");

/// Largest number of factors in the table of the largest costs.
const WORST: usize = 20;

/// The report of a solve in words.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveSummary {
    /// How the solve ended, with its costs.
    pub verdict: String,
    /// Warnings about the estimate.
    pub warnings: Vec<String>,
    /// The initial cost, and the cost after each accepted step.
    pub costs: Vec<f64>,
}

impl SolveSummary {
    /// Creates the summary of an outcome.
    pub fn new(outcome: &Outcome) -> Self {
        let steps = if outcome.iterations == 1 { "iteration" } else { "iterations" };
        let verdict = format!(
            "{}. Cost {:.6} to {:.6} in {} {steps}, {:.3} s.",
            sentence(&outcome.termination.to_string()),
            outcome.initial_cost,
            outcome.final_cost,
            outcome.iterations,
            outcome.times.total
        );
        let accepted = outcome.history.iter().filter(|step| step.accepted);
        let costs = std::iter::once(outcome.initial_cost).chain(accepted.filter_map(|step| step.trial_cost));
        Self { verdict, warnings: warnings(outcome), costs: costs.collect() }
    }
}

/// Returns the page of a graph that was solved from the values `start`.
pub fn graph_page(
    title: &str,
    graph: &Graph,
    start: &Values,
    solution: &Solution,
    summary: &SolveSummary,
) -> String {
    let scene = GraphScene::new(title, graph, start, solution);
    let mut page = Page::new(title);
    let (variables, factors) = (solution.values.len(), graph.factors().len());
    page.verdict(&format!("{variables} variables and {factors} factors. {}", summary.verdict));
    page.warnings(&summary.warnings);
    in_3d(&mut page, &scene);
    page.contents().heading("Costs by type of factor");
    let header = ["type", "factors", "cost", "share (%)", "weight below 0.5"];
    page.table(&header.map(str::to_owned), &by_type(graph, solution));
    if let Some(picture) = cost(&[("cost", &summary.costs)], WIDTH) {
        page.pictures(std::iter::once((&picture, "The cost after each accepted step.".to_owned())));
    }
    page.heading("Factors with the largest costs");
    page.paragraph("At the estimate. Residuals are in standard deviations of their noise.");
    let header = ["factor", "type", "variables", "cost", "weight", "residual"];
    page.table(&header.map(str::to_owned), &worst(graph, solution));
    page.own("", VALUES);
    page.own("", PRINT);
    page.paragraph(&version());
    page.html()
}

/// Raises the first letter.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn warnings(outcome: &Outcome) -> Vec<String> {
    let mut list = vec![];
    list.extend(outcome.undetermined.as_ref().map(ToString::to_string));
    list.extend(outcome.unconstrained.as_ref().map(ToString::to_string));
    list.extend(outcome.moving.as_ref().map(ToString::to_string));
    if outcome.inactive > 0 {
        let n = outcome.inactive;
        list.push(format!(
            "{n} of {} factors are undefined at the estimate and are left out",
            outcome.factors
        ));
    }
    if !outcome.rejected.is_empty() {
        let n = outcome.rejected.len();
        list.push(format!("{n} of {} factors are rejected as outliers", outcome.factors));
    }
    list.extend(outcome.active_bounds.iter().map(ToString::to_string));
    list
}

fn in_3d(page: &mut Page, scene: &GraphScene) {
    page.own("<div id=\"static-map\">", "");
    for picture in scene.pictures(1.6 * WIDTH) {
        page.picture(&picture, "Where the browser has WebGL 2, this is a view in 3D that can be turned.");
    }
    page.own("</div>", "");
    if let Some(text) = scene.left_out() {
        page.paragraph(&format!("Not drawn: {text}."));
    }
    page.data("graph-data", &data(scene));
    page.own(MARKUP, &viewer::VIEW.concat()).own("", SCRIPT);
}

/// The data for the script. Lengths are rounded to 1e-5 of the extent, below the visible resolution.
fn data(scene: &GraphScene) -> Value {
    let reach = scene.points().iter().map(|p| p.after.amax()).fold(0.0, f64::max);
    let digits = if reach > 0.0 { (5.0 - reach.log10().ceil()).clamp(0.0, 15.0) as i32 } else { 5 };
    let points = scene.points().iter().map(|point| {
        json!({
            "key": point.key.as_str(),
            "type": point.of_type,
            "before": numbers(point.before.iter(), digits),
            "after": numbers(point.after.iter(), digits),
            "fixed": point.is_fixed,
        })
    });
    let lines = scene.lines().iter().map(|line| {
        json!({
            "factor": line.factor,
            "name": line.name,
            "ends": line.ends,
            "cost": format!("{:.4e}", line.cost).parse::<f64>().unwrap_or(line.cost),
            "outlier": line.is_outlier,
        })
    });
    json!({
        "planar": scene.is_planar(),
        "named": scene.has_names(),
        "colors": { "before": Ink::Odometry.hex(Theme::Light), "after": Ink::Estimate.hex(Theme::Light) },
        "points": points.collect::<Vec<_>>(),
        "lines": lines.collect::<Vec<_>>(),
    })
}

/// Number, cost and outliers of each type of factor, largest cost first.
fn by_type(graph: &Graph, solution: &Solution) -> Vec<Vec<String>> {
    #[derive(Default)]
    struct Sum {
        factors: usize,
        cost: f64,
        outliers: usize,
    }
    let mut sums: BTreeMap<&str, Sum> = BTreeMap::new();
    for (i, (entry, state)) in graph.factors().iter().zip(&solution.factors).enumerate() {
        let sum = sums.entry(entry.factor.typetag_name()).or_default();
        sum.factors += 1;
        sum.cost += state.cost;
        sum.outliers += usize::from(is_outlier(solution, i));
    }
    let total: f64 = sums.values().map(|sum| sum.cost).sum();
    let mut rows: Vec<_> = sums.into_iter().collect();
    rows.sort_by(|a, b| b.1.cost.total_cmp(&a.1.cost));
    let row = |(name, sum): (&str, Sum)| {
        let share = if total > 0.0 { format!("{:.1}", 100.0 * sum.cost / total) } else { "-".to_owned() };
        let [factors, outliers] = [sum.factors, sum.outliers].map(|n| n.to_string());
        vec![name.to_owned(), factors, format!("{:.6}", sum.cost), share, outliers]
    };
    rows.into_iter().map(row).collect()
}

fn worst(graph: &Graph, solution: &Solution) -> Vec<Vec<String>> {
    let mut order: Vec<usize> = (0..solution.factors.len()).collect();
    let cost = |i: &usize| solution.factors.get(*i).map_or(0.0, |state| state.cost);
    order.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
    let row = |i: usize| {
        let (entry, state) = (graph.factors().get(i)?, solution.factors.get(i)?);
        let keys: Vec<&str> = entry.keys.iter().map(manifactor_graph::Key::as_str).collect();
        let name = entry.name.as_deref().unwrap_or_else(|| entry.factor.typetag_name());
        let residual: Vec<String> = state.whitened.iter().map(|x| format!("{x:.3}")).collect();
        Some(vec![
            i.to_string(),
            name.to_owned(),
            keys.join(", "),
            format!("{:.4}", state.cost),
            format!("{:.3}", weight(solution, i)),
            if state.defined { residual.join(" ") } else { "undefined".to_owned() },
        ])
    };
    order.into_iter().take(WORST).filter_map(row).collect()
}
