//! `manifactor inspect`: lists the topics of a recording.
use crate::failure::Failure;
use crate::input::recording::{GuessedSource, ROLES, guess};
use crate::output;
use crate::output::text::{Table, count};
use crate::status::Status;
use clap::Args;
use manifactor::slam::ros::{Contents, Role};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// List the topics of a recording of ROS 2: types, rates and frames, and how a run can use them.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor inspect drive.mcap")]
pub(crate) struct Inspect {
    /// The recording: an MCAP or SQLite (db3) file, or a folder of such files.
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Inspect {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let contents = Contents::of(&self.file)?;
        let GuessedSource { source, missing, .. } = guess(&contents, &self.file);
        if self.json {
            output::print_json(&json!({
                "file": self.file, "topics": contents.topics, "fault": contents.fault, "source": source, "missing": missing,
            }));
        } else {
            output::print(&Self::text(&contents, &source, &missing));
        }
        if let Some(fault) = &contents.fault {
            output::print_message(&format!("warning: the rest of the recording is not read: {fault}"));
        }
        Ok(Status::Done)
    }

    fn text(contents: &Contents, source: &str, missing: &[String]) -> String {
        let mut table = Table::of_words(&["topic", "messages", "per second", "frame", "use", "type"]);
        let mut faults: BTreeMap<&str, usize> = BTreeMap::new();
        for (name, topic) in &contents.topics {
            let role =
                ROLES.iter().find(|(role, ..)| Some(*role) == topic.role).map(|(_, setting, _)| *setting);
            let role = role.or(match topic.role {
                Some(Role::Transforms) => Some("transforms"),
                Some(Role::Imu) => Some("imu"),
                Some(Role::Fixes) => Some("fixes"),
                _ => None,
            });
            table.row([
                name.clone(),
                topic.messages.to_string(),
                format!("{:.1}", topic.rate()),
                topic.frame.clone().unwrap_or_default(),
                role.unwrap_or_default().to_owned(),
                topic.message_type.clone(),
            ]);
            if let Some(fault) = &topic.fault {
                *faults.entry(fault).or_default() += 1;
            }
        }
        let times = contents.topics.values().map(|topic| topic.log_times);
        let span = times.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let seconds = span.map_or(0.0, |[first, last]| last - first);
        let mut text = format!("{}, {seconds:.1} s\n", count(contents.topics.len(), "topic"));
        if !contents.topics.is_empty() {
            let _ = writeln!(text, "{}", table.text());
        }
        for (fault, topics) in faults {
            let _ = writeln!(text, "{} cannot be decoded: {fault}", count(topics, "topic"));
        }
        if missing.len() < ROLES.len() {
            let _ = writeln!(text, "\n{source}");
        }
        for fault in missing {
            let _ = writeln!(text, "missing: {fault}");
        }
        text
    }
}
