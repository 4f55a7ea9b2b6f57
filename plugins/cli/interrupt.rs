//! Signals. The first Ctrl-C ends the solve with the best values so far, the second ends the program.
//! SIGXFSZ, for a file that reaches its size limit, becomes an error.
use crate::output;
use manifactor::solve::Interrupt;
use std::sync::atomic::Ordering;

/// Returns an observer that stops a solve after Ctrl-C.
pub(crate) fn on_ctrl_c() -> Interrupt {
    let interrupt = Interrupt::default();
    let flag = interrupt.0.clone();
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        output::print_message(
            "interrupted: writing the results so far; press Ctrl-C again to quit immediately",
        );
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        output::print_message(&format!("Ctrl-C will end the program immediately, without results: {error}"));
    }
    interrupt
}

/// Turns a write beyond the limit of `ulimit -f` into an error with a message. By default the system's
/// signal would end the program silently.
#[cfg(unix)]
pub(crate) fn fail_at_the_limit_of_files() {
    use signal_hook::{consts::SIGXFSZ, flag};
    // the flag is never read: with any handler the write fails with EFBIG; without one the signal ends the
    // program
    let _ = flag::register(SIGXFSZ, std::sync::Arc::default());
}

/// Does nothing: this system has no such signal.
#[cfg(not(unix))]
pub(crate) fn fail_at_the_limit_of_files() {}
