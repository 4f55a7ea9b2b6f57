//! Files that are written whole or not at all.
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What the name of a file ends with that is not yet whole; one that is found was left by a program that was killed.
pub const UNFINISHED: &str = ".unfinished";

/// Writes a file whole or not at all: under another name first, brought to the disk, and renamed then.
///
/// # Errors
/// Where it cannot be written; what was there before is there still, and nothing else.
pub fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    // a pipe or a terminal is written to as it stands
    if path.metadata().is_ok_and(|at| !at.is_file()) {
        return std::fs::write(path, content);
    }
    let unfinished = beside(path);
    let written = fill(&unfinished, content).and_then(|()| std::fs::rename(&unfinished, path));
    if written.is_err() {
        // nothing better can be done about a leftover than about the failure itself
        let _ = std::fs::remove_file(&unfinished);
    }
    tracing::debug!(file = %path.display(), bytes = content.len(), whole = written.is_ok(), "written");
    written
}

/// Whether a file can be written: asked before hours are spent on what goes there.
///
/// # Errors
/// Where it cannot, with what the system says.
pub fn can_write(path: &Path) -> io::Result<()> {
    let trial = beside(path);
    let written = fill(&trial, b"?");
    // it may not have been made
    let _ = std::fs::remove_file(&trial);
    written
}

/// Whether files can be written into a folder, or where it is not there yet, into the one that it would be made in.
///
/// # Errors
/// Where they cannot, with what the system says.
pub fn can_write_into(folder: &Path) -> io::Result<()> {
    let there = folder.ancestors().find(|place| place.exists()).unwrap_or(Path::new(""));
    let there = if there.as_os_str().is_empty() { Path::new(".") } else { there };
    can_write(&there.join("trial"))
}

/// Removes the files of a folder that a program which was killed has left unfinished. Only for folders that nobody else
/// writes into.
pub fn remove_unfinished(folder: &Path) {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for file in files.filter(|file| file.file_name().to_string_lossy().ends_with(UNFINISHED)) {
        // what cannot be removed does no harm
        let _ = std::fs::remove_file(file.path());
    }
}

fn fill(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(content)?;
    file.sync_all()
}

/// A name of this process's own in the same folder, as a rename does not cross file systems.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}{UNFINISHED}", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("manifactor-whole-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir(&folder).unwrap();
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let files = std::fs::read_dir(folder).unwrap();
        files.map(|file| file.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_file_is_replaced_as_a_whole() {
        let folder = folder("replaced");
        let file = folder.join("a.txt");
        write_whole(&file, b"first").unwrap();
        write_whole(&file, b"second").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"second");
        assert_eq!(names(&folder), ["a.txt"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_cannot_be_renamed_leaves_nothing() {
        let folder = folder("refused");
        let place = folder.join("not a folder");
        std::fs::write(&place, "").unwrap();
        assert!(write_whole(&place.join("a.txt"), b"text").is_err());
        assert!(can_write_into(&place).is_err() && can_write_into(&place.join("deeper")).is_err());
        assert!(can_write_into(&folder.join("new/and/deep")).is_ok());
        assert!(can_write(&folder.join("new/a.txt")).is_err());
        assert_eq!(names(&folder), ["not a folder"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn leftovers_are_removed_and_nothing_else() {
        let folder = folder("leftovers");
        std::fs::write(beside(&folder.join("a.txt")), "ha").unwrap();
        std::fs::write(folder.join("a.txt"), "whole").unwrap();
        remove_unfinished(&folder);
        assert_eq!(names(&folder), ["a.txt"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
