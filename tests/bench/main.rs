//! The command line of Manifactor with the associations of this crate.
use manifactor_bench as _;

fn main() -> std::process::ExitCode {
    manifactor_cli::main()
}
