//! A run from its document to its report.
use crate::estimate::{Estimate, EstimateError};
use crate::input::journal::{JournalError, journaled};
use crate::input::sequence::{Observation, Sequence};
use crate::input::source::{Folders, SourceError};
use crate::input::stream::Stream;
use crate::mapping::{Mapping, MappingError};
use crate::online::{FinishError, FrameError, FrameReport, Mapper};
use crate::output::report::{AssociationReport, Naming, OnlineReport, RunReport, VariantReport};
use crate::settings::Settings;
use crate::settings::run_document::{RunDocument, Variant};
use manifactor_solve::{Observer, SettingError, Termination};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Why a variant could not be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// There is no sequence.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// There is no graph.
    #[error(transparent)]
    Mapping(#[from] MappingError),
    /// The graph cannot be solved.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A setting of the session is outside its domain.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// Frames that cannot be kept.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A map that came frame by frame has no end.
    #[error(transparent)]
    Finish(#[from] FinishError),
}

/// Maps, solves and evaluates a sequence.
///
/// # Errors
/// Where no graph can be made of it. Numerical trouble is no error: see the report.
pub fn estimate(
    name: &str,
    sequence: Arc<Sequence>,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<(Estimate, VariantReport), RunError> {
    let clock = Instant::now();
    let (sequence, association) = associated(sequence, settings, observer)?;
    let mapping = Mapping::new(&sequence, settings)?;
    let estimate = Estimate::new(sequence, mapping, settings, observer)?;
    let mut report = VariantReport::new(name, &estimate, settings, 0.0);
    report.association = association;
    report.seconds = clock.elapsed().as_secs_f64();
    Ok((estimate, report))
}

/// The sequence with its boxes put to objects by the settings' `association`: frame by frame, as they would have come, then once more
/// by what is known in the end. Frames that cannot be mapped so, and those after an interruption by `observer`, have boxes of no
/// object.
///
/// # Errors
/// Where the session cannot begin.
pub fn associated(
    sequence: Arc<Sequence>,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<(Arc<Sequence>, Option<AssociationReport>), RunError> {
    if settings.association.uses_names() {
        return Ok((sequence, None));
    }
    let mut mapper = Mapper::new(sequence.opening(), settings)?;
    let (mut named, mut naming) = (Sequence::clone(&sequence), Naming::default());
    let mut taken = vec![];
    let mut interrupted = false;
    for observation in sequence.observations() {
        interrupted |= observer.poll().is_break();
        if interrupted {
            naming.note(&observation.detections, &[]);
            taken.push(None);
            continue;
        }
        match mapper.take(&observation) {
            Ok(report) => {
                naming.note(&observation.detections, &report.names);
                naming.forget(&report.forgotten);
                report.refused.iter().for_each(|refused| tracing::warn!("{refused}"));
                taken.push(Some(report.frame));
            }
            Err(error) => {
                tracing::warn!("{error}");
                naming.note(&observation.detections, &[]);
                taken.push(None);
            }
        }
    }
    let mut first = 0;
    for (observation, frame) in sequence.observations().zip(taken) {
        let boxes = first..first + observation.detections.len();
        first = boxes.end;
        if let Some(frame) = frame {
            naming.replace(boxes, mapper.names(), |names| mapper.reconsider(frame, &observation, names));
        }
    }
    for (detection, name) in named.detections.iter_mut().zip(naming.now(mapper.names())) {
        detection.object = name;
    }
    Ok((Arc::new(named), naming.report(&*settings.association, mapper.names())))
}

/// Maps a stream frame by frame, solves all of it at the end, and evaluates. `watch` is told of each frame, with the map and
/// the seconds that it took; it can end the stream there.
///
/// # Errors
/// Where the session cannot begin, or no graph can be made in the end. Frames that are refused are told to `watch`.
pub fn online(
    name: &str,
    stream: Stream,
    settings: &Settings,
    watch: &mut dyn Watch,
    observer: &mut dyn Observer,
) -> Result<(Estimate, VariantReport), RunError> {
    let clock = Instant::now();
    let mut mapper = Mapper::new(stream.opening.clone(), settings)?;
    let (mut progress, mut naming) = (OnlineReport::default(), Naming::default());
    let mut taken = stream.opening.into_sequence();
    for observation in stream.observations {
        if let Ok(observation) = &observation
            && observation.frame.timestamp > stream.past
            && watch.wait(observation.frame.timestamp).is_break()
        {
            progress.interrupted = true;
            break;
        }
        let began = Instant::now();
        let report = observation.as_ref().map_err(|error| FrameError::Source(error.to_string()));
        let report = report.and_then(|observation| mapper.take(observation));
        let seconds = began.elapsed().as_secs_f64();
        progress.count(report.as_ref(), seconds);
        let goes_on = watch.frame(report.as_ref(), observation.as_ref().ok(), &mut mapper, seconds);
        if let (Ok(report), Ok(observation)) = (&report, observation) {
            naming.note(&observation.detections, &report.names);
            naming.forget(&report.forgotten);
            taken.push(observation);
        }
        if goes_on.is_break() {
            progress.interrupted = true;
            break;
        }
    }
    progress.end(&mut mapper);
    watch.end(&mut mapper);
    for (detection, name) in taken.detections.iter_mut().zip(naming.now(mapper.names())) {
        detection.object = name;
    }
    let association = naming.report(&*settings.association, mapper.names());
    let estimate = mapper.finish(Arc::new(taken), observer)?;
    progress.compare(&estimate, &settings.evaluation);
    let mut report = VariantReport::new(name, &estimate, settings, 0.0);
    report.association = association;
    report.online = Some(progress);
    report.seconds = clock.elapsed().as_secs_f64();
    Ok((estimate, report))
}

/// Watches frames as they come in.
pub trait Watch {
    /// Before each frame, with its time stamp in seconds: returns when it is there, or to end the stream before it.
    fn wait(&mut self, _timestamp: f64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// After each frame: what came of it, the frame if it could be read, the map, and the seconds that it took.
    fn frame(
        &mut self,
        report: Result<&FrameReport, &FrameError>,
        observation: Option<&Observation>,
        mapper: &mut Mapper,
        seconds: f64,
    ) -> ControlFlow<()>;

    /// After the last frame, before all of it is solved as one batch.
    fn end(&mut self, _mapper: &mut Mapper) {}
}

/// A run under way: sequences are loaded once for all variants that share them.
#[derive(Debug)]
pub struct Run<'a> {
    /// What to do.
    pub document: &'a RunDocument,
    folders: Folders,
    loaded: Vec<(String, Arc<Sequence>)>,
    journal: Option<PathBuf>,
    began: Instant,
    reports: Vec<VariantReport>,
}

impl<'a> Run<'a> {
    /// Nothing done yet; `data` is the folder of public data sets.
    pub fn new(document: &'a RunDocument, data: Option<PathBuf>) -> Self {
        let folders = Folders { data, document: document.folder.clone() };
        Self { document, folders, loaded: vec![], journal: None, began: Instant::now(), reports: vec![] }
    }

    /// Keeps the frames of a stream in a file, and begins with those that it has; see [`journal`](crate::journal).
    pub fn keep_frames(&mut self, journal: PathBuf) {
        self.journal = Some(journal);
    }

    /// The sequence of a variant.
    ///
    /// # Errors
    /// Where its source has none.
    pub fn sequence(&mut self, variant: &Variant) -> Result<Arc<Sequence>, SourceError> {
        let source = &variant.settings.source;
        // what is written alike is the same source
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
    /// Where there is no data, or no graph can be made of it. Numerical trouble is no error: see the report.
    pub fn variant(
        &mut self,
        variant: &Variant,
        observer: &mut dyn Observer,
    ) -> Result<(Estimate, VariantReport), RunError> {
        let clock = Instant::now();
        let sequence = self.sequence(variant)?;
        let done = estimate(&variant.name, sequence, &variant.settings, observer)?;
        Ok(self.keep(variant, done, clock))
    }

    /// The same, frame by frame; see [`online`].
    ///
    /// # Errors
    /// Where there is no data, or no graph can be made of it.
    pub fn variant_online(
        &mut self,
        variant: &Variant,
        watch: &mut dyn Watch,
        observer: &mut dyn Observer,
    ) -> Result<(Estimate, VariantReport), RunError> {
        let clock = Instant::now();
        let stream = match variant.settings.source.open(&self.folders)? {
            Some(stream) => stream,
            None => self.sequence(variant)?.into(),
        };
        let stream = match &self.journal {
            Some(_) if self.document.variants.len() > 1 => return Err(JournalError::Variants.into()),
            Some(path) => journaled(stream, path, &variant.settings.fingerprint())?,
            None => stream,
        };
        let done = online(&variant.name, stream, &variant.settings, watch, observer)?;
        Ok(self.keep(variant, done, clock))
    }

    fn keep(
        &mut self,
        variant: &Variant,
        (estimate, mut report): (Estimate, VariantReport),
        clock: Instant,
    ) -> (Estimate, VariantReport) {
        report.about.clone_from(&variant.about);
        report.seconds = clock.elapsed().as_secs_f64();
        self.reports.push(report.clone());
        (estimate, report)
    }

    /// The report over all variants that were run.
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
