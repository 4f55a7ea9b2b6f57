//! Output: results on standard output, everything else on standard error.
//!
//! No other code of this crate writes to the two, because `print!` and `eprintln!` panic if they cannot
//! write.
pub(crate) mod report;
#[allow(clippy::indexing_slicing, reason = "cells that it has made")]
pub(crate) mod summary_table;
pub(crate) mod table;
pub(crate) mod text;
pub(crate) mod watch;

use serde::Serialize;
use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether results could not be written.
static LOST: AtomicBool = AtomicBool::new(false);

/// Returns whether some of the results could not be written to standard output.
pub(crate) fn is_lost() -> bool {
    LOST.load(Ordering::Relaxed)
}

/// Prints results.
pub(crate) fn print(text: &str) {
    let mut out = io::stdout().lock();
    report_lost_output(out.write_all(text::printable(text).as_bytes()).and_then(|()| out.flush()));
}

/// Prints the program's own text byte for byte.
pub(crate) fn print_bytes(text: &[u8]) {
    let mut out = io::stdout().lock();
    report_lost_output(out.write_all(text).and_then(|()| out.flush()));
}

/// Records and reports a failed write to standard output.
pub(crate) fn report_lost_output(result: io::Result<()>) {
    let Err(error) = result else { return };
    LOST.store(true, Ordering::Relaxed);
    // a reader that has closed the pipe, such as `head`, needs no message
    if error.kind() != ErrorKind::BrokenPipe {
        print_message(&format!("cannot write to standard output: {error}"));
    }
}

/// Prints one JSON document.
pub(crate) fn print_json(value: &impl Serialize) {
    match serde_json::to_string_pretty(value) {
        Ok(text) => print(&(text::json(&text) + "\n")),
        Err(error) => report_lost_output(Err(error.into())),
    }
}

/// Prints one JSON document on a single line.
pub(crate) fn print_json_line(value: &impl Serialize) {
    match serde_json::to_string(value) {
        Ok(text) => print(&(text::json(&text) + "\n")),
        Err(error) => report_lost_output(Err(error.into())),
    }
}

/// Prints a line on standard error.
pub(crate) fn print_message(text: &str) {
    print_styled_message(&text::printable(text));
}

/// Prints a line with colours on standard error. The caller has to make foreign text printable first.
pub(crate) fn print_styled_message(text: &str) {
    // a single write keeps the lines of two threads apart; a failure must not stop the work
    let _ = io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

/// Prints a note on standard error.
pub(crate) fn print_note(text: &str) {
    print_message(&format!("note: {}", text::shortened(text)));
}
