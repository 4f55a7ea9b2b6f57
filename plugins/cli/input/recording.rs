//! Runs of a recording without a document: the settings are guessed from its topics.
use crate::failure::Failure;
use crate::output;
use manifactor::config::{Document, Format};
use manifactor::slam::camera::is_name_character;
use manifactor::slam::ros::{Contents, Role, TopicContents};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Uses of topics, with their setting in the source `mcap`, and the remedy if there is no such topic.
pub(crate) const ROLES: [(Role, &str, &str); 3] = [
    (
        Role::Odometry,
        "odometry",
        "transforms can give them: set `odometry`, `odometry_frame` and `body_frame`",
    ),
    (Role::Detections, "detections", "`detections_file` can name a CSV file of boxes"),
    (Role::CameraInfo, "camera_info", "`camera` can give the camera"),
];

/// Frames of ROS in which z points up (REP 103 and 105).
const LEVEL_FRAMES: [&str; 3] = ["odom", "map", "world"];

/// Settings of a run of a recording.
pub(crate) struct GuessedSource {
    /// The source as a line of TOML.
    pub source: String,
    /// Sentences on data that the recording lacks.
    pub missing: Vec<String>,
    /// Whether z of the odometry frame points up.
    pub is_level: bool,
}

/// Guesses how a run can use the topics of a recording. `file` is its path in the source.
pub(crate) fn guess(contents: &Contents, file: &Path) -> GuessedSource {
    let mut guessed = GuessedSource {
        source: format!("type = \"mcap\", file = {:?}", file.display().to_string()),
        missing: vec![],
        is_level: false,
    };
    let mut camera_frame = None;
    for (role, setting, instead) in ROLES {
        let topics = contents.with_role(role);
        // a recording often has several poses: the one with most messages has the highest rate
        let most = topics.iter().copied().max_by_key(|(name, topic)| (topic.messages, Reverse(*name)));
        // a calibration is that of the camera of the boxes
        let of_boxes = camera_frame.and_then(|frame| calibration(contents, frame));
        let Some((name, topic)) = of_boxes.filter(|_| role == Role::CameraInfo).or(most) else {
            guessed
                .missing
                .push(format!("no topic has messages of {}; {instead}", role.types().join(" or ")));
            continue;
        };
        let _ = write!(guessed.source, ", {setting} = {name:?}");
        let frame = topic.frame.as_deref().unwrap_or_default();
        if role == Role::Detections {
            camera_frame = topic.frame.as_deref();
        }
        guessed.is_level |= role == Role::Odometry && LEVEL_FRAMES.contains(&frame.trim_start_matches('/'));
    }
    if let Some(first) = camera_frame {
        guessed.source += &further_cameras(contents, first);
    }
    if guessed.is_level {
        guessed.source += ", up = [0.0, 0.0, 1.0]";
    }
    guessed.source = format!("source = {{ {} }}", guessed.source);
    guessed
}

/// Returns the topic with the calibration of the camera with this frame.
fn calibration<'a>(contents: &'a Contents, frame: &str) -> Option<(&'a str, &'a TopicContents)> {
    let mut all = contents.with_role(Role::CameraInfo).into_iter();
    all.find(|(_, topic)| topic.frame.as_deref() == Some(frame))
}

/// Returns the setting for further cameras: topics of boxes in another frame than `first` that has a calibration.
fn further_cameras(contents: &Contents, first: &str) -> String {
    let mut cameras = BTreeMap::new();
    for (boxes, topic) in contents.with_role(Role::Detections) {
        let Some(frame) = topic.frame.as_deref().filter(|frame| *frame != first) else { continue };
        let Some((info, _)) = calibration(contents, frame) else { continue };
        let name: String = frame.chars().map(|c| if is_name_character(c) { c } else { '_' }).collect();
        let settings = format!("{name} = {{ detections = {boxes:?}, camera_info = {info:?} }}");
        cameras.entry(name).or_insert(settings);
    }
    match cameras.is_empty() {
        true => String::new(),
        false => format!(", cameras = {{ {} }}", cameras.into_values().collect::<Vec<_>>().join(", ")),
    }
}

/// Returns the document of a run of a recording, and prints the guesses.
pub(crate) fn document(path: &Path) -> Result<Document, Failure> {
    let contents = Contents::of(path)?;
    // `.` has no name
    let whole = path.canonicalize().ok().filter(|_| path.file_name().is_none());
    let path = whole.as_deref().unwrap_or(path);
    let name = path.file_name().unwrap_or_default();
    let GuessedSource { source, is_level, .. } = guess(&contents, Path::new(name));
    let title = path.file_stem().unwrap_or_default().to_string_lossy();
    let semantics = if is_level { "semantics = \"resting\"\n" } else { "" };
    output::print_message(&format!("guessed from the topics: {source}"));
    let text = format!(
        "title = {title:?}\nassociation = {{ type = \"likelihood\" }}\nvariance_components = {{}}\n{semantics}{source}\n\n\
         [detections]\nloss = {{ type = \"cauchy\", scale = 2.8 }}\n"
    );
    Ok(Document::parse(path.display().to_string(), text, Format::Toml)?)
}
