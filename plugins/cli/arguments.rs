//! The command line.
use crate::commands::{
    Check, CheckFactor, CheckManifold, Completions, Doctor, Evaluate, Experiment, Explain, Inspect, Learn,
    List, Man, New, Online, Plot, Replay, Run, Schema, ShowGraph, Simulate, Solve, Vio,
};
use crate::failure::Failure;
use crate::output::text::count;
use crate::output::watch;
use crate::status::Status;
use clap::{ArgAction, CommandFactory, Parser, Subcommand};
use manifactor::graph::catalogue::{all, check_names};
use manifactor::solve::{Bytes, memory_limit};
use std::num::NonZero;

/// Nonlinear least squares on factor graphs, and object-level SLAM on top of it.
///
/// Exit codes: 0 success; 1 a solve did not converge (its best values are written), objects were detected
/// but none is in the map, or a factor or a type of variables breaks a law; 2 the command line or a
/// document is invalid; 3 a file is missing, or a file or standard output could not be read or written; 130
/// interrupted (the best values so far are written).
#[derive(Debug, Parser)]
#[command(name = "manifactor", version, max_term_width = 80, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Number of threads, 1 to 1024. Default: RAYON_NUM_THREADS if it is set, else the number of
    /// processors. The results do not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)))]
    threads: Option<u16>,
    /// Print more on stderr: each step (-v), or everything that is read, compiled and written (-vv).
    #[arg(long, short, global = true, action = ArgAction::Count)]
    verbose: u8,
}

const EXAMPLES: &str = "\
Examples:
  manifactor run examples/desk/desk.toml --out out/desk
  manifactor solve examples/03_relations/graph.toml
  manifactor help solve";

#[derive(Debug, Subcommand)]
enum Command {
    #[command(visible_alias = "map")]
    Run(Run),
    Online(Online),
    Plot(Plot),
    Experiment(Experiment),
    Solve(Solve),
    Replay(Replay),
    Vio(Vio),
    Doctor(Doctor),
    Check(Check),
    CheckFactor(CheckFactor),
    CheckManifold(CheckManifold),
    List(List),
    Explain(Explain),
    Graph(ShowGraph),
    New(New),
    Evaluate(Evaluate),
    Learn(Learn),
    Simulate(Simulate),
    Inspect(Inspect),
    Schema(Schema),
    Completions(Completions),
    Man(Man),
}

impl Cli {
    /// Runs the command.
    ///
    /// # Errors
    /// If the command fails, for any reason.
    pub fn run(&self) -> Result<Status, Failure> {
        watch::log(self.verbose);
        // the calling thread belongs to the pool, so its warm caches are used
        let pool = rayon::ThreadPoolBuilder::new().use_current_thread();
        let threads = self.threads()?;
        let pool = pool.num_threads(threads).build_global();
        if self.threads.is_some() {
            pool.map_err(Failure::input)?;
        }
        check_limit(memory_limit(), self.least_memory(threads), threads)?;
        check_names(&all()).map_err(Failure::input)?;
        match &self.command {
            Command::Run(command) => command.run(self.verbose),
            Command::Online(command) => command.run(self.verbose),
            Command::Plot(command) => command.run(self.verbose),
            Command::Experiment(command) => command.run(),
            Command::Solve(command) => command.run(self.verbose),
            Command::Replay(command) => command.run(),
            Command::Vio(command) => command.run(self.verbose),
            Command::Doctor(command) => command.run(),
            Command::Check(command) => command.run(),
            Command::CheckFactor(command) => command.run(),
            Command::CheckManifold(command) => command.run(),
            Command::List(command) => command.run(),
            Command::Explain(command) => command.run(&Self::command()),
            Command::Graph(command) => command.run(),
            Command::New(command) => command.run(),
            Command::Evaluate(command) => command.run(),
            Command::Learn(command) => command.run(),
            Command::Simulate(command) => command.run(),
            Command::Inspect(command) => command.run(),
            Command::Schema(command) => command.run(),
            Command::Completions(command) => Ok(command.run(Self::command())),
            Command::Man(command) => command.run(Self::command()),
        }
    }

    /// Smallest memory limit at which a command that runs out of memory fails with an error and not in the
    /// allocator. Measured with 1 to 8 threads: every thread reserves address space for its allocator, and
    /// the trials of an experiment reserve more.
    fn least_memory(&self, threads: usize) -> u64 {
        let of_thread: u64 = match &self.command {
            Command::Run(_) | Command::Online(_) => 64 << 20,
            Command::Experiment(_) => 160 << 20,
            _ => 0,
        };
        PROGRAM + of_thread * threads as u64
    }

    /// Returns the number of threads to use.
    fn threads(&self) -> Result<usize, Failure> {
        let asked = match self.threads {
            Some(threads) => Some(threads.into()),
            None => rayon_threads(std::env::var("RAYON_NUM_THREADS").ok().as_deref())?,
        };
        // rayon's own default reads further environment variables and accepts any number
        Ok(asked.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, NonZero::get)))
    }

    /// Returns whether results are to be JSON.
    pub fn json(&self) -> bool {
        match &self.command {
            Command::Run(command) => command.options.json,
            Command::Online(command) => command.options.json,
            Command::Experiment(command) => command.json,
            Command::Solve(command) => command.json,
            Command::Replay(command) => command.json,
            Command::Vio(command) => command.json,
            Command::Doctor(command) => command.json,
            Command::Check(command) => command.json,
            Command::CheckFactor(command) => command.json,
            Command::CheckManifold(command) => command.json,
            Command::List(command) => command.json,
            Command::Explain(command) => command.json,
            Command::Graph(command) => command.json,
            Command::Evaluate(command) => command.json,
            Command::Inspect(command) => command.json,
            Command::Learn(_)
            | Command::New(_)
            | Command::Plot(_)
            | Command::Simulate(_)
            | Command::Completions(_)
            | Command::Man(_) => false,
            Command::Schema(_) => true,
        }
    }
}

/// A thread allocates a stack and buffers even if it is idle, so a larger number is a mistake.
const MOST_THREADS: u16 = 1024;

/// Number of threads from RAYON_NUM_THREADS. As in rayon, 0 and text that is not a number count as unset.
fn rayon_threads(variable: Option<&str>) -> Result<Option<usize>, Failure> {
    let Some(text) = variable.map(str::trim).filter(|text| !text.is_empty()) else { return Ok(None) };
    let whole = text.bytes().all(|digit| digit.is_ascii_digit());
    match text.parse::<u16>() {
        Ok(0) => Ok(None),
        Ok(threads) if threads <= MOST_THREADS => Ok(Some(threads.into())),
        Err(_) if !whole => Ok(None),
        _ => Err(Failure::with_help(
            format!("RAYON_NUM_THREADS is {text}, but at most {MOST_THREADS} threads are allowed"),
            "set it to the number of processors, or unset it",
        )),
    }
}

/// Memory for code, stacks and the buffers of two threads. Unit: bytes.
const PROGRAM: u64 = 256 << 20;

/// Returns an error if the memory limit is too small for the program itself.
fn check_limit(limit: Option<u64>, least: u64, threads: usize) -> Result<(), Failure> {
    match limit {
        Some(limit) if limit < least => Err(Failure::with_help(
            format!(
                "the memory limit is {}, but the program alone needs {} with {}",
                Bytes(limit),
                Bytes(least),
                count(threads, "thread")
            ),
            "raise the limit (ulimit -v), or use fewer threads (--threads)",
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn commands_with_many_threads_need_more_memory() {
        let least = |line: &str| Cli::parse_from(line.split(' ')).least_memory(4) >> 20;
        assert_eq!((least("manifactor list"), least("manifactor solve g.toml")), (256, 256));
        assert_eq!((least("manifactor run r.toml"), least("manifactor online r.toml")), (512, 512));
        assert_eq!(least("manifactor experiment e.toml"), 896);
        assert!(
            check_limit(None, 512 << 20, 4).is_ok() && check_limit(Some(512 << 20), 512 << 20, 4).is_ok()
        );
        let refused = check_limit(Some(300 << 20), 512 << 20, 4).unwrap_err().to_string();
        assert!(refused.contains("300.0 MiB") && refused.contains("512.0 MiB with 4 threads"), "{refused}");
    }

    #[test]
    fn threads_without_a_bound_are_refused() {
        for nothing in [None, Some(""), Some("0"), Some("-3"), Some("many")] {
            assert_eq!(rayon_threads(nothing).unwrap(), None, "{nothing:?}");
        }
        assert_eq!(rayon_threads(Some(" 7 ")).unwrap(), Some(7));
        for too_many in ["1025", "99999", "99999999999999999999999"] {
            let refused = rayon_threads(Some(too_many)).unwrap_err().to_string();
            assert!(refused.contains(too_many) && refused.contains("1024"), "{refused}");
        }
    }
}
