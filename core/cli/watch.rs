//! Watching a solve on a terminal: a progress bar, or a line for each step.
use crate::text::seconds;
use indicatif::{ProgressBar, ProgressStyle};
use manifactor::solve::{IterationRecord, Observer};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::time::Duration;

/// What `-v` and a terminal ask for. All of it goes to stderr.
pub(crate) enum Watch {
    /// Nobody looks.
    Nothing,
    /// One line that changes.
    Bar(ProgressBar),
    /// A line for each step.
    Lines { begun: bool },
}

impl Watch {
    /// Lines with `-v`; else a bar, where stderr is a terminal.
    pub(crate) fn new(verbose: bool, title: &str) -> Self {
        if verbose {
            return Self::Lines { begun: false };
        }
        if !std::io::stderr().is_terminal() {
            return Self::Nothing;
        }
        let bar = ProgressBar::new_spinner().with_prefix(title.to_owned());
        // the template is a literal: without it the default style is as good
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix} {elapsed} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self::Bar(bar)
    }
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
                    eprintln!("{HEADER}");
                }
                eprintln!("{}", line(record));
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
