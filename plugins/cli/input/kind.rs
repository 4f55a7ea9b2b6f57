//! Kinds of input files. A command that gets a file of a different kind names the command that takes it.
use crate::failure::Failure;
use crate::output::text::on_one_line;
use manifactor::config::{Document, Value};
use manifactor::formats::{GraphFormat, STDIN};
use manifactor::slam::ros::is_recording;
use std::path::Path;

/// The kind of a file or folder, as far as its content shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InputKind {
    /// A literal graph.
    Graph,
    /// A graph in a format for pose graphs or bundle adjustment.
    GraphText,
    /// The document of a run.
    Run,
    /// The document of a visual-inertial recording.
    VisualInertial,
    /// The document of an experiment.
    Experiment,
    /// A file of semantic rules.
    Rules,
    /// Frames as lines of JSON, for the source `json_lines`.
    Frames,
    /// A trajectory in the TUM format.
    Trajectory,
    /// Detections as CSV.
    Detections,
    /// The folder that a run has written.
    RunFolder,
    /// The folder of one variant of a run.
    VariantFolder,
    /// A folder for the source `recorded`.
    Recording,
    /// A recording of ROS 2, for the source `mcap`.
    Mcap,
}

impl InputKind {
    /// Returns the kind of a document by its top-level fields; `None` if they do not show it.
    pub(crate) fn of_document(document: &Document) -> Option<Self> {
        let has = |field| matches!(&document.root().value, Value::Table(table) if table.contains_key(field));
        // a run may have variables and factors too
        match () {
            () if has("imu") && has("tracks") => Some(Self::VisualInertial),
            () if has("source") => Some(Self::Run),
            () if has("axes") => Some(Self::Experiment),
            () if has("variables") || has("factors") => Some(Self::Graph),
            () if has("base") => Some(Self::Experiment),
            () if has("variants") => Some(Self::Run),
            () if has("semantics") => Some(Self::Rules),
            () => None,
        }
    }

    /// Returns the kind of a file that is no text, by its extension, or of a folder of such files; `None` for others.
    pub(crate) fn of_path(path: &Path) -> Option<Self> {
        let is_of_ros_1 = path.extension().is_some_and(|extension| extension == "bag");
        (is_of_ros_1 || is_recording(path)).then_some(Self::Mcap)
    }

    /// Returns the kind of a text that is no document; `None` if neither the extension of `path` nor the
    /// first lines show it.
    pub(crate) fn of_text(path: &Path, text: &str) -> Option<Self> {
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        let first = lines.next().unwrap_or_default();
        let is_frame =
            |line: &str| line.starts_with('{') && line.ends_with('}') && line.contains("\"timestamp\"");
        let numbers = || first.split_whitespace().filter(|word| word.parse::<f64>().is_ok()).count();
        let has_column = |name| first.split(',').any(|column| column.trim() == name);
        match () {
            () if GraphFormat::by_extension(path).is_some() => Some(Self::GraphText),
            () if is_frame(first) => Some(Self::Frames),
            () if has_column("timestamp") && has_column("xmin") => Some(Self::Detections),
            () if first.split_whitespace().count() == 8 && numbers() == 8 => Some(Self::Trajectory),
            () if GraphFormat::detect(path, text).is_some() => Some(Self::GraphText),
            () => None,
        }
    }

    /// Returns the kind of a folder by its files; `None` if they do not show it.
    pub(crate) fn of_folder(folder: &Path) -> Option<Self> {
        let has = |file| folder.join(file).is_file();
        match () {
            () if has("record.json") => Some(Self::RunFolder),
            () if has("graph.json") => Some(Self::VariantFolder),
            () if GraphFormat::of_folder(folder).is_some() => Some(Self::GraphText),
            () if has("odometry.txt") || has("detections.csv") => Some(Self::Recording),
            () => None,
        }
    }

    /// The kind in words, such as `a graph`.
    fn name(self) -> &'static str {
        match self {
            Self::Graph | Self::GraphText => "a graph",
            Self::Run => "the document of a run",
            Self::VisualInertial => "the document of a visual-inertial recording",
            Self::Experiment => "the document of an experiment",
            Self::Rules => "a file of semantic rules",
            Self::Frames => "frames as lines of JSON",
            Self::Trajectory => "a trajectory in the TUM format",
            Self::Detections => "a table of detections",
            Self::RunFolder => "the folder of a run",
            Self::VariantFolder => "the folder of a variant of a run",
            Self::Recording => "a recording",
            Self::Mcap => "a recording of ROS",
        }
    }

    /// The command that takes the file.
    fn remedy(self, path: &Path) -> String {
        let path = path.display();
        match self {
            Self::Graph | Self::GraphText => {
                format!("`manifactor solve {path}` solves it, `manifactor graph {path}` lists its factors")
            }
            Self::Run => format!(
                "`manifactor run {path}` computes it and writes the graph of each variant, `manifactor check {path}` checks it"
            ),
            Self::VisualInertial => format!("`manifactor vio {path}` estimates its motion"),
            Self::Experiment => {
                format!("`manifactor experiment {path}` runs it, `manifactor check {path}` checks it")
            }
            Self::Rules => format!("name it in the document of a run: semantics = \"{path}\""),
            Self::Frames => "frames are the input of a run with `source = { type = \"json_lines\", … }`: \
                             `manifactor online RUN.toml` reads them from standard input; see `manifactor explain json_lines`"
                .to_owned(),
            Self::Trajectory => format!(
                "`manifactor evaluate TRUTH {path}` compares it with the true trajectory; a run reads a trajectory with the \
                 source `recorded`, see `manifactor explain recorded`"
            ),
            Self::Detections => format!(
                "a run reads detections with the source `recorded`, see `manifactor explain recorded`; `manifactor evaluate \
                 --boxes TRUTH {path}` compares their objects"
            ),
            Self::RunFolder => format!(
                "`manifactor plot {path}` draws its pictures; the graph is in the folder of a variant: `manifactor graph \
                 {path}/VARIANT`"
            ),
            Self::VariantFolder => format!(
                "`manifactor graph {path}` lists the factors of its graph, `manifactor solve {path}/graph.json` solves it, and \
                 `manifactor plot` takes the folder of the run"
            ),
            Self::Recording => format!(
                "`manifactor run RUN.toml` maps it, if RUN.toml has `source = {{ type = \"recorded\", folder = \"{path}\", … }}`; \
                 see `manifactor explain recorded`"
            ),
            Self::Mcap => format!(
                "`manifactor run {path}` maps it, `manifactor inspect {path}` lists its topics"
            ),
        }
    }

    /// Returns the error of a command that got this kind and not `expected`.
    pub(crate) fn refused(self, path: &Path, expected: &str) -> Failure {
        let name =
            if path == Path::new(STDIN) { "standard input".into() } else { path.display().to_string() };
        let message = format!("{} is {}; expected {expected}", on_one_line(&name), self.name());
        Failure::with_help(message, self.remedy(path))
    }
}

/// The kinds of input that a command accepts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Expected {
    /// The kinds in words, for errors.
    name: &'static str,
    kinds: &'static [InputKind],
}

/// Input of `run`, `online` and `simulate`.
pub(crate) const RUN: Expected = Expected { name: "the document of a run", kinds: &[InputKind::Run] };
/// Input of `vio`.
pub(crate) const VIO: Expected =
    Expected { name: "the document of a visual-inertial recording", kinds: &[InputKind::VisualInertial] };
/// Input of `experiment`.
pub(crate) const EXPERIMENT: Expected =
    Expected { name: "the document of an experiment", kinds: &[InputKind::Experiment] };
/// Input of `solve`, `replay` and `graph`.
pub(crate) const GRAPH: Expected =
    Expected { name: "a graph", kinds: &[InputKind::Graph, InputKind::GraphText] };
/// Input of `check-factor --config`.
pub(crate) const LITERAL_GRAPH: Expected =
    Expected { name: "a literal graph (.toml, .json or .yaml)", kinds: &[InputKind::Graph] };
/// Input of `check`.
pub(crate) const CHECKED: Expected = Expected {
    name: "the document of a run or an experiment, or a graph",
    kinds: &[InputKind::Run, InputKind::Experiment, InputKind::Graph, InputKind::GraphText],
};
/// Input of `evaluate`.
pub(crate) const TRAJECTORY: Expected =
    Expected { name: "a trajectory in the TUM format", kinds: &[InputKind::Trajectory] };
/// Input of `evaluate --boxes`.
pub(crate) const DETECTIONS: Expected =
    Expected { name: "a table of detections (CSV)", kinds: &[InputKind::Detections] };
/// Input of `learn`.
pub(crate) const MAP: Expected = Expected { name: "the map of a run, map.json", kinds: &[] };
/// Input of `plot`.
pub(crate) const RUN_FOLDER: Expected =
    Expected { name: "the folder of a run, with record.json", kinds: &[InputKind::RunFolder] };

impl Expected {
    /// Returns an error if the kind is known and not accepted.
    pub(crate) fn check(self, path: &Path, kind: Option<InputKind>) -> Result<(), Failure> {
        match kind.filter(|kind| !self.kinds.contains(kind)) {
            Some(kind) => Err(kind.refused(path, self.name)),
            None => Ok(()),
        }
    }

    /// Returns an error if `path` is a folder.
    pub(crate) fn refuse_folder(self, path: &Path) -> Result<(), Failure> {
        if !path.is_dir() {
            return Ok(());
        }
        Err(match InputKind::of_folder(path) {
            Some(kind) => kind.refused(path, self.name),
            None if path.join("images.bin").is_file() => {
                let message =
                    format!("{} is a COLMAP model in its binary form; expected text", path.display());
                let help = "`colmap model_converter --input_path IN --output_path OUT --output_type TXT` converts it";
                Failure::with_help(message, help)
            }
            None => {
                let message = format!("{} is a folder; expected {}", path.display(), self.name);
                Failure::NotThere { message, help: Some("give a file".to_owned()) }
            }
        })
    }

    /// Returns an error if `path` is no folder, or a folder of a different kind.
    pub(crate) fn check_folder(self, path: &Path) -> Result<(), Failure> {
        if path.is_dir() {
            self.check(path, InputKind::of_folder(path))?;
        } else if let Ok(document) = Document::open(path) {
            self.check(path, InputKind::of_document(&document))?;
        }
        let fault = match () {
            () if path.join("record.json").exists() => return Ok(()),
            () if path.is_dir() => "the folder has no record.json, so it is not the folder of a run",
            () if path.exists() => "this is a file; expected the folder of a run",
            () => "there is no such folder",
        };
        let help = "`manifactor run RUN.toml --out FOLDER` writes the folder of a run".to_owned();
        Err(Failure::NotThere { message: format!("{}: {fault}", path.display()), help: Some(help) })
    }

    /// Returns whether graphs in text formats are accepted.
    pub(crate) fn has_graph_texts(self) -> bool {
        self.kinds.contains(&InputKind::GraphText)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor::config::Format;

    #[test]
    fn documents_are_distinguished_by_their_fields() {
        let kind = |text: &str| InputKind::of_document(&Document::parse("t", text, Format::Toml).unwrap());
        assert_eq!(kind("source = {}\nvariables = []\nsemantics = []"), Some(InputKind::Run));
        assert_eq!(kind("base = 'b.toml'\naxes = []"), Some(InputKind::Experiment));
        assert_eq!(kind("base = 'b.toml'"), Some(InputKind::Experiment));
        assert_eq!(kind("factors = []"), Some(InputKind::Graph));
        assert_eq!(kind("semantics = []"), Some(InputKind::Rules));
        assert_eq!(kind("title = 'nothing'"), None);
    }

    #[test]
    fn texts_are_distinguished_by_their_first_lines() {
        let kind = |name: &str, text: &str| InputKind::of_text(Path::new(name), text);
        assert_eq!(kind("a.g2o", "nonsense"), Some(InputKind::GraphText));
        assert_eq!(kind("-", "VERTEX_SE2 0 0 0 0\n"), Some(InputKind::GraphText));
        assert_eq!(kind("a.txt", "# t\n\n1.0 0 0 0 0 0 0 1\n"), Some(InputKind::Trajectory));
        assert_eq!(kind("a.csv", "timestamp, xmin,ymin\n"), Some(InputKind::Detections));
        assert_eq!(kind("-", "{\"timestamp\": 1, \"boxes\": []}\n{}"), Some(InputKind::Frames));
        assert_eq!(kind("a.txt", "a b c"), None);
    }
}
