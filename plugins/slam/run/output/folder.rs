//! Result folders: protects foreign files, and gives write access to one process at a time.
//!
//! A command that writes a folder creates the marker file `.manifactor` in it. The marker names the command
//! and its document: `manifactor run "/robot/desk.toml"`. This command may write into the folder again with
//! this document. A folder is refused if it contains files but no such marker, or the marker of a different
//! command or document. The marker is locked while the command runs, and contains the number of the process
//! with the lock. The folder of a variant is inside the folder of its run, and runs of any document may write
//! into it.
use manifactor_formats::whole::{open_regular, remove_unfinished};
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// Name of the file that names the owner of a folder.
const MARKER_FILE: &str = ".manifactor";
/// Upper bound of the size of a marker, in bytes.
const MAX_MARKER_BYTES: u64 = 1 << 16;

/// Error that prevents results from being written into a folder.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// The folder cannot be created or written into.
    #[error("{}: {source}", path.display())]
    Io {
        /// The folder or its marker.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A different process writes into the folder.
    #[error("{} is in use: {} writes into it", folder.display(), process.map_or("another process".to_owned(), |id| format!("process {id}")))]
    InUse {
        /// The folder.
        folder: PathBuf,
        /// Number of the process, if known.
        process: Option<u32>,
    },
    /// The folder contains files that are not known to be results.
    #[error("{} holds files that Manifactor has not written, such as {found}", folder.display())]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// First of these files.
        found: String,
    },
    /// The folder contains the results of a different command or document.
    #[error("{} holds the results of `{writer}`, and `{owner}` would mix with them", folder.display())]
    Other {
        /// The folder.
        folder: PathBuf,
        /// The command and document that were refused.
        owner: String,
        /// The command and document that have written the folder.
        writer: String,
    },
}

/// A folder of results that only this process writes into, until this value is dropped.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    marker: File,
    /// Bytes of the marker that remain after the drop.
    kept: u64,
}

impl OutputFolder {
    /// Claims a folder for the results of a command such as `run` and its document, and creates it if
    /// necessary. Removes unfinished files of earlier killed runs by this command and document. With `force`,
    /// existing files do not matter, unless a different process uses the folder.
    ///
    /// # Errors
    /// If the folder cannot be created or written, is in use, or contains foreign files. It stays unchanged.
    pub fn claim(path: &Path, command: &str, document: &Path, force: bool) -> Result<Self, FolderError> {
        let document = document.canonicalize().unwrap_or_else(|_| document.to_owned());
        // quoted, so that any name stays on one line
        let owner = format!("manifactor {command} {document:?}\n");
        create_folder(path).map_err(|source| FolderError::Io { path: path.to_owned(), source })?;
        let place = path.join(MARKER_FILE);
        // a refused folder gets no marker; a process that was killed immediately leaves an empty one
        let unmarked = place.symlink_metadata().map_or(true, |at| at.len() == 0);
        if !force && unmarked && !lies_in_one_of(path, command) {
            refuse_others(path)?;
        }
        let io = |source| FolderError::Io { path: place.clone(), source };
        let mut marker = open_regular(&place).map_err(io)?;
        let locked = marker.try_lock();
        let found = marker_text(&marker);
        if let Err(TryLockError::WouldBlock) = locked {
            return Err(FolderError::InUse { folder: path.to_owned(), process: process_id(&found) });
        }
        let ours = found.starts_with(&owner);
        if !ours && !force {
            refuse_other_results(path, owner.trim_end(), &found)?;
        }
        // a file system without locks does not prevent a run, but then a different process may be using the
        // folder
        if ours && locked.is_ok() {
            remove_unfinished_files(path);
        }
        let kept = owner.len() as u64;
        let process = format!("process {}\n", std::process::id());
        // the process may be killed between these two steps; the marker still names this owner then
        let (length, text) = if ours { (kept, process) } else { (0, owner + &process) };
        marker.set_len(length).and_then(|()| marker.write_all(text.as_bytes())).map_err(io)?;
        Ok(Self { path: path.to_owned(), marker, kept })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // harmless if it fails: the marker then names a process that has ended
        let _ = self.marker.set_len(self.kept);
    }
}

fn create_folder(folder: &Path) -> io::Result<()> {
    match std::fs::create_dir_all(folder) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(ErrorKind::NotADirectory.into()),
        made => made,
    }
}

/// Returns whether the parent folder belongs to the command, as a run's folder does for its variants.
fn lies_in_one_of(folder: &Path, command: &str) -> bool {
    let Ok(folder) = folder.canonicalize() else { return false };
    let Some(place) = folder.parent().map(|outer| outer.join(MARKER_FILE)) else { return false };
    // opening a pipe would block until its writer opens it
    let is_file = place.symlink_metadata().is_ok_and(|at| at.is_file());
    let ours = format!("manifactor {command} ");
    is_file && File::open(place).is_ok_and(|marker| marker_text(&marker).starts_with(&ours))
}

/// Returns the text of a marker. On some systems a locked marker cannot be read and gives an empty text.
fn marker_text(marker: &File) -> String {
    let mut bytes = vec![];
    let _ = marker.take(MAX_MARKER_BYTES).read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns an error if a folder contains anything except a marker.
fn refuse_others(folder: &Path) -> Result<(), FolderError> {
    let io = |source| FolderError::Io { path: folder.to_owned(), source };
    let names = std::fs::read_dir(folder).map_err(io)?.map(|entry| entry.map(|entry| entry.file_name()));
    let names = names.collect::<io::Result<Vec<_>>>().map_err(io)?;
    // the first name in order, so that the message is reproducible
    match names.into_iter().filter(|name| name != MARKER_FILE).min() {
        None => Ok(()),
        Some(name) => {
            let found = name.to_string_lossy().into_owned();
            Err(FolderError::Foreign { folder: folder.to_owned(), found })
        }
    }
}

/// Returns an error if a folder's marker is invalid, or if it names a different owner and the folder contains
/// further files.
fn refuse_other_results(folder: &Path, owner: &str, marker: &str) -> Result<(), FolderError> {
    let Some(writer) = marker.lines().next() else {
        // the marker has just been created
        return Ok(());
    };
    if !writer.starts_with("manifactor ") {
        return Err(FolderError::Foreign { folder: folder.to_owned(), found: MARKER_FILE.to_owned() });
    }
    refuse_others(folder).map_err(|_| FolderError::Other {
        folder: folder.to_owned(),
        owner: owner.to_owned(),
        writer: writer.to_owned(),
    })
}

/// Removes unfinished files of killed runs from a folder and from the folders of its variants.
fn remove_unfinished_files(folder: &Path) {
    remove_unfinished(folder);
    let inner = std::fs::read_dir(folder).into_iter().flatten().flatten();
    inner
        .filter(|entry| entry.file_type().is_ok_and(|t| t.is_dir()))
        .for_each(|inner| remove_unfinished(&inner.path()));
}

/// Returns the number of the process that a marker names.
fn process_id(marker: &str) -> Option<u32> {
    marker.lines().find_map(|line| line.strip_prefix("process "))?.parse().ok()
}

#[cfg(test)]
mod tests;
