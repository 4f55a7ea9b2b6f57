//! Trials on all cores, each on one thread.
use crate::document::Experiment;
use crate::journal::TrialLog;
use crate::trial::{Trial, TrialOutcome, TrialRecord};
use manifactor_formats::journal::JournalError;
use manifactor_recording::source::Folders;
use manifactor_solve::{Interrupt, Observer};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// How far an experiment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Trials done, those of earlier runs included.
    pub done: usize,
    /// Of them, those of earlier runs.
    pub kept: usize,
    /// All trials.
    pub trials: usize,
}

/// Runs the trials that are not in the journal yet, as many at once as there are `threads`. Returns whether all are done:
/// `interrupt` ends it early, and leaves those under way to the next run.
///
/// # Errors
/// If the journal cannot be written. What goes wrong in a trial is its outcome.
pub fn run(
    experiment: &Experiment,
    folders: &Folders,
    journal: &mut TrialLog,
    threads: usize,
    interrupt: &Interrupt,
    mut progress: impl FnMut(Progress),
) -> Result<bool, JournalError> {
    let (trials, next) = (experiment.trials.len(), AtomicUsize::new(0));
    let open: Vec<&Trial> = experiment.trials.iter().filter(|trial| journal.find(trial).is_none()).collect();
    let kept = trials - open.len();
    let mut done = kept;
    progress(Progress { done, kept, trials });
    let (send, receive) = mpsc::channel();
    let written = std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, open.len().max(1)) {
            let (send, next, open) = (send.clone(), &next, &open);
            scope.spawn(move || {
                while !interrupt.0.load(Ordering::Relaxed)
                    && let Some(trial) = open.get(next.fetch_add(1, Ordering::Relaxed))
                    && let Some(record) = alone(trial, folders, &mut interrupt.clone())
                    && send.send(record).is_ok()
                {}
            });
        }
        drop(send);
        // once the receiver is gone, workers end after the trial that they are at
        for record in receive {
            let (trial, status) = (record.labels.join(", "), record.outcome.status());
            tracing::info!(trial, status, seconds = record.seconds, "trial");
            journal.append(record)?;
            done += 1;
            progress(Progress { done, kept, trials });
        }
        Ok(())
    });
    written.map(|()| done == trials)
}

/// A trial on one thread: its solver has a pool of one. `None` where the observer stopped it.
pub fn alone(trial: &Trial, folders: &Folders, observer: &mut (dyn Observer + Send)) -> Option<TrialRecord> {
    let failed = |reason: String| TrialRecord {
        labels: trial.labels.clone(),
        fingerprint: trial.fingerprint(),
        outcome: TrialOutcome::Failed { reason },
        seconds: 0.0,
    };
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool,
        Err(error) => return Some(failed(error.to_string())),
    };
    let run = || pool.install(|| trial.run(folders, observer));
    // a defect shows in one row, and does not take the others with it
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Some(failed("the trial panicked".into())))
}
