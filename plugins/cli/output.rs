//! Output: results on standard output, all else on standard error.
//!
//! Nothing else in this crate writes to the two: `print!` and `eprintln!` panic where they cannot write.
pub(crate) mod report;
#[allow(clippy::indexing_slicing, reason = "cells that it has made")]
pub(crate) mod summary_table;
pub(crate) mod table;
pub(crate) mod text;
pub(crate) mod watch;

use serde::Serialize;
use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether results were lost on their way out.
static LOST: AtomicBool = AtomicBool::new(false);

/// Returns whether standard output could not take all that was printed.
pub(crate) fn is_lost() -> bool {
    LOST.load(Ordering::Relaxed)
}

/// Prints results.
pub(crate) fn print(text: &str) {
    let mut out = io::stdout().lock();
    printed(out.write_all(text::printable(text).as_bytes()).and_then(|()| out.flush()));
}

/// Prints a text of the program's own as it is, byte for byte.
pub(crate) fn print_as_is(text: &[u8]) {
    let mut out = io::stdout().lock();
    printed(out.write_all(text).and_then(|()| out.flush()));
}

/// Keeps in mind that something could not be printed, and says so.
pub(crate) fn printed(result: io::Result<()>) {
    let Err(error) = result else { return };
    LOST.store(true, Ordering::Relaxed);
    // a reader that has heard enough, such as `head`, needs no message
    if error.kind() != ErrorKind::BrokenPipe {
        say(&format!("cannot write to standard output: {error}"));
    }
}

/// Prints one JSON document.
pub(crate) fn json(value: &impl Serialize) {
    match serde_json::to_string_pretty(value) {
        Ok(text) => print(&(text::json(&text) + "\n")),
        Err(error) => printed(Err(error.into())),
    }
}

/// Prints one JSON document on a line of its own.
pub(crate) fn json_line(value: &impl Serialize) {
    match serde_json::to_string(value) {
        Ok(text) => print(&(text::json(&text) + "\n")),
        Err(error) => printed(Err(error.into())),
    }
}

/// Says something on standard error, and ends the line.
pub(crate) fn say(text: &str) {
    say_styled(&text::printable(text));
}

/// The same for text with colours: what others wrote in it was made printable before it got them.
pub(crate) fn say_styled(text: &str) {
    // one write, so that lines of two threads do not mix; the work goes on if it fails
    let _ = io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

/// Says something that is worth knowing.
pub(crate) fn note(note: &str) {
    say(&format!("note: {}", text::shortened(note)));
}
