//! The command line of Manifactor, as a library with which an external plugin builds its own binary.
//!
//! ```no_run
//! use my_plugin as _; // links it, and with it all that it registers
//! # mod my_plugin {}
//!
//! fn main() -> std::process::ExitCode {
//!     manifactor_cli::main()
//! }
//! ```
//!
//! The exit codes are documented at [`Status`] and [`Failure`], and in
//! `docs/reference/exit-codes.md`.
// this crate reads untrusted input, so no index may be taken for granted
#![warn(clippy::indexing_slicing)]
mod arguments;
#[allow(clippy::indexing_slicing, reason = "its own names and objects")]
mod commands;
mod failure;
mod input;
#[allow(clippy::indexing_slicing, reason = "rows that it has made")]
mod inspection;
mod interrupt;
mod output;
mod reference;
mod status;
mod view;

pub use arguments::Cli;
pub use commands::experiment::write_experiment;
pub use failure::Failure;
pub use status::Status;

/// Functions that the fuzz targets call (`tests/fuzz`).
#[doc(hidden)]
pub mod __private {
    pub use crate::view::{address, answer};
}

use clap::Parser;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Runs the command line of the process and returns its exit code.
pub fn main() -> ExitCode {
    main_with(std::env::args_os()).into()
}

/// Runs the given command line, which begins with the name of the program. Returns the exit code as a
/// number, for hosts that are not written in Rust.
pub fn main_with(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> u8 {
    interrupt::fail_at_the_limit_of_files();
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            // clap quotes arguments of any length
            let text = error.render().to_string();
            let lines: Vec<String> = text.trim_end().lines().map(output::text::shortened).collect();
            output::print_message(&lines.join("\n"));
            return Failure::usage();
        }
        Err(help) => {
            output::report_lost_output(help.print().and_then(|()| std::io::stdout().flush()));
            return if output::is_lost() { Failure::files() } else { Status::Done.into() };
        }
    };
    match cli.run() {
        Ok(_) if output::is_lost() => Failure::files(),
        Ok(status) => status.into(),
        Err(failure) => {
            failure.show(cli.json());
            failure.exit_code()
        }
    }
}
