//! Events of the map: their counts, and the newest as text.
use manifactor_graph::Key;
use manifactor_slam::association::DetectionMove;
use manifactor_slam::online::FrameReport;
use manifactor_slam::sequence::ObjectId;
use serde_json::{Value, json};
use std::collections::VecDeque;

/// Number of notes that are kept.
const KEPT: usize = 100;
/// Largest length of a note. Unit: characters.
const LONGEST: usize = 300;

/// Counts of all events, and the newest as text.
#[derive(Debug, Clone, Default)]
pub(super) struct Notes {
    initialized: usize,
    removed: usize,
    moved: usize,
    merged: usize,
    forgotten: usize,
    refused: usize,
    /// Number of refused frames, included in `refused`.
    left_out: usize,
    rejected: usize,
    /// Notes with their frames.
    newest: VecDeque<(usize, String)>,
}

impl Notes {
    /// Adds the events of a frame. `now` maps an object to its current id, and `class` a key to its class.
    pub(super) fn add_events<'a>(
        &mut self,
        report: &FrameReport,
        now: impl Fn(ObjectId) -> ObjectId,
        class: impl Fn(&Key) -> Option<&'a str>,
    ) {
        let frame = report.frame;
        if let Some(located) = &report.located {
            // earlier counts refer to the discarded map, and this report covers all frames
            let (frames, newest) = (self.left_out, std::mem::take(&mut self.newest));
            *self = Self { left_out: frames, refused: frames, newest, ..Self::default() };
            let matches = located.matches.len();
            self.add_note(
                frame,
                &format!(
                    "relocalized in the prior map by {matches} objects; ids and poses now refer to that map"
                ),
            );
        }
        if let Some(noise) = &report.noise {
            self.add_note(frame, &format!("noise estimated: {noise}"));
        }
        self.initialized += report.initialized.len();
        self.removed += report.removed.len();
        self.moved += report.moved.len();
        self.merged += report.merged.len();
        self.forgotten += report.forgotten.len();
        for key in &report.initialized {
            let class = class(key).map(|class| format!(" ({class})")).unwrap_or_default();
            self.add_note(frame, &format!("{key}{class} was added to the map"));
        }
        for key in &report.removed {
            self.add_note(
                frame,
                &format!(
                    "{key} was removed: its boxes show several objects, or belong to another object now"
                ),
            );
        }
        for DetectionMove { frame: of, from, into, .. } in &report.moved {
            self.add_note(frame, &format!("a box of frame {of} shows object {into}, not {from}"));
        }
        for merge in &report.merged {
            self.add_note(frame, &format!("object {} was merged into {}", merge.from, now(merge.into)));
        }
        for id in &report.forgotten {
            self.add_note(frame, &format!("object {id} was dropped: it has too few detections"));
        }
        for update in &report.updates {
            self.rejected += update.rejected.len();
            self.rejected = self.rejected.saturating_sub(update.readmitted.len());
            for (factors, what) in
                [(&update.rejected, "rejected as outliers"), (&update.readmitted, "readmitted")]
            {
                if !factors.is_empty() {
                    self.add_note(frame, &format!("factors {what}: {}", factors.len()));
                }
            }
        }
        for refused in &report.refused {
            self.add_refused(frame, refused);
        }
    }

    /// Counts a frame that was refused, and adds a note.
    pub(super) fn add_skipped_frame(&mut self, frame: usize, text: &str) {
        self.left_out += 1;
        self.add_refused(frame, text);
    }

    /// Counts refused input, and adds a note.
    fn add_refused(&mut self, frame: usize, text: &str) {
        self.refused += 1;
        self.add_note(frame, text);
    }

    /// Adds a note. The text may be foreign and of any length.
    fn add_note(&mut self, frame: usize, text: &str) {
        let text: String = text.chars().take(LONGEST).collect();
        if self.newest.len() == KEPT {
            self.newest.pop_front();
        }
        self.newest.push_back((frame, text));
    }

    /// Returns the counts by name, and the newest notes with their frames.
    pub(super) fn to_json(&self) -> Value {
        json!({
            "counts": {
                "initialized": self.initialized,
                "removed": self.removed,
                "moved": self.moved,
                "merged": self.merged,
                "forgotten": self.forgotten,
                "refused": self.refused,
                "rejected": self.rejected,
            },
            "newest": self.newest,
        })
    }
}
