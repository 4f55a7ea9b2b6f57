//! Parallel execution of trials, each on one thread.
use crate::document::Experiment;
use crate::journal::TrialLog;
use crate::trial::{Trial, TrialOutcome, TrialRecord};
use manifactor_formats::journal::JournalError;
use manifactor_recording::source::InputFolders;
use manifactor_solve::{Interrupt, Observer};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// Progress of an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExperimentProgress {
    /// Finished trials, including those of earlier runs.
    pub done: usize,
    /// Finished trials of earlier runs.
    pub kept: usize,
    /// All trials.
    pub trials: usize,
}

/// Runs the trials that the log does not contain yet, `threads` at a time. Returns whether all trials are
/// finished. `interrupt` ends the run early; unfinished trials are left to the next run.
///
/// # Errors
/// If the log cannot be written. An error within a trial becomes its outcome.
pub fn run(
    experiment: &Experiment,
    folders: &InputFolders,
    journal: &mut TrialLog,
    threads: usize,
    interrupt: &Interrupt,
    mut progress: impl FnMut(ExperimentProgress),
) -> Result<bool, JournalError> {
    let (trials, next) = (experiment.trials.len(), AtomicUsize::new(0));
    let open: Vec<&Trial> =
        experiment.trials.iter().filter(|trial| journal.record_of(trial).is_none()).collect();
    let kept = trials - open.len();
    let mut done = kept;
    progress(ExperimentProgress { done, kept, trials });
    let (send, receive) = mpsc::channel();
    let written = std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, open.len().max(1)) {
            let (send, next, open) = (send.clone(), &next, &open);
            scope.spawn(move || {
                while !interrupt.0.load(Ordering::Relaxed)
                    && let Some(trial) = open.get(next.fetch_add(1, Ordering::Relaxed))
                    && let Some(record) = run_single_threaded(trial, folders, &mut interrupt.clone())
                    && send.send(record).is_ok()
                {}
            });
        }
        drop(send);
        // without the receiver, workers end after their current trial
        for record in receive {
            let (trial, status) = (record.labels.join(", "), record.outcome.status());
            tracing::info!(trial, status, seconds = record.seconds, "trial");
            journal.append(record)?;
            done += 1;
            progress(ExperimentProgress { done, kept, trials });
        }
        Ok(())
    });
    written.map(|()| done == trials)
}

/// Runs a trial on one thread: its solver has a pool of one thread. `None` if the observer stopped it.
pub fn run_single_threaded(
    trial: &Trial,
    folders: &InputFolders,
    observer: &mut (dyn Observer + Send),
) -> Option<TrialRecord> {
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
    // a panic fails one trial and does not affect the rest
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Some(failed("the trial panicked".into())))
}
