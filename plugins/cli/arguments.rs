//! The command line.
use crate::commands::{
    Check, CheckFactor, CheckManifold, Completions, Evaluate, Experiment, Explain, List, Man, New, Online,
    Plot, Replay, Run, Schema, ShowGraph, Simulate, Solve,
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
/// Exit codes: 0 done; 1 a solve ended without converging (its best values are written), nothing that was detected is mapped, or a factor
/// or a type of variables breaks a law; 2 the command line or a document is wrong; 3 a file is not there, or it or standard output could not be read or written;
/// 130 interrupted before all was done (the best values so far are written).
#[derive(Debug, Parser)]
#[command(name = "manifactor", version, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to compute with, 1 to 1024; else what RAYON_NUM_THREADS says, else all processors. Results are the same for
    /// any number.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)))]
    threads: Option<u16>,
    /// Say more on stderr: each step (-v), then all that is read, compiled and written (-vv).
    #[arg(long, short, global = true, action = ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(Run),
    Online(Online),
    Plot(Plot),
    Experiment(Experiment),
    Solve(Solve),
    Replay(Replay),
    Check(Check),
    CheckFactor(CheckFactor),
    CheckManifold(CheckManifold),
    List(List),
    Explain(Explain),
    Graph(ShowGraph),
    New(New),
    Evaluate(Evaluate),
    Simulate(Simulate),
    Schema(Schema),
    Completions(Completions),
    Man(Man),
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
            Command::Check(command) => command.run(),
            Command::CheckFactor(command) => command.run(),
            Command::CheckManifold(command) => command.run(),
            Command::List(command) => command.run(),
            Command::Explain(command) => command.run(),
            Command::Graph(command) => command.run(),
            Command::New(command) => command.run(),
            Command::Evaluate(command) => command.run(),
            Command::Simulate(command) => command.run(),
            Command::Schema(command) => command.run(),
            Command::Completions(command) => Ok(command.run(Self::command())),
            Command::Man(command) => command.run(Self::command()),
        }
    }

    /// The least limit of memory at which a command ends with an error, if it has too little, and not by the allocator. Measured
    /// with 1 to 8 threads: each reserves addresses for its allocator, and that of an experiment for its trials as well.
    fn least_memory(&self, threads: usize) -> u64 {
        let of_thread: u64 = match &self.command {
            Command::Run(_) | Command::Online(_) => 64 << 20,
            Command::Experiment(_) => 160 << 20,
            _ => 0,
        };
        PROGRAM + of_thread * threads as u64
    }

    /// How many threads to compute with.
    fn threads(&self) -> Result<usize, Failure> {
        let asked = match self.threads {
            Some(threads) => Some(threads.into()),
            None => asked_of_rayon(std::env::var("RAYON_NUM_THREADS").ok().as_deref())?,
        };
        // rayon would look at variables of its own, and take any number
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
            Command::Check(command) => command.json,
            Command::CheckFactor(command) => command.json,
            Command::CheckManifold(command) => command.json,
            Command::List(command) => command.json,
            Command::Explain(command) => command.json,
            Command::Graph(command) => command.json,
            Command::Evaluate(command) => command.json,
            Command::New(_)
            | Command::Plot(_)
            | Command::Simulate(_)
            | Command::Completions(_)
            | Command::Man(_) => false,
            Command::Schema(_) => true,
        }
    }
}

/// A thread takes a stack and buffers, whether it has work or not: more than this is a mistake.
const MOST_THREADS: u16 = 1024;

/// Threads by RAYON_NUM_THREADS. As rayon has it, 0 and what is no number ask for nothing.
fn asked_of_rayon(variable: Option<&str>) -> Result<Option<usize>, Failure> {
    let Some(text) = variable.map(str::trim).filter(|text| !text.is_empty()) else { return Ok(None) };
    let whole = text.bytes().all(|digit| digit.is_ascii_digit());
    match text.parse::<u16>() {
        Ok(0) => Ok(None),
        Ok(threads) if threads <= MOST_THREADS => Ok(Some(threads.into())),
        Err(_) if !whole => Ok(None),
        _ => Err(Failure::with_help(
            format!("RAYON_NUM_THREADS is {text}: at most {MOST_THREADS} threads are started"),
            "set it to the number of processors, or unset it",
        )),
    }
}

/// Bytes for code, stacks and the buffers of two threads.
const PROGRAM: u64 = 256 << 20;

/// Refuses to begin if not even the program itself is sure to have room.
fn check_limit(limit: Option<u64>, least: u64, threads: usize) -> Result<(), Failure> {
    match limit {
        Some(limit) if limit < least => Err(Failure::with_help(
            format!(
                "the limit of memory is {}, and the program alone takes {} with {}",
                Bytes(limit),
                Bytes(least),
                count(threads, "thread")
            ),
            "allow more (ulimit -v), or take fewer threads (--threads)",
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
            assert_eq!(asked_of_rayon(nothing).unwrap(), None, "{nothing:?}");
        }
        assert_eq!(asked_of_rayon(Some(" 7 ")).unwrap(), Some(7));
        for too_many in ["1025", "99999", "99999999999999999999999"] {
            let refused = asked_of_rayon(Some(too_many)).unwrap_err().to_string();
            assert!(refused.contains(too_many) && refused.contains("1024"), "{refused}");
        }
    }
}
