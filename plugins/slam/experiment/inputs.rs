//! Input files of trials, which belong to their identity: a result from other files is not taken over.
use crate::document::Experiment;
use fnv::FnvHasher;
use manifactor_recording::source::InputFolders;
use std::collections::HashMap;
use std::fs::File;
use std::hash::Hasher;
use std::io::Read;
use std::path::{Path, PathBuf};

impl Experiment {
    /// Reads the input files of all trials, so that their results are told from those of other files. Returns the folders
    /// of the inputs; `data` is the folder of public data sets. A missing file fails its trial later.
    pub fn open_inputs(&mut self, data: Option<PathBuf>) -> InputFolders {
        let folders = InputFolders { data, document: self.folder.clone() };
        let mut known: HashMap<PathBuf, u64> = HashMap::new();
        for trial in &mut self.trials {
            let files = trial.settings.source.find_files(&folders).unwrap_or_default();
            let mut hash = FnvHasher::default();
            for file in &files {
                let content = known.entry(file.clone()).or_insert_with(|| content_hash(file));
                hash.write_u64(*content);
            }
            trial.inputs = if files.is_empty() { 0 } else { hash.finish() };
        }
        folders
    }
}

/// Returns a hash of the content of a file, or of the files in a folder by name. A file that cannot be read counts as
/// empty.
fn content_hash(path: &Path) -> u64 {
    let mut hash = FnvHasher::default();
    let Ok(entries) = std::fs::read_dir(path) else {
        // standard input and devices can be read once
        if let Some(mut file) = path.is_file().then(|| File::open(path).ok()).flatten() {
            let mut part = vec![0; 1 << 16];
            while let Ok(length @ 1..) = file.read(&mut part) {
                hash.write(part.get(..length).unwrap_or_default());
            }
        }
        return hash.finish();
    };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    for file in files.iter().filter(|file| file.is_file()) {
        hash.write(file.file_name().unwrap_or_default().as_encoded_bytes());
        hash.write_u64(content_hash(file));
    }
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::content_hash;

    #[test]
    fn the_content_and_the_names_in_a_folder_count() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.txt");
        std::fs::write(&file, "1 2").unwrap();
        let (alone, all) = (content_hash(&file), content_hash(folder.path()));
        assert_eq!((content_hash(&file), content_hash(folder.path())), (alone, all));
        std::fs::write(&file, "1 3").unwrap();
        assert!(content_hash(&file) != alone && content_hash(folder.path()) != all);
        std::fs::write(&file, "1 2").unwrap();
        std::fs::rename(&file, folder.path().join("b.txt")).unwrap();
        assert_ne!(content_hash(folder.path()), all);
    }
}
