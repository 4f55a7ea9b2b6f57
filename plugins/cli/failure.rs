//! Failures of a command, and their presentation.
use crate::output::{self, text};
use manifactor::config::{Diagnostic, Diagnostics, Fault, SourceText};
use manifactor::formats::journal::JournalError;
use manifactor::formats::{FormatError, Malformed};
use manifactor::slam::output::{FolderError, OutputError};
use manifactor::slam::ros::BagError;
use manifactor::slam::run::RunError;
use manifactor::slam::source::{McapError, SourceError};
use miette::{LabeledSpan, MietteDiagnostic, NamedSource, Report};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// The reason why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Documents with errors: exit code 2, or 3 if none of them could be read.
    #[error("{0}")]
    Documents(Diagnostics),
    /// Any other error in the input, with its own message: exit code 2.
    #[error("{message}")]
    Input {
        /// The error.
        message: String,
        /// A remedy.
        help: Option<String>,
    },
    /// A folder that does not exist, or does not have the expected files: exit code 3.
    #[error("{message}")]
    NotThere {
        /// The error.
        message: String,
        /// A remedy.
        help: Option<String>,
    },
    /// A file that could not be read or written: exit code 3.
    #[error("{}: {source}", path.display())]
    File {
        /// The path.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
}

impl Failure {
    /// Creates an error of the input.
    pub fn input(error: impl std::fmt::Display) -> Self {
        Self::Input { message: error.to_string(), help: None }
    }

    /// Creates an error of the input, with a remedy.
    pub fn with_help(error: impl std::fmt::Display, help: impl Into<String>) -> Self {
        Self::Input { message: error.to_string(), help: Some(help.into()) }
    }

    /// Returns a function for `map_err` after an access to the file `path`.
    pub fn at(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::File { path: path.to_owned(), source }
    }

    /// The exit code of an invalid command line: 2.
    pub(crate) fn usage() -> u8 {
        2
    }

    /// The exit code of files that could not be read or written: 3.
    pub(crate) fn files() -> u8 {
        3
    }

    /// Returns 2 for invalid input, and 3 for files that do not exist or cannot be read or written.
    pub fn exit_code(&self) -> u8 {
        let unreadable = |one: &Diagnostic| matches!(one.fault, Fault::Unreadable(_));
        match self {
            Self::Documents(list) if list.iter().all(unreadable) => Self::files(),
            Self::Documents(_) | Self::Input { .. } => Self::usage(),
            Self::NotThere { .. } | Self::File { .. } => Self::files(),
        }
    }

    /// Prints the failure on stderr with its source line, and also as JSON on stdout if `as_json` is set.
    pub fn show(&self, as_json: bool) {
        if as_json {
            output::print_json(&self.to_json());
        }
        for report in self.reports() {
            output::print_styled_message(&report);
        }
        if self.omitted() > 0 {
            output::print_message(&format!("and {} more errors", self.omitted()));
        }
    }

    fn to_json(&self) -> Value {
        let errors: Vec<Value> = match self {
            Self::Documents(list) => list.iter().map(place_as_json).collect(),
            Self::Input { message, help } | Self::NotThere { message, help } => {
                vec![json!({ "message": message, "help": help })]
            }
            Self::File { path, source } => {
                vec![json!({ "message": source.to_string(), "file": path.display().to_string() })]
            }
        };
        match self.omitted() {
            0 => json!({ "errors": errors }),
            omitted => json!({ "errors": errors, "omitted": omitted }),
        }
    }

    /// Number of errors beyond those that are listed.
    fn omitted(&self) -> usize {
        match self {
            Self::Documents(list) => list.omitted(),
            _ => 0,
        }
    }

    fn reports(&self) -> Vec<String> {
        match self {
            Self::Documents(list) => list.iter().map(render).collect(),
            Self::Input { message, help } | Self::NotThere { message, help } => {
                vec![fancy(plain(message, help.as_deref()).into())]
            }
            Self::File { .. } => vec![fancy(plain(&self.to_string(), None).into())],
        }
    }
}

impl From<Diagnostics> for Failure {
    fn from(diagnostics: Diagnostics) -> Self {
        Self::Documents(diagnostics)
    }
}

impl From<SourceError> for Failure {
    fn from(error: SourceError) -> Self {
        match error {
            SourceError::Format(error) => error.into(),
            SourceError::Mcap(McapError::Bag(error)) => error.into(),
            SourceError::NoFolder { setting, name, tried, no_data_folder } => {
                no_folder(setting, &name, &tried, no_data_folder)
            }
            other => Self::input(other),
        }
    }
}

impl From<BagError> for Failure {
    fn from(error: BagError) -> Self {
        match error {
            BagError::Io { path, source } => Self::File { path, source },
            other => Self::input(other),
        }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Source(error) => error.into(),
            RunError::Journal(error) => error.into(),
            other => Self::input(other),
        }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        match error {
            OutputError::Io { path, source } => Self::File { path, source },
            other => Self::input(other),
        }
    }
}

impl From<FolderError> for Failure {
    fn from(error: FolderError) -> Self {
        match error {
            FolderError::Io { path, source } => Self::File { path, source },
            FolderError::InUse { .. } => Self::with_help(
                error,
                "wait until that command has ended, or choose another folder with --out",
            ),
            other => Self::with_help(
                other,
                "choose another folder with --out, or write into this one with --force, which overwrites files with the same names",
            ),
        }
    }
}

impl From<JournalError> for Failure {
    fn from(error: JournalError) -> Self {
        match error {
            JournalError::Io { path, source } => Self::File { path, source },
            other => Self::input(other),
        }
    }
}

impl From<FormatError> for Failure {
    fn from(error: FormatError) -> Self {
        match error {
            FormatError::Io { path, source } => Self::File { path, source },
            FormatError::Malformed(malformed) => Self::Documents(places(malformed)),
            other => Self::input(other),
        }
    }
}

/// Largest number of searched folders that are listed.
const LISTED: usize = 3;

/// The error of a data set that is in none of the folders `tried`.
fn no_folder(setting: &str, name: &Path, tried: &[PathBuf], no_data_folder: bool) -> Failure {
    let mut searched: Vec<String> =
        tried.iter().take(LISTED).map(|path| path.display().to_string()).collect();
    if tried.len() > LISTED {
        searched.push(format!("and {} more", tried.len() - LISTED));
    }
    let help = match no_data_folder {
        _ if name.is_absolute() => format!("correct `{setting}`"),
        true => format!(
            "correct `{setting}`, or give the folder of the data sets with --data DIR or the environment variable MANIFACTOR_DATA"
        ),
        false => format!("correct `{setting}`, or the folder given by --data or MANIFACTOR_DATA"),
    };
    let (name, searched) = (name.display(), searched.join(", "));
    let message = format!("there is no folder `{name}`, which `{setting}` names; searched: {searched}");
    Failure::NotThere { message, help: Some(help) }
}

/// The remedy for a diagnostic: its own, or one that needs the text of the document.
fn help(diagnostic: &Diagnostic) -> Option<String> {
    let is_axis = |known: &[String]| known.iter().map(String::as_str).eq(["name", "options"]);
    match &diagnostic.fault {
        Fault::WrongType { expected, found } if expected == "an array" && found == "a table" => {
            // a header of TOML
            let line = diagnostic.place.source.text().lines().nth(diagnostic.line().saturating_sub(1));
            let header = line.and_then(|line| line.trim_start().strip_prefix('['));
            let name = header.and_then(|header| header.split_once(']')).map(|(name, _)| name);
            name.map(|name| format!("write `[[{name}]]`: each entry of the array is a table"))
        }
        Fault::UnknownField { known, .. } if is_axis(known) => Some(
            "an axis has `columns` and `rows`, or `name` and `options`; see `manifactor explain axes`"
                .to_owned(),
        ),
        _ => None,
    }
    .or_else(|| diagnostic.help())
}

/// Converts the malformed lines of a file to diagnostics with their positions.
fn places(mut malformed: Malformed) -> Diagnostics {
    let text = std::mem::take(&mut malformed.text);
    let source = SourceText::new(malformed.path.display().to_string(), text);
    let text = source.text();
    let mut list: Vec<_> = malformed
        .problems
        .iter()
        .map(|problem| {
            // the first word is enough to mark a line; line 0 means the whole file
            let before = text.split_inclusive('\n').take(problem.line.saturating_sub(1)).map(str::len).sum();
            let rest = text.get(before..).unwrap_or_default();
            let indent = rest.len() - rest.trim_start_matches([' ', '\t']).len();
            let word = rest.split_whitespace().next().unwrap_or_default().len();
            let place = source.place(before + indent..before + indent + word);
            Diagnostic::new(place, Fault::invalid(problem.mistake.to_string()))
        })
        .collect();
    if malformed.more > 0 {
        let more = format!("and {} more lines are wrong", malformed.more);
        list.push(Diagnostic::new(source.place(text.len()..text.len()), Fault::invalid(more)));
    }
    let nothing = || Diagnostic::new(source.place(0..0), Fault::invalid(malformed.to_string()));
    Diagnostics::from_list(list).unwrap_or_else(|| nothing().into())
}

fn place_as_json(diagnostic: &Diagnostic) -> Value {
    json!({
        "message": diagnostic.message(),
        "help": help(diagnostic),
        "file": diagnostic.place.source.name(),
        "line": diagnostic.line(),
        "column": diagnostic.column(),
    })
}

/// Formats a warning together with its source line.
pub(crate) fn render(diagnostic: &Diagnostic) -> String {
    let source = &diagnostic.place.source;
    let help = help(diagnostic);
    let message = plain(&diagnostic.message(), help.as_deref());
    if source.text().is_empty() {
        // a file that could not be read has no line to show
        return fancy(plain(&format!("{}: {}", source.name(), diagnostic.message()), help.as_deref()).into());
    }
    let around = lines_around(source.text(), &diagnostic.place.span());
    if around.split('\n').any(|line| line.len() > LONG) {
        let at = format!("{}: {}", diagnostic.place, diagnostic.message());
        return fancy(plain(&at, help.as_deref()).into());
    }
    let mut labels = vec![LabeledSpan::underline(diagnostic.place.span())];
    let mut message = message;
    if let Some((place, label)) = &diagnostic.related {
        if place.source == *source {
            labels.push(LabeledSpan::at(place.span(), text::shortened(label)));
        } else {
            message.message += &text::shortened(&format!("; {label}: {place}"));
        }
    }
    let report = Report::from(message.with_labels(labels));
    let name = text::on_one_line(source.name());
    fancy(report.with_source_code(NamedSource::new(name, text::same_length(source.text()))))
}

/// Longest line that is shown. For a longer one, position and message are more useful. Unit: bytes.
const LONG: usize = 500;

/// The lines of a span, and one line before and after it.
fn lines_around<'a>(text: &'a str, span: &std::ops::Range<usize>) -> &'a str {
    let line = |end: usize| text.get(..end).and_then(|before| before.rfind('\n')).unwrap_or(0);
    let begin = line(line(span.start.min(text.len())));
    let after = text.get(span.end.min(text.len())..).unwrap_or_default();
    let rest = after.match_indices('\n').nth(1).map_or(after.len(), |(at, _)| at);
    text.get(begin..text.len() - after.len() + rest).unwrap_or_default()
}

fn plain(message: &str, help: Option<&str>) -> MietteDiagnostic {
    let diagnostic = MietteDiagnostic::new(text::shortened(message));
    match help {
        Some(help) => diagnostic.with_help(text::shortened(help)),
        None => diagnostic,
    }
}

/// Colours on a terminal; plain text in files and pipes.
#[expect(clippy::needless_pass_by_value, reason = "it is shown and done with")]
fn fancy(report: Report) -> String {
    let theme = match std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none() {
        true => miette::GraphicalTheme::unicode(),
        false => miette::GraphicalTheme::unicode_nocolor(),
    };
    let handler = miette::GraphicalReportHandler::new_themed(theme).with_width(110);
    let mut text = String::new();
    match handler.render_report(&mut text, report.as_ref()) {
        Ok(()) => text.trim_end().to_owned(),
        Err(_) => format!("{report}"),
    }
}
