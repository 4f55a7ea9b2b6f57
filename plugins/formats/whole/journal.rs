//! Append-only files of records, one JSON object with its checksum per line.
//!
//! A program that is killed leaves at most one line without an end, the last: it is dropped when the file is opened again. A file
//! that is no journal of these records, that of another key, or has a damaged line is refused and not touched.
use super::{CHECKED, checked_line, open_regular, read_checked_line, read_regular};
use std::fs::{File, TryLockError};
use std::io::{self, Read, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A record of a journal.
pub trait Record: Sized {
    /// Its name in messages.
    const NAME: &'static str;
    /// Beginnings of a first line that has the journal's key: today's, then those of earlier versions. A journal without a key has none.
    const BEGINNINGS: &'static [&'static str] = &[];

    /// The record as a JSON object on one line, without its end.
    ///
    /// # Errors
    /// A record that cannot be written.
    fn write(&self) -> io::Result<String>;

    /// The record of such a line.
    ///
    /// # Errors
    /// A line that is no record, in words.
    fn read(line: &[u8]) -> Result<Self, String>;
}

/// Why a journal cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A file that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A journal that another program has open.
    #[error("{}: another program writes to this journal", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// A file of something else.
    #[error("{} is no journal of {record}s: name another file", path.display())]
    NoJournal {
        /// The file.
        path: PathBuf,
        /// Name of the expected records.
        record: &'static str,
    },
    /// A journal with another key.
    #[error("{} is the journal of other settings, or of another version: name another file to begin anew", path.display())]
    OtherKey {
        /// The file.
        path: PathBuf,
    },
    /// A whole line that is no record.
    #[error(
        "{}:{line} is no {record}: {message}; move the file away to begin anew, or keep its lines before {line} to go on from there",
        path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// Name of the expected record.
        record: &'static str,
        /// The reason.
        message: String,
    },
}

/// A journal that is open for writing at its end.
#[derive(Debug)]
pub struct Journal<R> {
    path: PathBuf,
    file: File,
    records: PhantomData<R>,
}

impl<R: Record> Journal<R> {
    /// Opens a journal, or begins one; returns its records as well. The key is checked if these records have one.
    ///
    /// # Errors
    /// A file that cannot be read or written, is a link, or is no such journal; it is unchanged then. A journal with a key that another
    /// program has open.
    pub fn open(path: &Path, key: &str) -> Result<(Self, Vec<R>), JournalError> {
        let io = |source| JournalError::Io { path: path.to_owned(), source };
        let mut file = open_regular(path).map_err(io)?;
        let header = R::BEGINNINGS.first().map_or_else(String::new, |begin| format!("{begin}{key}\"}}\n"));
        if !header.is_empty() {
            file.try_lock().map_err(|error| match error {
                TryLockError::WouldBlock => JournalError::InUse { path: path.to_owned() },
                TryLockError::Error(source) => io(source),
            })?;
        }
        let mut bytes = vec![];
        file.read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() < header.len() && header.as_bytes().starts_with(&bytes) {
            file.set_len(0).and_then(|()| file.write_all(header.as_bytes())).map_err(io)?;
            bytes = header.clone().into_bytes();
        }
        let Some(lines) = bytes.strip_prefix(header.as_bytes()) else {
            let path = path.to_owned();
            let is_ours = R::BEGINNINGS.iter().any(|beginning| bytes.starts_with(beginning.as_bytes()));
            return Err(match is_ours {
                true => JournalError::OtherKey { path },
                false => JournalError::NoJournal { path, record: R::NAME },
            });
        };
        let (records, whole) = records(lines, !header.is_empty(), path)?;
        if whole < lines.len() {
            file.set_len((header.len() + whole) as u64).map_err(io)?;
        }
        Ok((Self { path: path.to_owned(), file, records: PhantomData }, records))
    }

    /// Adds a record, and returns it as it will be read. The file is as before if it cannot be written.
    ///
    /// # Errors
    /// A record that cannot be written, or not be read again; the system's reason.
    pub fn append(&mut self, record: &R) -> io::Result<R> {
        let line = record.write()?;
        // a line that cannot be read again is not written
        let read = R::read(line.as_bytes()).map_err(io::Error::other)?;
        let length = self.file.metadata()?.len();
        if let Err(error) = self.file.write_all(checked_line(&line).as_bytes()) {
            // half a line would end the journal
            self.file.set_len(length)?;
            return Err(error);
        }
        Ok(read)
    }

    /// Brings all records to the disk.
    ///
    /// # Errors
    /// The system's reason.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The records of a journal without a key, which a program may be writing. A file that is not there has none.
///
/// # Errors
/// A file that cannot be read, or is no such journal.
pub fn read<R: Record>(path: &Path) -> Result<Vec<R>, JournalError> {
    match read_regular(path) {
        Ok(bytes) => Ok(records(&bytes, false, path)?.0),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(vec![]),
        Err(source) => Err(JournalError::Io { path: path.to_owned(), source }),
    }
}

/// The records on lines, and the number of bytes of whole lines. A header proves that a last line without an end is a torn record.
fn records<R: Record>(lines: &[u8], has_header: bool, path: &Path) -> Result<(Vec<R>, usize), JournalError> {
    let mut records = vec![];
    let mut whole = 0;
    for (i, line) in lines.split_inclusive(|byte| *byte == b'\n').enumerate() {
        let mistake = |message: String| {
            let line = i + 1 + usize::from(has_header);
            JournalError::Line { path: path.to_owned(), line, record: R::NAME, message }
        };
        let Some(line) = line.strip_suffix(b"\n") else {
            if has_header || is_torn(line) {
                break;
            }
            return Err(mistake("it has no end, and does not begin as a record does".into()));
        };
        whole += line.len() + 1;
        if !line.is_empty() {
            let object = read_checked_line(line).map_err(|fault| mistake(fault.to_owned()))?;
            records.push(R::read(&object).map_err(mistake)?);
        }
    }
    Ok((records, whole))
}

/// True if a line is the beginning of a record.
fn is_torn(line: &[u8]) -> bool {
    let begins = line.starts_with(CHECKED.as_bytes()) || CHECKED.as_bytes().starts_with(line);
    begins && serde_json::from_slice::<serde_json::Value>(line).err().is_none_or(|error| error.is_eof())
}
