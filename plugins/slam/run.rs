//! A run from its document to its report.
use crate::estimate::{Estimate, EstimateError};
use crate::input::sequence::Sequence;
use crate::input::source::{Folders, SourceError};
use crate::mapping::{Mapping, MappingError};
use crate::output::report::{RunReport, VariantReport};
use crate::settings::Settings;
use crate::settings::run_document::{RunDocument, Variant};
use manifactor_solve::{Observer, Termination};
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
    let mapping = Mapping::new(&sequence, settings)?;
    let estimate = Estimate::new(sequence, mapping, settings, observer)?;
    let mut report = VariantReport::new(name, &estimate, settings, 0.0);
    report.seconds = clock.elapsed().as_secs_f64();
    Ok((estimate, report))
}

/// A run under way: sequences are loaded once for all variants that share them.
#[derive(Debug)]
pub struct Run<'a> {
    /// What to do.
    pub document: &'a RunDocument,
    folders: Folders,
    loaded: Vec<(String, Arc<Sequence>)>,
    began: Instant,
    reports: Vec<VariantReport>,
}

impl<'a> Run<'a> {
    /// Nothing done yet; `data` is the folder of public data sets.
    pub fn new(document: &'a RunDocument, data: Option<PathBuf>) -> Self {
        let folders = Folders { data, document: document.folder.clone() };
        Self { document, folders, loaded: vec![], began: Instant::now(), reports: vec![] }
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
        let (estimate, mut report) = estimate(&variant.name, sequence, &variant.settings, observer)?;
        report.about.clone_from(&variant.about);
        report.seconds = clock.elapsed().as_secs_f64();
        self.reports.push(report.clone());
        Ok((estimate, report))
    }

    /// The report over all variants that were run.
    pub fn finish(self) -> RunReport {
        let ended = |report: &VariantReport| report.solve.termination != Termination::Interrupted;
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
