//! `manifactor inspect`: lists the topics of a recording.
use crate::failure::Failure;
use crate::output;
use crate::output::text::{Table, count};
use crate::status::Status;
use clap::Args;
use manifactor::slam::ros::{Contents, Role};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

/// List the topics of an MCAP recording: types, rates and frames, and how a run can use them.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor inspect drive.mcap")]
pub(crate) struct Inspect {
    /// The recording.
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Uses of topics, with their setting in the source `mcap`, and the remedy if there is no such topic.
const ROLES: [(Role, &str, &str); 3] = [
    (
        Role::Odometry,
        "odometry",
        "transforms can give them: set `odometry`, `odometry_frame` and `body_frame`",
    ),
    (Role::Detections, "detections", "`detections_file` can name a CSV file of boxes"),
    (Role::CameraInfo, "camera_info", "`camera` can give the camera"),
];

impl Inspect {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let contents = Contents::of(&self.file)?;
        let (source, missing) = self.source(&contents);
        if self.json {
            output::print_json(&json!({
                "file": self.file, "topics": contents.topics, "fault": contents.fault, "source": source, "missing": missing,
            }));
        } else {
            output::print(&self.text(&contents, &source, &missing));
        }
        if let Some(fault) = &contents.fault {
            output::print_message(&format!("warning: the rest of the recording is not read: {fault}"));
        }
        Ok(Status::Done)
    }

    /// Returns the source that a run could have, and what the recording lacks.
    fn source(&self, contents: &Contents) -> (String, Vec<String>) {
        let (mut source, mut missing) = (format!("type = \"mcap\", file = {:?}", self.file), vec![]);
        for (role, setting, instead) in ROLES {
            let topics = contents.with_role(role);
            match topics.iter().max_by_key(|name| contents.topics[**name].messages) {
                Some(topic) => {
                    let _ = write!(source, ", {setting} = {topic:?}");
                }
                None => {
                    missing
                        .push(format!("no topic has messages of {}; {instead}", role.types().join(" or ")));
                }
            }
        }
        (format!("source = {{ {source} }}"), missing)
    }

    fn text(&self, contents: &Contents, source: &str, missing: &[String]) -> String {
        let mut table = Table::of_words(&["topic", "messages", "per second", "frame", "use", "type"]);
        for (name, topic) in &contents.topics {
            let role =
                ROLES.iter().find(|(role, ..)| Some(*role) == topic.role).map(|(_, setting, _)| *setting);
            let role = role.or((topic.role == Some(Role::Transforms)).then_some("transforms"));
            let fault = topic.fault.as_ref().map(|fault| format!(" ({fault})")).unwrap_or_default();
            table.row([
                name.clone(),
                topic.messages.to_string(),
                format!("{:.1}", topic.rate()),
                topic.frame.clone().unwrap_or_default(),
                role.unwrap_or_default().to_owned(),
                format!("{}{fault}", topic.message_type),
            ]);
        }
        let times = contents.topics.values().map(|topic| topic.log_times);
        let span = times.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let seconds = span.map_or(0.0, |[first, last]| last - first);
        let mut text =
            format!("{}, {seconds:.1} s\n{}\n", count(contents.topics.len(), "topic"), table.text());
        let _ = writeln!(text, "\n{source}");
        for fault in missing {
            let _ = writeln!(text, "missing: {fault}");
        }
        text
    }
}
