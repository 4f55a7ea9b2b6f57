//! Execution of a run document, up to its report.
use crate::output::report::{AssociationReport, FoundStart, HeldOutReport, RunReport, VariantReport};
use association::{AssociatedSequence, associate_sequence};
use location::find_start;
use manifactor_formats::journal::JournalError;
use manifactor_mapping::estimate::{Estimate, EstimateError};
use manifactor_mapping::mapping::{Mapping, MappingError};
use manifactor_mapping::settings::RunSettings;
use manifactor_mapping::settings::run_document::{RunDocument, RunVariant};
use manifactor_online::{FinishError, FrameError};
use manifactor_recording::journal::journaled;
use manifactor_recording::sequence::{Detection, Sequence};
use manifactor_recording::source::{InputFolders, SourceError};
use manifactor_solve::{Observer, Termination};
use std::borrow::Cow;
use std::fmt;
use std::io::BufRead;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

mod association;
mod jump;
mod location;
mod noise;
mod state;
mod stream;

pub use stream::{MappedFrame, StreamEvent, StreamWatcher, online};

/// Reason why a variant could not be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The sequence cannot be loaded.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The graph cannot be created.
    #[error(transparent)]
    Mapping(#[from] MappingError),
    /// The graph cannot be solved.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// The journal cannot be written or read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The journal lies in the folder of the results.
    #[error(
        "the journal {} lies in {}, where the run writes its results: name a file outside of that folder",
        path.display(), output.display()
    )]
    JournalAmongResults {
        /// Path of the journal.
        path: PathBuf,
        /// Folder of the results.
        output: PathBuf,
    },
    /// A journal for a run with several variants.
    #[error("a journal is that of one variant: name another document, or leave all others out")]
    JournalOfVariants,
    /// Frames from a program for a run with several variants.
    #[error(
        "frames that a program gives are those of one variant: name another document, or leave all others out"
    )]
    FramesOfVariants,
    /// Frames from a program for a source that does not read lines.
    #[error("frames that a program gives need `source.type = \"json_lines\"`, got `{source_type}`")]
    NoLines {
        /// Type of the source.
        source_type: &'static str,
    },
    /// Data association rejected every frame.
    #[error("no frame can be mapped, all are rejected; the first: {0}")]
    NoFrameMapped(FrameError),
    /// The map of a stream cannot be finished.
    #[error(transparent)]
    Finish(#[from] FinishError),
}

/// A sequence with its graph, before the solve.
#[derive(Debug)]
pub struct MappedSequence<'a> {
    /// The sequence with the assigned objects of its boxes.
    pub sequence: Arc<Sequence>,
    /// The graph.
    pub mapping: Mapping,
    /// The settings of the graph. If the start pose in a prior map was found, they include it.
    pub settings: Cow<'a, RunSettings>,
    /// Report of the data association.
    pub association: Option<AssociationReport>,
    /// The start pose in the prior map, if it was searched and found.
    pub found: Option<FoundStart>,
    /// Boxes that were held out of the graph for evaluation.
    pub held_out: Vec<Detection>,
}

impl<'a> MappedSequence<'a> {
    /// Finds the start pose in the prior map of the settings, assigns the boxes to objects, and creates the
    /// graph.
    ///
    /// # Errors
    /// If the graph cannot be created.
    pub fn new(
        sequence: Arc<Sequence>,
        settings: &'a RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, RunError> {
        let found = find_start(&sequence, settings, observer)?;
        let settings = match &found {
            Some(FoundStart { located, .. }) => {
                Cow::Owned(settings.with_start(located.start, located.noise.clone()))
            }
            None => Cow::Borrowed(settings),
        };
        let AssociatedSequence { mut sequence, report: association } =
            associate_sequence(sequence, &settings, observer)?;
        let held_out = match settings.evaluation.holdout {
            Some(holdout) => holdout.take_from(Arc::make_mut(&mut sequence)),
            None => vec![],
        };
        let mapping = Mapping::new(&sequence, &settings)?;
        Ok(Self { sequence, mapping, settings, association, found, held_out })
    }
}

/// Maps, solves and evaluates a sequence.
///
/// # Errors
/// If the graph cannot be created. Numerical problems are not errors: see the report.
pub fn estimate(
    name: &str,
    sequence: Arc<Sequence>,
    settings: &RunSettings,
    observer: &mut dyn Observer,
) -> Result<(Estimate, VariantReport), RunError> {
    let clock = Instant::now();
    let MappedSequence { sequence, mapping, settings: begun, association, found, held_out } =
        MappedSequence::new(sequence, settings, observer)?;
    let estimate = Estimate::new(sequence, mapping, &begun, observer)?.check_extrinsics(&begun, observer)?;
    let mut report = VariantReport::new(name, &estimate, settings, 0.0);
    report.association = association;
    report.held_out = HeldOutReport::new(&estimate, &held_out, settings);
    report.set_prior_map_report(&estimate, settings, found);
    report.seconds = clock.elapsed().as_secs_f64();
    Ok((estimate, report))
}

/// A run in progress. It loads each sequence once for all variants that share it.
#[derive(Debug)]
pub struct Run<'a> {
    /// The run document.
    pub document: &'a RunDocument,
    folders: InputFolders,
    loaded: Vec<(String, Arc<Sequence>)>,
    journal: Option<PathBuf>,
    reader: Option<Reader>,
    began: Instant,
    reports: Vec<VariantReport>,
}

/// Lines of a stream, in place of those of the source.
struct Reader {
    name: String,
    lines: Box<dyn BufRead + Send>,
}

impl fmt::Debug for Reader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reader").field("name", &self.name).finish_non_exhaustive()
    }
}

impl<'a> Run<'a> {
    /// Starts a run. `data` is the folder of public data sets.
    pub fn new(document: &'a RunDocument, data: Option<PathBuf>) -> Self {
        let folders = InputFolders { data, document: document.folder.clone() };
        Self {
            document,
            folders,
            loaded: vec![],
            journal: None,
            reader: None,
            began: Instant::now(),
            reports: vec![],
        }
    }

    /// Keeps the frames of a stream in a file, and begins with those that it has; see
    /// [`journal`](manifactor_recording::journal).
    pub fn journal_frames(&mut self, journal: PathBuf) {
        self.journal = Some(journal);
    }

    /// Reads the frames of a stream from `reader`, in place of the file that the source names. `name` is its name in
    /// messages.
    pub fn read_frames_from(&mut self, name: impl Into<String>, reader: Box<dyn BufRead + Send>) {
        self.reader = Some(Reader { name: name.into(), lines: reader });
    }

    /// Checks that the input files of a variant exist, without reading them.
    ///
    /// # Errors
    /// The first folder or file that does not exist.
    pub fn find_files(&self, variant: &RunVariant) -> Result<Vec<PathBuf>, SourceError> {
        variant.settings.source.find_files(&self.folders)
    }

    /// Returns the sequence of a variant.
    ///
    /// # Errors
    /// If its source has no sequence.
    pub fn sequence(&mut self, variant: &RunVariant) -> Result<Arc<Sequence>, SourceError> {
        let source = &variant.settings.source;
        // sources with equal settings are equal
        let name = serde_json::to_string(source).unwrap_or_default();
        if let Some((_, sequence)) = self.loaded.iter().find(|(known, _)| *known == name && !name.is_empty())
        {
            return Ok(sequence.clone());
        }
        let sequence = Arc::new(source.load(&self.folders)?);
        self.loaded.push((name, sequence.clone()));
        Ok(sequence)
    }

    /// Maps, solves and evaluates one variant.
    ///
    /// # Errors
    /// If there is no data, or the graph cannot be created. Numerical problems are not errors: see the
    /// report.
    pub fn run_variant(
        &mut self,
        variant: &RunVariant,
        observer: &mut dyn Observer,
    ) -> Result<(Estimate, VariantReport), RunError> {
        let clock = Instant::now();
        let sequence = self.sequence(variant)?;
        let done = estimate(&variant.name, sequence, &variant.settings, observer)?;
        Ok(self.journal_stream(variant, done, clock))
    }

    /// Runs one variant frame by frame; see [`online`].
    ///
    /// # Errors
    /// If there is no data, or the graph cannot be created.
    pub fn run_variant_online(
        &mut self,
        variant: &RunVariant,
        watch: &mut dyn StreamWatcher,
    ) -> Result<(Estimate, VariantReport), RunError> {
        let clock = Instant::now();
        let source = &variant.settings.source;
        let stream = match self.reader.take() {
            Some(_) if self.document.variants.len() > 1 => return Err(RunError::FramesOfVariants),
            Some(Reader { name, lines }) => {
                let stream = source.open_reader(&self.folders, &name, lines)?;
                stream.ok_or_else(|| RunError::NoLines { source_type: source.typetag_name() })?
            }
            None => match source.open(&self.folders)? {
                Some(stream) => stream,
                None => self.sequence(variant)?.into(),
            },
        };
        let stream = match &self.journal {
            Some(_) if self.document.variants.len() > 1 => return Err(RunError::JournalOfVariants),
            Some(path) => journaled(stream, path, &variant.settings.fingerprint())?,
            None => stream,
        };
        let done = online(&variant.name, stream, &variant.settings, watch)?;
        Ok(self.journal_stream(variant, done, clock))
    }

    fn journal_stream(
        &mut self,
        variant: &RunVariant,
        (estimate, mut report): (Estimate, VariantReport),
        clock: Instant,
    ) -> (Estimate, VariantReport) {
        report.about.clone_from(&variant.about);
        report.seconds = clock.elapsed().as_secs_f64();
        self.reports.push(report.clone());
        (estimate, report)
    }

    /// Returns the report on all variants that were run.
    pub fn finish(self) -> RunReport {
        let ended = |report: &VariantReport| {
            let interrupted = report.online.as_ref().is_some_and(|online| online.interrupted);
            !interrupted && report.solve.termination != Termination::Interrupted
        };
        let complete = self.reports.len() == self.document.variants.len() && self.reports.iter().all(ended);
        RunReport {
            version: env!("CARGO_PKG_VERSION"),
            title: self.document.title.clone(),
            complete,
            variants: self.reports,
            seconds: self.began.elapsed().as_secs_f64(),
        }
    }
}
