//! The command line.
use crate::commands::{
    Check, CheckFactor, Evaluate, Experiment, Explain, List, New, Run, Schema, ShowGraph, Simulate, Solve,
};
use crate::failure::Failure;
use crate::status::Status;
use crate::watch;
use clap::{ArgAction, Parser, Subcommand};
use manifactor::graph::catalogue::{all, check_names};
use manifactor::solve::{Bytes, memory_limit};

/// Nonlinear least squares on factor graphs, and object-level SLAM on top of it.
///
/// Exit codes: 0 done; 1 a solve ended without converging (its best values are written), or a factor breaks a law; 2 the command line or a
/// document is wrong; 3 a file could not be read or written; 130 interrupted (the best values so far are written).
#[derive(Debug, Parser)]
#[command(name = "manifactor", version, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to compute with; all processors by default. Results are the same for any number.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Say more on stderr: each step (-v), then all that is read, compiled and written (-vv).
    #[arg(long, short, global = true, action = ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(Run),
    Experiment(Experiment),
    Solve(Solve),
    Check(Check),
    CheckFactor(CheckFactor),
    List(List),
    Explain(Explain),
    Graph(ShowGraph),
    New(New),
    Evaluate(Evaluate),
    Simulate(Simulate),
    Schema(Schema),
}

impl Cli {
    /// Does what the command says.
    ///
    /// # Errors
    /// Whatever keeps the command from doing it.
    pub fn run(&self) -> Result<Status, Failure> {
        watch::log(self.verbose);
        // this thread is one of them: what it has in its caches stays there
        let pool = rayon::ThreadPoolBuilder::new().use_current_thread();
        let pool = pool.num_threads(self.threads.map_or(0, Into::into)).build_global();
        if self.threads.is_some() {
            pool.map_err(Failure::input)?;
        }
        check_limit()?;
        check_names(&all()).map_err(Failure::input)?;
        match &self.command {
            Command::Run(command) => command.run(self.verbose),
            Command::Experiment(command) => command.run(),
            Command::Solve(command) => command.run(self.verbose),
            Command::Check(command) => command.run(),
            Command::CheckFactor(command) => command.run(),
            Command::List(command) => command.run(),
            Command::Explain(command) => command.run(),
            Command::Graph(command) => command.run(),
            Command::New(command) => command.run(),
            Command::Evaluate(command) => command.run(),
            Command::Simulate(command) => command.run(),
            Command::Schema(command) => command.run(),
        }
    }

    /// Whether results are to be JSON.
    pub fn json(&self) -> bool {
        match &self.command {
            Command::Run(command) => command.json,
            Command::Experiment(command) => command.json,
            Command::Solve(command) => command.json,
            Command::Check(command) => command.json,
            Command::CheckFactor(command) => command.json,
            Command::List(command) => command.json,
            Command::Explain(command) => command.json,
            Command::Graph(command) => command.json,
            Command::Evaluate(command) => command.json,
            Command::New(_) | Command::Simulate(_) => false,
            Command::Schema(_) => true,
        }
    }
}

/// Refuses to begin where not even the program itself is sure to have room.
fn check_limit() -> Result<(), Failure> {
    /// For code, stacks and the buffers of two threads.
    const LEAST: u64 = 256 << 20;
    match memory_limit() {
        Some(limit) if limit < LEAST => Err(Failure::with_help(
            format!("the limit of memory is {}, and the program alone takes {}", Bytes(limit), Bytes(LEAST)),
            "allow more (ulimit -v)",
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
