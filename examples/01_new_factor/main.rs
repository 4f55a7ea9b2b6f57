//! An example of a new factor, and a command line that includes it.
//!
//! ```sh
//! cargo run --release --example 01_new_factor -- explain rests_on
//! cargo run --release --example 01_new_factor -- run examples/01_new_factor/desk.toml
//! ```
mod rests_on;

fn main() -> std::process::ExitCode {
    manifactor_cli::main()
}
