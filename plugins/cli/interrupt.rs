//! Signals: Ctrl-C, of which the first ends the solve with the best values so far and the second ends the program; and
//! the one that comes with a file that may not grow.
use crate::output;
use manifactor::solve::Interrupt;
use std::sync::atomic::Ordering;

/// An observer that stops a solve once Ctrl-C is pressed.
pub(crate) fn on_ctrl_c() -> Interrupt {
    let interrupt = Interrupt::default();
    let flag = interrupt.0.clone();
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        output::say("interrupted: ending with what there is so far; once more to quit at once");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        output::say(&format!("Ctrl-C will end the program at once: {error}"));
    }
    interrupt
}

/// Makes a file that reaches the limit of `ulimit -f` a write that fails, with a message, where the signal that the
/// system sends would end the program without a word.
#[cfg(unix)]
pub(crate) fn fail_at_the_limit_of_files() {
    use signal_hook::{consts::SIGXFSZ, flag};
    // the flag is never read: with any handler the write fails with EFBIG; without one the signal ends the program
    let _ = flag::register(SIGXFSZ, std::sync::Arc::default());
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub(crate) fn fail_at_the_limit_of_files() {}
