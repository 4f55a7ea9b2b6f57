//! One that changes a state, and many that watch it.
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A state that is changed by one thread and copied by others. Who watches gets the newest, and misses those between.
pub(super) struct Feed<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    value: T,
    /// Counts changes.
    version: u64,
    watchers: usize,
    is_last: bool,
}

/// A state as it was.
pub(super) struct Seen<T> {
    pub(super) value: T,
    pub(super) version: u64,
    /// Whether none comes after it.
    pub(super) is_last: bool,
}

impl<T: Clone> Feed<T> {
    pub(super) fn new(value: T) -> Self {
        let state = State { value, version: 1, watchers: 0, is_last: false };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// A thread that has panicked while it copied has changed nothing.
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state.
    pub(super) fn change(&self, change: impl FnOnce(&mut T)) {
        let mut state = self.lock();
        change(&mut state.value);
        state.version += 1;
        self.changed.notify_all();
    }

    /// Changes it for the last time, and waits until no one watches any more, though not longer than this.
    pub(super) fn end(&self, change: impl FnOnce(&mut T), patience: Duration) {
        let mut state = self.lock();
        change(&mut state.value);
        state.version += 1;
        state.is_last = true;
        self.changed.notify_all();
        let waited = self.changed.wait_timeout_while(state, patience, |state| state.watchers > 0);
        drop(waited);
    }

    /// How many watch.
    pub(super) fn watchers(&self) -> usize {
        self.lock().watchers
    }

    /// Watches from now on, until it is dropped.
    pub(super) fn watch(&self) -> Watcher<'_, T> {
        self.lock().watchers += 1;
        Watcher(self)
    }
}

/// One that watches.
pub(super) struct Watcher<'a, T: Clone>(&'a Feed<T>);

impl<T: Clone> Watcher<'_, T> {
    /// The newest state, once it is newer than a version or the last; `None` where it does not change for so long.
    pub(super) fn newer(&self, version: u64, patience: Duration) -> Option<Seen<T>> {
        let began = Instant::now();
        let mut state = self.0.lock();
        while state.version <= version {
            let left = patience.checked_sub(began.elapsed())?;
            let waited = self.0.changed.wait_timeout(state, left);
            (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        }
        Some(Seen { value: state.value.clone(), version: state.version, is_last: state.is_last })
    }
}

impl<T: Clone> Drop for Watcher<'_, T> {
    fn drop(&mut self) {
        self.0.lock().watchers -= 1;
        self.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: Duration = Duration::from_secs(60);

    #[test]
    fn who_comes_late_gets_the_newest_state_and_no_other() {
        let feed = Feed::new(0);
        (0..5).for_each(|_| feed.change(|n| *n += 1));
        let watcher = feed.watch();
        let seen = watcher.newer(0, LONG).unwrap();
        assert_eq!((seen.value, seen.is_last, feed.watchers()), (5, false, 1));
        assert!(watcher.newer(seen.version, Duration::ZERO).is_none());
        drop(watcher);
        assert_eq!(feed.watchers(), 0);
    }

    #[test]
    fn the_end_waits_until_all_have_seen_it() {
        let feed = Feed::new(0);
        let watcher = feed.watch();
        std::thread::scope(|threads| {
            let last = threads.spawn(move || {
                let mut version = 0;
                loop {
                    let seen = watcher.newer(version, LONG).unwrap();
                    if seen.is_last {
                        return seen.value;
                    }
                    version = seen.version;
                }
            });
            feed.end(|n| *n = 9, LONG);
            assert_eq!((feed.watchers(), last.join().unwrap()), (0, 9));
        });
    }

    #[test]
    fn the_end_does_not_wait_for_ever() {
        let feed = Feed::new(0);
        let _deaf = feed.watch();
        feed.end(|n| *n = 9, Duration::from_millis(1));
    }
}
