//! Recordings in several files of one folder.
use super::BagError;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Extensions of recordings.
const EXTENSIONS: [&str; 2] = ["mcap", "db3"];

/// Returns whether a path is a recording by its extension, or a folder with such a file.
pub fn is_recording(path: &Path) -> bool {
    if path.is_dir() { !recordings(path).unwrap_or_default().is_empty() } else { has_extension(path) }
}

/// Returns whether the extension is that of a recording, or of one compressed by zstd.
fn has_extension(path: &Path) -> bool {
    let plain = without_compression(path);
    plain.extension().and_then(|extension| extension.to_str()).is_some_and(|own| EXTENSIONS.contains(&own))
}

fn without_compression(path: &Path) -> PathBuf {
    if path.extension().is_some_and(|extension| extension == "zstd") {
        path.with_extension("")
    } else {
        path.to_owned()
    }
}

/// Returns the files in a folder that are recordings by their extension.
fn recordings(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = vec![];
    for entry in std::fs::read_dir(folder)? {
        let file = entry?.path();
        if has_extension(&file) && file.is_file() {
            files.push(file);
        }
    }
    Ok(files)
}

/// Returns the files of a recording: the file itself, or those of a folder by the number at the end of their names.
///
/// # Errors
/// If the folder cannot be read, or does not have exactly one recording.
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>, BagError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut files = recordings(path).map_err(|source| BagError::Io { path: path.to_owned(), source })?;
    if files.is_empty() {
        return Err(BagError::Format {
            path: path.to_owned(),
            found: "a folder without `.mcap` or `.db3` files",
        });
    }
    let names: BTreeSet<String> = files.iter().map(|file| split_name(file).0).collect();
    if names.len() > 1 {
        let found = "a folder with several recordings; give one of its files";
        return Err(BagError::Format { path: path.to_owned(), found });
    }
    files.sort_by_key(|file| (split_name(file).1, file.clone()));
    Ok(files)
}

/// Returns the name of a recording and the number of its file, such as `drive_` and 12 for `drive_12.mcap`.
fn split_name(file: &Path) -> (String, u64) {
    let plain = without_compression(file);
    let stem = plain.file_stem().unwrap_or_default().to_string_lossy();
    let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    (name.to_owned(), stem[name.len()..].parse().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["drive_10.mcap", "drive_9.mcap", "drive_0.mcap.zstd", "metadata.yaml"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let files = files(folder.path()).unwrap();
        let names: Vec<_> = files.iter().map(|file| file.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["drive_0.mcap.zstd", "drive_9.mcap", "drive_10.mcap"]);
        assert!(
            is_recording(folder.path())
                && is_recording(Path::new("a.db3"))
                && !is_recording(Path::new("a.csv"))
        );
        assert!(!is_recording(tempfile::tempdir().unwrap().path()));
        // two drives are not one
        std::fs::write(folder.path().join("other_0.mcap"), "").unwrap();
        let error = super::files(folder.path()).unwrap_err().to_string();
        assert!(error.contains("several recordings") && is_recording(folder.path()), "{error}");
    }
}
