//! Progress on stderr: a progress bar, a line for each step, or the full log.
use crate::output;
use crate::output::text::{on_one_line, seconds};
use indicatif::{ProgressBar, ProgressStyle};
use manifactor::solve::{IterationRecord, Observer};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::time::Duration;
use tracing::Level;
use tracing_subscriber::field::MakeExt;
use tracing_subscriber::fmt::{format::debug_fn, time::uptime};

/// The form of the progress, chosen by `-v` and by the kind of stderr.
pub(crate) enum Watch {
    /// No progress.
    Nothing,
    /// One line that changes.
    Bar(ProgressBar),
    /// A line for each step.
    Lines { begun: bool },
}

impl Watch {
    /// Creates lines for `-v`, nothing for `-vv` (the log has the steps), and otherwise a bar if stderr is
    /// a terminal.
    pub(crate) fn new(verbose: u8, title: &str) -> Self {
        match verbose {
            0 if std::io::stderr().is_terminal() => {}
            1 => return Self::Lines { begun: false },
            _ => return Self::Nothing,
        }
        let bar = ProgressBar::new_spinner().with_prefix(on_one_line(title).into_owned());
        // if the literal template is invalid, the default style is good enough
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix} {elapsed} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self::Bar(bar)
    }

    /// Shows the work after the solve on the bar. With `-v` the log shows it.
    pub(crate) fn show(&mut self, work: &str) {
        if let Self::Bar(bar) = self {
            bar.set_message(on_one_line(work).into_owned());
        }
    }
}

/// Starts the log on stderr: warnings by default, completed work with `-v`, details with `-vv`.
pub(crate) fn log(verbose: u8) {
    let level = match verbose {
        0 => Level::WARN,
        1 => Level::INFO,
        2 => Level::DEBUG,
        _ => Level::TRACE,
    };
    let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let log = tracing_subscriber::fmt().with_max_level(level).with_ansi(colours).with_timer(uptime());
    let fields = debug_fn(|out, field, value| {
        let value = format!("{value:?}");
        let value = on_one_line(&value);
        if field.name() == "message" { write!(out, "{value}") } else { write!(out, "{field}={value}") }
    });
    // a line that cannot be written is dropped: the logger would report its error with `eprintln!`, which
    // fails too
    let log = log.fmt_fields(fields.delimited(" ")).log_internal_errors(false);
    // a host program with its own logger keeps it
    let _ = log.with_writer(std::io::stderr).try_init();
}

impl Observer for Watch {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        match self {
            Self::Nothing => {}
            Self::Bar(bar) => {
                bar.set_message(format!("iteration {}, cost {:.6e}", record.iteration, record.cost));
            }
            Self::Lines { begun } => {
                if !std::mem::replace(begun, true) {
                    output::print_message(HEADER);
                }
                output::print_message(&line(record));
            }
        }
        ControlFlow::Continue(())
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

const HEADER: &str =
    "iteration          cost         trial   gradient       step    control  inactive      time";

fn line(r: &IterationRecord) -> String {
    let trial = r.trial_cost.map_or("undefined".into(), |c| format!("{c:.6e}"));
    format!(
        "{:>7} {} {:>13.6e} {trial:>13} {:>10.2e} {:>10.2e} {:>10.2e} {:>9} {:>9}",
        r.iteration,
        if r.accepted { ' ' } else { 'x' },
        r.cost,
        r.gradient,
        r.step,
        r.control,
        r.inactive,
        seconds(r.seconds)
    )
}
