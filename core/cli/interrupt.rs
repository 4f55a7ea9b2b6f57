//! Ctrl-C: the first ends the solve with the best values so far, the second ends the program.
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
        eprintln!("interrupted: ending with the best values so far; once more to quit at once");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        eprintln!("Ctrl-C will end the program at once: {error}");
    }
    interrupt
}
