//! `manifactor graph`: the contents of a graph and the cost of each factor.
use crate::failure::Failure;
use crate::input::graph_file::Reading;
use crate::input::solver::SolverArguments;
use crate::input::what_if::WhatIf;
use crate::inspection::{Inspection, states};
use crate::output;
use crate::status::Status;
use clap::{ArgGroup, Args, ValueEnum};
use manifactor::solve::{Silent, solve};
use std::path::PathBuf;

/// Show the factors of a graph by key, with residual, cost and weight, before and after a solve.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("form").args(["dot", "json"]))]
#[command(
    after_help = "Example:\n  manifactor graph examples/03_relations/graph.toml --solve --sort cost --top 5"
)]
pub(crate) struct ShowGraph {
    /// A graph, or the folder of a run's variant, which holds graph.json.
    graph: PathBuf,
    /// Solve the graph and show the result too.
    #[arg(long)]
    solve: bool,
    #[command(flatten)]
    what_if: WhatIf,
    #[command(flatten)]
    solver: SolverArguments,
    #[command(flatten)]
    reading: Reading,
    /// Order of the factors. Default: the order in the graph.
    #[arg(long, value_enum, conflicts_with = "dot")]
    sort: Option<Order>,
    /// List only the first N factors.
    #[arg(long, value_name = "N", conflicts_with = "dot")]
    top: Option<usize>,
    /// Print a Graphviz file.
    #[arg(long)]
    dot: bool,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// An order of factors.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Order {
    /// Largest cost first, after the solve if there is one.
    Cost,
}

impl ShowGraph {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let in_folder = self.graph.join("graph.json");
        let path = if in_folder.is_file() { in_folder } else { self.graph.clone() };
        let mut input = self.reading.open(&path, &self.solver)?;
        input.notes.extend(self.what_if.apply(&mut input.graph, &input.values)?);
        for note in &input.notes {
            output::print_note(note);
        }
        let mut status = Status::Done;
        let mut after = None;
        let start = input.start.initial_values(&input.graph, &input.values).map_err(Failure::input)?;
        let solution;
        if self.solve {
            solution = solve(&input.graph, &start, &*input.optimizer, &mut Silent).map_err(Failure::input)?;
            status = Status::from(&solution.outcome.termination);
            let problem = solution.problem(&input.graph).map_err(Failure::input)?;
            after = Some((&solution.values, states(&problem, &input.graph)));
        }
        let mut inspection = Inspection::new(&input.graph, &start, after)?;
        if let Some(Order::Cost) = self.sort {
            inspection.sort_by_cost();
        }
        inspection.factors.truncate(self.top.unwrap_or(usize::MAX));
        if self.json {
            output::print_json(&inspection);
        } else if self.dot {
            output::print(&inspection.dot());
        } else {
            output::print(&inspection.table());
        }
        Ok(status)
    }
}
