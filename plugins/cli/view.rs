//! The live view: a page of the map as it grows, served to browsers while a command works.
//!
//! The command changes the [state](LiveMap) under a lock that nobody holds for longer than a copy takes. Each browser has a thread
//! of its own, which sends it the newest state when it has changed, and so skips what a slow browser has no time for.
mod access;
mod address;
mod feed;
mod request;
mod server;

pub(crate) use address::address;

use crate::failure::Failure;
use crate::output;
use access::Access;
use feed::Feed;
use manifactor::slam::estimate::Estimate;
use manifactor::slam::online::{FrameError, FrameReport, Mapper};
use manifactor::slam::sequence::Observation;
use manifactor::solve::{IterationRecord, Observer};
use manifactor::viz::{LiveMap, Phase};
use serde_json::json;
use std::net::{SocketAddr, TcpListener};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a command shows of its work.
pub(crate) struct View {
    feed: Arc<Feed<LiveMap>>,
    url: String,
    is_everywhere: bool,
    is_told: bool,
    /// When the whole map is looked at again.
    due: Instant,
}

/// The whole map is looked at no more often than this, and in no more than this share of the time.
const REFRESH: (Duration, u32) = (Duration::from_millis(500), 50);
/// How long the end waits for browsers that have not been told of it yet.
const FAREWELL: Duration = Duration::from_secs(5);

impl View {
    /// Serves the page on this address from now on; port 0 is one that is free.
    ///
    /// # Errors
    /// Where the address cannot be listened at.
    pub(crate) fn open(address: SocketAddr) -> Result<Self, Failure> {
        let failed = |error: std::io::Error| {
            let help = "choose another with --view=ADDRESS; with port 0, or --view alone, the system chooses a free one";
            Failure::with_help(format!("--view: cannot listen at {address}: {error}"), help)
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let access = Access::to(address).map_err(failed)?;
        let feed = Arc::new(Feed::new(LiveMap::default()));
        let (url, is_everywhere) = (access.url(address), address.ip().is_unspecified());
        server::serve(listener, access, feed.clone()).map_err(failed)?;
        Ok(Self { feed, url, is_everywhere, is_told: false, due: Instant::now() })
    }

    /// A run of this title begins with a variant. The first time, the address is told.
    pub(crate) fn begin(&mut self, title: &str, variant: &str, as_json: bool) {
        self.feed.change(|map| *map = LiveMap::new(title, variant));
        if std::mem::replace(&mut self.is_told, true) {
            return;
        }
        if as_json {
            output::json_line(&json!({ "view": self.url }));
        }
        let elsewhere =
            if self.is_everywhere { " (from elsewhere: with the name of this machine)" } else { "" };
        output::say(&format!("the map as it grows: {}{elsewhere}", self.url));
    }

    /// Shows what came of a frame.
    pub(crate) fn frame(
        &mut self,
        report: Result<&FrameReport, &FrameError>,
        observation: Option<&Observation>,
        mapper: &mut Mapper,
        seconds: f64,
    ) {
        let is_due = self.feed.watchers() > 0 && Instant::now() >= self.due;
        self.feed.change(|map| map.frame(report, observation, mapper, seconds));
        if is_due {
            let began = Instant::now();
            self.refresh(mapper);
            self.due = Instant::now() + REFRESH.0.max(began.elapsed() * REFRESH.1);
        }
    }

    /// Shows all of the map as it is now.
    pub(crate) fn refresh(&self, mapper: &mut Mapper) {
        self.feed.change(|map| map.refresh(mapper));
    }

    /// Shows the map that all frames together give.
    pub(crate) fn settle(&self, estimate: &Estimate) {
        self.feed.change(|map| map.settle(estimate));
    }

    /// Tells browsers how it ended, and waits for them, though not for long.
    pub(crate) fn end(&self, words: &str) {
        self.feed.end(|map| map.enter(Phase::Ended(words.to_owned()), None), FAREWELL);
    }
}

/// Shows the solve of all frames as one batch.
pub(crate) struct Solve(Option<Arc<Feed<LiveMap>>>);

impl Solve {
    /// By this view, if there is one.
    pub(crate) fn shown_by(view: Option<&View>) -> Self {
        Self(view.map(|view| view.feed.clone()))
    }
}

impl Observer for Solve {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        if let Some(feed) = &self.0 {
            let phase = Phase::Solving { iteration: record.iteration };
            feed.change(|map| map.enter(phase, Some(record.cost)));
        }
        ControlFlow::Continue(())
    }
}
