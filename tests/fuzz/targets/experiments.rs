//! Experiments: their documents, their shards, and the journals of their trials.
use super::stream::sealed_lines;
use super::temporary;
use manifactor::config::{Document, Format};
use manifactor::slam::experiment::{Experiment, Shard, Trial, TrialLog, TrialOutcome, TrialRecord};
use manifactor::slam::output::OutputFolder;
use manifactor::slam::run_document::RunDocument;
use std::path::Path;
use std::sync::LazyLock;

/// The run that experiments of the corpus vary.
const BASE: &str = r#"
title = "base"
[source]
type = "simulated"
[[variants]]
name = "QuadricSLAM"
[[variants]]
name = "ours"
set = { semantics = "table_one" }
"#;
/// Experiments with more trials are read, but not split.
const SPLIT: usize = 200;

/// Reads documents of experiments. Each trial has all columns and is in one shard, and the documents of the
/// results give equal trials.
pub fn experiment(data: &[u8]) {
    let folder = temporary();
    let Some(experiment) = read(folder.path(), &String::from_utf8_lossy(data), BASE, Format::Toml) else {
        return;
    };
    assert!(!experiment.trials.is_empty());
    assert!(experiment.trials.iter().all(|trial| trial.labels.len() == experiment.columns.len()));
    if experiment.trials.len() > SPLIT {
        return;
    }
    let mut left: Vec<_> = experiment.trials.iter().map(|trial| trial.labels.clone()).collect();
    for shard in ["1/3", "2/3", "3/3"] {
        let mut part = experiment.clone();
        part.restrict_to_shard(shard.parse::<Shard>().unwrap_or_else(|e| panic!("{e}")));
        for trial in part.trials {
            let place = left.iter().position(|labels| *labels == trial.labels);
            left.swap_remove(place.unwrap_or_else(|| panic!("{:?} is in two shards", trial.labels)));
        }
    }
    assert!(left.is_empty(), "{left:?} are in no shard");
    let documents = &experiment.documents;
    let (mut written, base) = (documents.experiment.clone(), documents.base.to_string());
    written["base"] = "base.json".into();
    let again = read(folder.path(), &written.to_string(), &base, Format::Json)
        .unwrap_or_else(|| panic!("an experiment cannot be repeated: {written} {base}"));
    assert_eq!(again.columns, experiment.columns);
    // a label has the digits of its document: 1e-1 becomes 0.1 in the results
    let fingerprints = |trials: &[Trial]| -> Vec<_> { trials.iter().map(Trial::fingerprint).collect() };
    assert_eq!(fingerprints(&again.trials), fingerprints(&experiment.trials));
}

fn read(folder: &Path, text: &str, base: &str, format: Format) -> Option<Experiment> {
    let ending = if format == Format::Json { "json" } else { "toml" };
    std::fs::write(folder.join(format!("base.{ending}")), base).unwrap_or_else(|e| panic!("{e}"));
    let name = folder.join(format!("sweep.{ending}")).display().to_string();
    Experiment::read(&Document::parse(&name, text, format).ok()?).ok()
}

/// Reads journals of trials, unchanged and with valid checksums. `FINGERPRINT` stands for the fingerprint
/// of a trial.
pub fn trials(data: &[u8]) {
    static TRIAL: LazyLock<Trial> = LazyLock::new(|| {
        let run = Document::parse("run.toml", "source = { type = \"simulated\" }", Format::Toml);
        let run = run.and_then(|document| RunDocument::read(&document)).unwrap_or_else(|e| panic!("{e}"));
        Trial { labels: vec!["a".to_owned()], settings: run.variants[0].settings.clone(), inputs: 0 }
    });
    let text = String::from_utf8_lossy(data);
    let named = text.replace("FINGERPRINT", &TRIAL.fingerprint());
    for bytes in [data, sealed_lines(named.as_bytes()).as_slice()] {
        let folder = temporary();
        let path = folder.path().join("trials.jsonl");
        std::fs::write(&path, bytes).unwrap_or_else(|e| panic!("{e}"));
        let open = || {
            let claimed = OutputFolder::claim(folder.path(), "experiment", Path::new("sweep.toml"), true);
            TrialLog::open(claimed.unwrap_or_else(|e| panic!("{e}")))
        };
        let Ok(mut journal) = open() else {
            assert_eq!(std::fs::read(&path).unwrap_or_default(), bytes, "a refused journal has changed");
            continue;
        };
        let whole = std::fs::read(&path).unwrap_or_default();
        assert!(bytes.starts_with(&whole), "a journal has other lines");
        let found = journal.record_of(&TRIAL).cloned();
        let outcome = TrialOutcome::Failed { reason: "\u{2028}\n\"".to_owned() };
        let record = found.unwrap_or_else(|| TrialRecord {
            labels: TRIAL.labels.clone(),
            fingerprint: TRIAL.fingerprint(),
            outcome,
            seconds: 0.1,
        });
        journal.append(record.clone()).unwrap_or_else(|e| panic!("{e}"));
        drop(journal);
        let journal = open().unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(journal.record_of(&TRIAL), Some(&record));
    }
}
