//! The command line of Manifactor with the associations of this crate, and `measure`, which runs a
//! benchmark.
use manifactor_bench as _;
use std::process::ExitCode;

mod benchmarks;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    if arguments.next().as_deref() == Some("measure") {
        return benchmarks::run(arguments);
    }
    manifactor_cli::main()
}
