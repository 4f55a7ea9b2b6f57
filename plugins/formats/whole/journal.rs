//! Append-only files of records, one JSON object with its checksum per line.
//!
//! A killed program leaves at most one incomplete line, the last; it is dropped when the file is opened
//! again. A file that is not a journal of these records, has a different key or has a damaged line is refused
//! and not modified.
use super::{CHECKED_LINE_START, checked_line, open_regular, read_checked_line, read_regular};
use std::fs::{File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// A record type of a journal.
pub trait JournalRecord: Sized {
    /// What is known besides the lines, to parse them.
    type Context;
    /// Name of the records in messages.
    const NAME: &'static str;
    /// Beginnings of a header line with the journal's key: the current one, then earlier versions. Empty for
    /// journals without a key.
    const HEADER_STARTS: &'static [&'static str] = &[];

    /// Formats the record as a JSON object on one line, without the line break.
    ///
    /// # Errors
    /// If the record cannot be written.
    fn write(&self) -> io::Result<String>;

    /// Parses the record from such a line.
    ///
    /// # Errors
    /// If the line is not a record, with the reason as text.
    fn read(line: &[u8], context: &Self::Context) -> Result<Self, String>;
}

/// The reason why a journal cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Another program has the journal open.
    #[error("{}: another program writes to this journal", path.display())]
    InUse {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file is not a journal of these records.
    #[error("{} is no journal of {record}s: name another file", path.display())]
    NoJournal {
        /// Path of the file.
        path: PathBuf,
        /// Name of the expected records.
        record: &'static str,
    },
    /// The journal has a different key.
    #[error("{} is the journal of other settings, or of another version: name another file to begin anew", path.display())]
    OtherKey {
        /// Path of the file.
        path: PathBuf,
    },
    /// A complete line is not a valid record.
    #[error(
        "{}:{line} is no {record}: {message}; move the file away to begin anew, or keep its lines before {line} to go on from there",
        path.display()
    )]
    Line {
        /// Path of the file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// Name of the expected record.
        record: &'static str,
        /// Reason as text.
        message: String,
    },
}

/// A journal that is open for appending.
#[derive(Debug)]
pub struct Journal<R: JournalRecord> {
    path: PathBuf,
    file: File,
    context: R::Context,
}

impl<R: JournalRecord> Journal<R> {
    /// Opens or creates a journal, and returns its records. If the record type has a key, it is checked.
    ///
    /// # Errors
    /// If the file cannot be read or written, is a link, or is not such a journal; it is then unchanged. If
    /// the journal has a key and another program has it open.
    pub fn open(path: &Path, key: &str, context: R::Context) -> Result<(Self, Vec<R>), JournalError> {
        let io = |source| JournalError::Io { path: path.to_owned(), source };
        let mut file = open_regular(path).map_err(io)?;
        let header = R::HEADER_STARTS.first().map_or_else(String::new, |begin| format!("{begin}{key}\"}}\n"));
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
            let is_ours = R::HEADER_STARTS.iter().any(|beginning| bytes.starts_with(beginning.as_bytes()));
            return Err(match is_ours {
                true => JournalError::OtherKey { path },
                false => JournalError::NoJournal { path, record: R::NAME },
            });
        };
        let (records, whole) = records(lines, !header.is_empty(), path, &context)?;
        if whole < lines.len() {
            file.set_len((header.len() + whole) as u64).map_err(io)?;
        }
        Ok((Self { path: path.to_owned(), file, context }, records))
    }

    /// Appends a record, and returns it as it will be read back. If writing fails, the file is unchanged.
    ///
    /// # Errors
    /// If the record cannot be written or read back, or if the operating system reports an error.
    pub fn append(&mut self, record: &R) -> io::Result<R> {
        let line = record.write()?;
        // Only lines that can be read back are written.
        let read = R::read(line.as_bytes(), &self.context).map_err(io::Error::other)?;
        let length = self.file.metadata()?.len();
        if let Err(error) = self.file.write_all(checked_line(&line).as_bytes()) {
            // An incomplete line would end the journal, so it is removed.
            self.file.set_len(length)?;
            return Err(error);
        }
        Ok(read)
    }

    /// Syncs all records to the disk.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Reads a journal without a key, even while a program is writing to it. A missing file has no records.
///
/// # Errors
/// If the file cannot be read or is not such a journal.
pub fn read<R: JournalRecord<Context = ()>>(path: &Path) -> Result<Vec<R>, JournalError> {
    match read_regular(path) {
        Ok(bytes) => Ok(records(&bytes, false, path, &())?.0),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(vec![]),
        Err(source) => Err(JournalError::Io { path: path.to_owned(), source }),
    }
}

/// Returns the records, and the number of bytes of complete lines. With a header, an incomplete last line is
/// a torn record.
fn records<R: JournalRecord>(
    lines: &[u8],
    has_header: bool,
    path: &Path,
    context: &R::Context,
) -> Result<(Vec<R>, usize), JournalError> {
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
            records.push(R::read(&object, context).map_err(mistake)?);
        }
    }
    Ok((records, whole))
}

/// Returns whether a line is the beginning of a record.
fn is_torn(line: &[u8]) -> bool {
    let begins =
        line.starts_with(CHECKED_LINE_START.as_bytes()) || CHECKED_LINE_START.as_bytes().starts_with(line);
    begins && serde_json::from_slice::<serde_json::Value>(line).err().is_none_or(|error| error.is_eof())
}
