//! The live view: a page that shows the map as it grows, served to browsers while a command works.
//!
//! The command changes the [state](LiveMap). A server in a separate thread sends each browser the newest
//! state as soon as the browser has read the previous one, so a slow browser skips states. The command
//! waits for the server only at the end.
mod access;
mod address;
mod answers;
mod in_memory;
mod server;

pub use address::address;
pub use in_memory::answer;

use crate::failure::Failure;
use crate::output;
use access::Access;
use manifactor::slam::estimate::Estimate;
use manifactor::slam::online::Mapper;
use manifactor::slam::run::MappedFrame;
use manifactor::solve::{IterationRecord, Observer};
use manifactor::viz::{LiveMap, Phase};
use serde_json::json;
use std::cell::Cell;
use std::net::{SocketAddr, TcpListener};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The live view of a command.
pub(crate) struct View {
    map: watch::Sender<Arc<LiveMap>>,
    server: JoinHandle<()>,
    url: String,
    is_everywhere: bool,
    is_announced: bool,
    /// Time of the next refresh of the whole map.
    due: Cell<Instant>,
}

/// Shortest time between two refreshes of the whole map, and its smallest ratio to the duration of a
/// refresh.
const REFRESH: (Duration, u32) = (Duration::from_millis(500), 50);

impl View {
    /// Serves the page on this address from now on; port 0 selects a free port.
    ///
    /// # Errors
    /// If the address cannot be opened.
    pub(crate) fn open(address: SocketAddr) -> Result<Self, Failure> {
        let failed = |error: std::io::Error| {
            let help =
                "choose another address with --view=ADDRESS; port 0, or --view alone, selects a free port";
            Failure::with_help(format!("--view: cannot listen at {address}: {error}"), help)
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let access = Access::to(address).map_err(failed)?;
        let (url, is_everywhere) = (access.url(address), address.ip().is_unspecified());
        let (map, states) = watch::channel(Arc::default());
        let server = server::begin(listener, access, states).map_err(failed)?;
        Ok(Self { map, server, url, is_everywhere, is_announced: false, due: Cell::new(Instant::now()) })
    }

    /// Changes the state. It is copied only while the server encodes it for a browser.
    fn change(&self, change: impl FnOnce(&mut LiveMap)) {
        self.map.send_modify(|map| change(Arc::make_mut(map)));
    }

    /// Begins a variant of the run `title`. The first call prints the address.
    pub(crate) fn begin(&mut self, title: &str, variant: &str, as_json: bool) {
        self.change(|map| *map = LiveMap::new(title, variant));
        if std::mem::replace(&mut self.is_announced, true) {
            return;
        }
        if as_json {
            output::print_json_line(&json!({ "view": self.url }));
        }
        let elsewhere = if self.is_everywhere {
            " (on another machine, replace the host by the name of this machine)"
        } else {
            ""
        };
        output::print_message(&format!("live map: {}{elsewhere}", self.url));
    }

    /// Shows the result of a frame.
    pub(crate) fn frame(&self, frame: &mut MappedFrame<'_>) {
        let is_due = server::watchers(&self.map) > 0 && Instant::now() >= self.due.get();
        self.change(|map| map.add_frame(frame));
        if is_due {
            let began = Instant::now();
            self.refresh(frame.mapper);
            self.due.set(Instant::now() + REFRESH.0.max(began.elapsed() * REFRESH.1));
        }
    }

    /// Shows the current state of the whole map.
    pub(crate) fn refresh(&self, mapper: &mut Mapper) {
        self.change(|map| map.refresh(mapper));
    }

    /// Shows the map estimated from all frames.
    pub(crate) fn show_estimate(&self, estimate: &Estimate) {
        self.change(|map| map.show_estimate(estimate));
    }

    /// Sends the outcome to the browsers, and waits for them for a limited time.
    pub(crate) fn end(self, words: &str) {
        self.change(|map| map.set_phase(Phase::Ended(words.to_owned()), None));
        drop(self.map);
        // a panic of the server has already printed its message
        let _ = self.server.join();
    }
}

/// Shows the solve of all frames as one batch.
pub(crate) struct SolveDisplay<'a>(pub(crate) Option<&'a View>);

impl Observer for SolveDisplay<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        if let Some(view) = self.0 {
            let phase = Phase::Solving { iteration: record.iteration };
            view.change(|map| map.set_phase(phase, Some(record.cost)));
        }
        ControlFlow::Continue(())
    }
}
