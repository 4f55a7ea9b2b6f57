//! The benchmarks. Each one prints a table of the pages in `docs/`, and its first lines describe its
//! arguments.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]
use std::error::Error;
use std::process::ExitCode;

mod associate;
mod auto;
mod cameras;
mod formulas;
mod kitti;
mod linearise_boxes;
mod long;
mod marginals;
mod outliers;
mod replay;
mod reuse;
mod starts;
mod stream;
mod window;

/// The arguments after the name of the benchmark.
type Arguments = std::iter::Skip<std::env::Args>;

type BenchmarkResult = Result<(), Box<dyn Error>>;

/// Runs the benchmark that the first argument names.
pub(crate) fn run(mut arguments: Arguments) -> ExitCode {
    let name = arguments.next().unwrap_or_default();
    let result = match name.as_str() {
        "associate" => associate::run(arguments),
        "auto" => auto::run(arguments),
        "cameras" => cameras::run(),
        "formulas" => formulas::run(),
        "kitti" => kitti::run(arguments),
        "linearise_boxes" => linearise_boxes::run(),
        "long" => long::run(arguments),
        "marginals" => marginals::run(arguments),
        "outliers" => outliers::run(arguments),
        "replay" => replay::run(arguments),
        "reuse" => reuse::run(arguments),
        "starts" => starts::run(arguments),
        "stream" => stream::run(arguments),
        "window" => window::run(arguments),
        _ => Err(format!("`{name}` is not a benchmark: tests/bench/benchmarks has them").into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// CPU time of this thread, independent of the load of the machine. Unit: seconds.
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Resident memory of the process, on systems that report it. Unit: megabytes.
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok()).unwrap_or_default() / 1e3
}
