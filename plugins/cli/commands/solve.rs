//! `manifactor solve`: solves a graph from a file.
use crate::failure::Failure;
use crate::input::destination::Destination;
use crate::input::graph_file::{self, GraphFile};
use crate::input::solver::SolverArguments;
use crate::input::what_if::WhatIf;
use crate::interrupt;
use crate::output::text::seconds;
use crate::output::watch::Watch;
use crate::output::{self, report};
use crate::status::Status;
use clap::Args;
use manifactor::formats::whole::write_whole;
use manifactor::geometry::certify;
use manifactor::solve::{AllObservers, Solution, solve};
use manifactor::viz::{SolveSummary, graph_page};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// Solve a graph: a literal graph (.toml, .json, .yaml), a pose graph (.g2o, TORO) or bundle adjustment (.bal, or the
/// folder of a COLMAP model).
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  manifactor solve examples/03_relations/graph.toml --covariances\n  manifactor solve examples/python/helix.g2o --report helix.html"
)]
pub(crate) struct Solve {
    /// The graph.
    graph: PathBuf,
    #[command(flatten)]
    solver: SolverArguments,
    #[command(flatten)]
    reading: graph_file::Reading,
    #[command(flatten)]
    what_if: WhatIf,
    /// Try to prove that the minimum of a pose graph is the global one.
    #[arg(long)]
    certify: bool,
    /// Marginal covariances at the estimate, of all variables or of these (separated by commas): standard
    /// deviations in a table, matrices with --json.
    #[arg(long, value_name = "KEYS", num_args = 0.., require_equals = true, value_delimiter = ',', default_missing_value = "")]
    covariances: Option<Vec<String>>,
    #[command(flatten)]
    destination: Destination,
    /// Write a page with the graph in 3D, before and after the solve, and the factors with the largest costs.
    #[arg(long, value_name = "FILE", group = "written")]
    report: Option<PathBuf>,
    /// Print JSON: costs, iterations, termination, seconds by stage and the estimate; with -v a record for each step.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Solve {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        self.destination.check(&self.graph)?;
        if let Some(page) = &self.report {
            self.destination.check_other(page, &self.graph)?;
        }
        let mut input = self.reading.open(&self.graph, &self.solver)?;
        input.notes.extend(self.what_if.apply(&mut input.graph, &input.values)?);
        for note in &input.notes {
            output::print_note(note);
        }
        let mut watch = Watch::new(verbose, "solving");
        let mut interrupt = interrupt::on_ctrl_c();
        let mut observer = AllObservers(vec![&mut watch, &mut interrupt]);
        let clock = Instant::now();
        let values = input.start.initial_values(&input.graph, &input.values).map_err(Failure::input)?;
        let start = clock.elapsed().as_secs_f64();
        let solution = solve(&input.graph, &values, &*input.optimizer, &mut observer);
        let solution = solution.map_err(Failure::input)?;
        drop(watch);
        self.destination.write(&input.graph, &solution.values, &self.graph)?;
        if let Some(page) = &self.report {
            let title = graph_file::title(&self.graph);
            let summary = SolveSummary::new(&solution.outcome);
            let html = graph_page(&title, &input.graph, &values, &solution, &summary);
            write_whole(page, html.as_bytes()).map_err(Failure::at(page))?;
        }
        let certificate = self.certify.then(|| certify(&input.graph, &solution.values));
        let certificate = certificate.transpose().map_err(Failure::input)?;
        let diagnosis = solution.diagnose(&input.graph).map_err(Failure::input)?;
        let marginals = self.covariances.as_ref().map(|keys| {
            let keys: Vec<&str> = keys.iter().map(String::as_str).filter(|key| !key.is_empty()).collect();
            solution.marginals(&input.graph, &keys)
        });
        let marginals = marginals.transpose().map_err(Failure::input)?;
        if self.json {
            let mut json = self.as_json(&input, &solution, start);
            // a solve without a step does not compute it
            if json["undetermined"].is_null() {
                json["undetermined"] = json!(diagnosis.undetermined);
            }
            json["diagnosis"] = json!(diagnosis);
            if let Some(marginals) = marginals {
                json["covariances"] = json!(marginals);
            }
            if verbose > 0 {
                json["history"] = json!(solution.outcome.history);
            }
            if let Some(certificate) = certificate {
                json["certificate"] = json!(certificate);
            }
            output::print_json(&json);
        } else {
            let name = input.start.typetag_name();
            let start = format!("start {name} in {}\n", seconds(start));
            let certificate = certificate.map_or_else(String::new, |c| format!("{c}\n"));
            let outcome = report::outcome(&solution.outcome, verbose > 0)
                + &report::diagnosis(&diagnosis, &solution.outcome, verbose > 0);
            let estimate = report::estimate(&solution.values, marginals.as_deref());
            output::print(&(graph_file::summary(&input) + &start + &outcome + &certificate + &estimate));
        }
        Ok(Status::from(&solution.outcome.termination))
    }

    fn as_json(&self, input: &GraphFile, solution: &Solution, start: f64) -> Value {
        let outcome = &solution.outcome;
        json!({
            "graph": self.graph.display().to_string(),
            "variables": input.values.len(),
            "factors": outcome.factors,
            "start": { "type": input.start.typetag_name(), "seconds": start },
            "initial_cost": outcome.initial_cost,
            "final_cost": outcome.final_cost,
            "iterations": outcome.iterations,
            "termination": outcome.termination,
            "undetermined": outcome.undetermined,
            "moving": outcome.moving,
            "active_bounds": outcome.active_bounds,
            "constraints": outcome.constraints,
            "untouched": outcome.unconstrained,
            "inactive": outcome.inactive,
            "inactive_factors": outcome.inactive_factors,
            "rejected": outcome.rejected,
            "seconds": outcome.times,
            "notes": input.notes,
            "values": solution.values,
        })
    }
}
