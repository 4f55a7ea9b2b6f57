//! Folders of results: what may be written into one, and that only one process does.
//!
//! A command that writes a folder leaves the file `.manifactor` in it, which names the command and its document:
//! `manifactor run "/robot/desk.toml"`. The two may write there again. A folder that holds other files and no such marker,
//! or a marker of something else, is refused. The marker is locked while the command runs, and says which process has
//! the lock. The folder of a variant lies in that of its run, and may be written by runs of any document.
use manifactor_formats::whole::{open_regular, remove_unfinished};
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// The name of the file that says whose a folder is.
const MARKER: &str = ".manifactor";
/// More bytes than a marker has.
const LONG: u64 = 1 << 16;

/// Why results cannot go into a folder.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A folder that cannot be made or written into.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which; or its marker.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another process writes into it.
    #[error("{} is in use: {} writes into it", folder.display(), process.map_or("another process".to_owned(), |id| format!("process {id}")))]
    InUse {
        /// Which.
        folder: PathBuf,
        /// The number of the process, where it is known.
        process: Option<u32>,
    },
    /// It holds files that nothing shows to be results.
    #[error("{} holds files that Manifactor has not written, such as {found}", folder.display())]
    Foreign {
        /// Which.
        folder: PathBuf,
        /// The first of its files.
        found: String,
    },
    /// It holds the results of another command or document.
    #[error("{} holds the results of `{writer}`, and `{owner}` would mix with them", folder.display())]
    Other {
        /// Which.
        folder: PathBuf,
        /// What was to write into it: a command and its document.
        owner: String,
        /// What has written it.
        writer: String,
    },
}

/// A folder that this process alone writes results into, until this is dropped.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    marker: File,
    /// How many bytes of the marker stay.
    kept: u64,
}

impl OutputFolder {
    /// Makes a folder, or takes one, for the results of a command such as `run` and its document. Removes what killed
    /// runs of the same have left unfinished. With `force` it is taken whatever is in it, unless another process uses it.
    ///
    /// # Errors
    /// If it cannot be made or written, is in use, or holds what others have written; it is unchanged then.
    pub fn claim(path: &Path, command: &str, document: &Path, force: bool) -> Result<Self, FolderError> {
        let document = document.canonicalize().unwrap_or_else(|_| document.to_owned());
        // quoted, so that it is one line whatever the name
        let owner = format!("manifactor {command} {document:?}\n");
        make(path).map_err(|source| FolderError::Io { path: path.to_owned(), source })?;
        let place = path.join(MARKER);
        // no marker is put into a folder that is refused; a process that was killed at once leaves an empty one
        let unmarked = place.symlink_metadata().map_or(true, |at| at.len() == 0);
        if !force && unmarked && !lies_in_one_of(path, command) {
            refuse_others(path)?;
        }
        let io = |source| FolderError::Io { path: place.clone(), source };
        let mut marker = open_regular(&place).map_err(io)?;
        let locked = marker.try_lock();
        let found = text(&marker);
        if let Err(TryLockError::WouldBlock) = locked {
            return Err(FolderError::InUse { folder: path.to_owned(), process: process(&found) });
        }
        let ours = found.starts_with(&owner);
        if !ours && !force {
            refuse_other_results(path, owner.trim_end(), &found)?;
        }
        // a file system without locks is no reason not to run, but others may be at work there
        if ours && locked.is_ok() {
            clean(path);
        }
        let kept = owner.len() as u64;
        let process = format!("process {}\n", std::process::id());
        // a kill between the two leaves a marker that is ours still
        let (length, text) = if ours { (kept, process) } else { (0, owner + &process) };
        marker.set_len(length).and_then(|()| marker.write_all(text.as_bytes())).map_err(io)?;
        Ok(Self { path: path.to_owned(), marker, kept })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // a process that is named and has ended does no harm
        let _ = self.marker.set_len(self.kept);
    }
}

fn make(folder: &Path) -> io::Result<()> {
    match std::fs::create_dir_all(folder) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(ErrorKind::NotADirectory.into()),
        made => made,
    }
}

/// Returns whether the folder around it belongs to the command, as that of a run does around that of a variant.
fn lies_in_one_of(folder: &Path, command: &str) -> bool {
    let Ok(folder) = folder.canonicalize() else { return false };
    let Some(place) = folder.parent().map(|outer| outer.join(MARKER)) else { return false };
    // opening a pipe would wait for somebody at its other end
    let is_file = place.symlink_metadata().is_ok_and(|at| at.is_file());
    let ours = format!("manifactor {command} ");
    is_file && File::open(place).is_ok_and(|marker| text(&marker).starts_with(&ours))
}

/// What a marker says; on some systems one that is locked cannot be read.
fn text(marker: &File) -> String {
    let mut bytes = vec![];
    let _ = marker.take(LONG).read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// An error, if there is anything in a folder but a marker.
fn refuse_others(folder: &Path) -> Result<(), FolderError> {
    let io = |source| FolderError::Io { path: folder.to_owned(), source };
    let names = std::fs::read_dir(folder).map_err(io)?.map(|entry| entry.map(|entry| entry.file_name()));
    let names = names.collect::<io::Result<Vec<_>>>().map_err(io)?;
    // the same one each time
    match names.into_iter().filter(|name| name != MARKER).min() {
        None => Ok(()),
        Some(name) => {
            let found = name.to_string_lossy().into_owned();
            Err(FolderError::Foreign { folder: folder.to_owned(), found })
        }
    }
}

/// An error, if a folder's marker is not one, or if it names another owner and there is anything beside it.
fn refuse_other_results(folder: &Path, owner: &str, marker: &str) -> Result<(), FolderError> {
    let Some(writer) = marker.lines().next() else {
        // it was made just now
        return Ok(());
    };
    if !writer.starts_with("manifactor ") {
        return Err(FolderError::Foreign { folder: folder.to_owned(), found: MARKER.to_owned() });
    }
    refuse_others(folder).map_err(|_| FolderError::Other {
        folder: folder.to_owned(),
        owner: owner.to_owned(),
        writer: writer.to_owned(),
    })
}

/// Removes what killed runs have left in a folder and in those of its variants.
fn clean(folder: &Path) {
    remove_unfinished(folder);
    let inner = std::fs::read_dir(folder).into_iter().flatten().flatten();
    inner
        .filter(|entry| entry.file_type().is_ok_and(|t| t.is_dir()))
        .for_each(|inner| remove_unfinished(&inner.path()));
}

/// The number of the process that a marker names.
fn process(marker: &str) -> Option<u32> {
    marker.lines().find_map(|line| line.strip_prefix("process "))?.parse().ok()
}

#[cfg(test)]
mod tests;
