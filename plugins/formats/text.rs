//! Texts from files, read once and with a size limit.
pub mod plausible;
pub mod words;

use crate::error::{FormatError, Mistake, ProblemList, io_error};
use crate::whole::write_whole;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Maximum number of bytes from a pipe or a device, whose length is unknown: the maximum size of a document.
/// A regular file may be longer.
const MAX_STREAM_BYTES: u64 = 256 << 20;

/// The path that stands for standard input.
pub const STDIN: &str = "-";

/// Reads a file once, as it may be a pipe. `-` is standard input.
///
/// # Errors
/// If the file cannot be read or is not UTF-8, or if a pipe or device supplies more than 256 MiB.
pub fn read_text(path: &Path) -> Result<String, FormatError> {
    let bytes = read(path).map_err(io_error(path))?;
    tracing::debug!(file = %path.display(), bytes = bytes.len(), "read");
    String::from_utf8(bytes).map_err(|error| {
        // The valid part of the content is shown.
        let text = String::from_utf8_lossy(error.as_bytes());
        let good = error.as_bytes().iter().take(error.utf8_error().valid_up_to());
        let line = 1 + good.filter(|b| **b == b'\n').count();
        ProblemList::single(path, &text, line, Mistake::NotText)
    })
}

pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), FormatError> {
    write_whole(path, text.as_bytes()).map_err(io_error(path))
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    if path == Path::new(STDIN) {
        return read_bounded(io::stdin().lock(), 0, MAX_STREAM_BYTES);
    }
    let file = File::open(path)?;
    let about = file.metadata()?;
    let length = if about.is_file() { about.len() } else { 0 };
    // System files such as in /proc report a length of zero.
    read_bounded(file, length, length.max(MAX_STREAM_BYTES))
}

/// Reads up to the end, with `length` bytes reserved; fails if there are more than `limit` bytes.
fn read_bounded(reader: impl Read, length: u64, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let length = usize::try_from(length).map_err(|_| ErrorKind::OutOfMemory)?;
    bytes.try_reserve_exact(length).map_err(|_| ErrorKind::OutOfMemory)?;
    reader.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let what =
            format!("no end after {limit} bytes; what comes from a pipe or a device has to be shorter");
        return Err(io::Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_end_is_not_read_to_its_end() {
        let error = read_bounded(io::repeat(b'a'), 0, 1000).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        assert_eq!(read_bounded(io::repeat(b'a').take(1000), 0, 1000).unwrap().len(), 1000);
        assert_eq!(read_bounded(io::empty(), u64::MAX, u64::MAX).unwrap_err().kind(), ErrorKind::OutOfMemory);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_to_an_endless_device_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("graph.g2o");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        let error = read_text(&link).unwrap_err().to_string();
        assert!(error.contains("no end after 268435456 bytes"), "{error}");
    }

    #[test]
    fn what_is_no_text_is_kept_for_its_message() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("graph.g2o");
        std::fs::write(&file, b"first\n\xff\n").unwrap();
        let Err(FormatError::Malformed(malformed)) = read_text(&file) else { panic!() };
        assert_eq!((malformed.problems[0].line, &*malformed.text), (2, "first\n\u{fffd}\n"));
    }
}
