//! Atomic writing of files; all files are written through this module.
pub mod journal;

use std::fs::{File, Metadata, OpenOptions};
use std::hash::Hasher;
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// Prefix of the name of an unfinished file.
const UNFINISHED_PREFIX: &str = ".manifactor-";
/// Number of random letters and digits in the name.
const RANDOM_CHARS: usize = 16;
/// Suffix of the name.
const UNFINISHED_SUFFIX: &str = ".unfinished";

/// Writes a file atomically: writes to a temporary file in the same folder, syncs it to the disk, and renames
/// it. A replaced file keeps its permissions. A link is replaced; its target is left unchanged.
///
/// # Errors
/// If the file cannot be written. The previous file is then still there, and no temporary file remains.
pub fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let written = if is_stream(path) { write_stream(path, content) } else { replace(path, content) };
    tracing::debug!(file = %path.display(), bytes = content.len(), whole = written.is_ok(), "written");
    written
}

/// Checks that a file can be written, before a long computation whose result goes there.
///
/// # Errors
/// If the file cannot be written, with the error of the operating system.
pub fn check_writable(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if is_stream(path) {
        return Ok(());
    }
    unfinished(path, None)?.as_file_mut().write_all(b"?")
}

/// Removes temporary files of [`write_whole`] that a killed program left in a folder. The caller ensures that
/// no other process is writing to the folder.
pub fn remove_unfinished(folder: &Path) {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_ours = |name: &str| {
        let random =
            name.strip_prefix(UNFINISHED_PREFIX).and_then(|rest| rest.strip_suffix(UNFINISHED_SUFFIX));
        random.is_some_and(|r| r.len() == RANDOM_CHARS && r.bytes().all(|b| b.is_ascii_alphanumeric()))
    };
    for file in files.filter(|file| file.file_name().to_str().is_some_and(is_ours)) {
        if file.file_type().is_ok_and(|t| t.is_file()) {
            // A file that cannot be removed does no harm.
            let _ = std::fs::remove_file(file.path());
        }
    }
}

/// Opens a regular file for reading and appending, or creates it. It is never opened through a link, so that
/// all written data stays in its folder.
///
/// # Errors
/// If the path is a link or not a regular file, or if it cannot be opened.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let refused = || io::Error::new(ErrorKind::InvalidInput, "it is a link, or not a regular file");
    let mut options = OpenOptions::new();
    options.read(true).append(true);
    match options.clone().create_new(true).open(path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
        made => return made,
    }
    // Opening a pipe would block until a process opens its other end.
    if !path.symlink_metadata()?.is_file() {
        return Err(refused());
    }
    let file = options.open(path)?;
    // A link may have replaced the file since the check.
    if is_same(&file.metadata()?, &path.symlink_metadata()?) { Ok(file) } else { Err(refused()) }
}

/// Reads a regular file. A pipe is refused, as reading it might block forever.
///
/// # Errors
/// If the file cannot be read, or is a link or not a regular file.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    if !path.symlink_metadata()?.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is a link, or not a regular file"));
    }
    std::fs::read(path)
}

#[cfg(unix)]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_same(_: &Metadata, b: &Metadata) -> bool {
    b.is_file()
}

/// Returns whether the path is a pipe, a terminal or a device, which cannot be replaced.
fn is_stream(path: &Path) -> bool {
    path.metadata().is_ok_and(|at| !at.is_file() && !at.is_dir())
}

fn write_stream(path: &Path, content: &[u8]) -> io::Result<()> {
    OpenOptions::new().write(true).open(path)?.write_all(content)
}

fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let replaced = path.symlink_metadata().ok().filter(Metadata::is_file);
    let mut file = unfinished(path, replaced.as_ref())?;
    file.as_file_mut().write_all(content)?;
    file.as_file().sync_all()?;
    // On an error, the temporary file is removed.
    file.persist(path).map(drop).map_err(|error| error.error)
}

/// Creates a temporary file next to `path`, as a rename cannot cross file systems. It is removed when
/// dropped.
fn unfinished(path: &Path, replaced: Option<&Metadata>) -> io::Result<NamedTempFile<File>> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = Builder::new();
    builder.prefix(UNFINISHED_PREFIX).rand_bytes(RANDOM_CHARS).suffix(UNFINISHED_SUFFIX);
    builder.make_in(folder, |path| create(path, replaced))
}

/// Creates a file that must not exist, with the permissions of the file that it will replace.
fn create(path: &Path, replaced: Option<&Metadata>) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    let Some(replaced) = replaced else { return options.open(path) };
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path)?;
    // If the file system has no permissions, keep the results; a file readable only by its owner does no
    // harm.
    let _ = file.set_permissions(replaced.permissions());
    Ok(file)
}

/// Number of hexadecimal digits of a checksum.
const CHECKSUM_DIGITS: usize = 16;

fn checksum(text: &[u8]) -> String {
    let mut hash = fnv::FnvHasher::default();
    hash.write(text);
    format!("{:0CHECKSUM_DIGITS$x}", hash.finish())
}

/// Beginning of a line with a checksum.
pub const CHECKED_LINE_START: &str = r#"{"checksum":""#;

/// Returns a log line, with its line break: a JSON object with a checksum as its first field (64-bit FNV-1a
/// of the object without the checksum). The checksum detects damaged bytes when a log is read again after
/// months.
pub fn checked_line(object: &str) -> String {
    format!("{CHECKED_LINE_START}{}\",{}\n", checksum(object.as_bytes()), object.get(1..).unwrap_or_default())
}

/// Returns the object of a line with a checksum, given without its line break.
///
/// # Errors
/// If there is no checksum or it does not match, with the reason as text.
pub fn read_checked_line(line: &[u8]) -> Result<Vec<u8>, &'static str> {
    let rest = line
        .strip_prefix(CHECKED_LINE_START.as_bytes())
        .and_then(|rest| rest.split_at_checked(CHECKSUM_DIGITS));
    let parts = rest.and_then(|(sum, rest)| Some((sum, rest.strip_prefix(br#"","#)?)));
    let (sum, rest) = parts.ok_or("the line has no checksum: it is damaged, or of an earlier version")?;
    let object = [b"{", rest].concat();
    match checksum(&object).as_bytes() == sum {
        true => Ok(object),
        false => Err("the line is damaged: its checksum is that of another text"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use tempfile::tempdir;

    fn names(folder: &Path) -> Vec<String> {
        let files = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            files.map(|file| file.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_as_a_whole() {
        let folder = tempdir().unwrap();
        let file = folder.path().join("a.txt");
        write_whole(&file, b"first").unwrap();
        write_whole(&file, b"second").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"second");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn what_cannot_be_written_leaves_nothing() {
        let folder = tempdir().unwrap();
        let place = folder.path().join("not a folder");
        std::fs::write(&place, "").unwrap();
        assert!(write_whole(&place.join("a.txt"), b"text").is_err());
        assert!(check_writable(&folder.path().join("new/a.txt")).is_err());
        assert!(check_writable(folder.path()).is_err() && write_whole(folder.path(), b"text").is_err());
        assert!(check_writable(&folder.path().join("a.txt")).is_ok());
        assert_eq!(names(folder.path()), ["not a folder"]);
    }

    #[test]
    fn only_what_this_program_left_unfinished_is_removed() {
        let folder = tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let left = unfinished(&at("a.txt"), None).unwrap().into_temp_path().keep().unwrap();
        assert!(left.exists());
        let others =
            [".manifactor-0123.unfinished", ".manifactor-01234567890-abcd.unfinished", "notes.unfinished"];
        for name in others {
            std::fs::write(at(name), "kept").unwrap();
        }
        std::fs::create_dir(at(".manifactor-0123456789abcdef.unfinished")).unwrap();
        remove_unfinished(folder.path());
        assert!(!left.exists());
        assert_eq!(names(folder.path()).len(), 4);
    }

    #[cfg(unix)]
    mod on_unix {
        use super::*;
        use std::fs::Permissions;
        use std::os::unix::fs::{PermissionsExt, symlink};

        fn mode(path: &Path) -> u32 {
            path.metadata().unwrap().permissions().mode() & 0o777
        }

        #[test]
        fn a_file_that_is_replaced_keeps_its_permissions() {
            let folder = tempdir().unwrap();
            let file = folder.path().join("secret.json");
            for wanted in [0o600, 0o640, 0o444] {
                std::fs::write(&file, "before").unwrap_or_default();
                std::fs::set_permissions(&file, Permissions::from_mode(wanted)).unwrap();
                write_whole(&file, b"after").unwrap();
                assert_eq!((mode(&file), std::fs::read(&file).unwrap()), (wanted, b"after".to_vec()));
            }
            // A new file has the permissions of any new file.
            let (ours, usual) = (folder.path().join("ours"), folder.path().join("usual"));
            write_whole(&ours, b"").unwrap();
            std::fs::write(&usual, "").unwrap();
            assert_eq!(mode(&ours), mode(&usual));
        }

        #[test]
        fn what_a_link_points_to_is_left_alone() {
            let folder = tempdir().unwrap();
            let [file, link]: [PathBuf; 2] = ["precious", "link"].map(|name| folder.path().join(name));
            std::fs::write(&file, "precious").unwrap();
            symlink(&file, &link).unwrap();
            assert!(open_regular(&link).is_err());
            write_whole(&link, b"ours").unwrap();
            assert_eq!(std::fs::read(&link).unwrap(), b"ours");
            assert_eq!(std::fs::read(&file).unwrap(), b"precious");
            // A link to a missing file does not create that file.
            let dangling = folder.path().join("dangling");
            symlink(folder.path().join("nothing"), &dangling).unwrap();
            assert!(open_regular(&dangling).is_err() && !folder.path().join("nothing").exists());
        }

        #[test]
        fn a_device_is_written_to_and_stays() {
            let folder = tempdir().unwrap();
            let link = folder.path().join("null.json");
            symlink("/dev/null", &link).unwrap();
            check_writable(&link).unwrap();
            write_whole(&link, b"text").unwrap();
            assert!(link.symlink_metadata().unwrap().is_symlink());
            assert!(open_regular(Path::new("/dev/null")).is_err());
        }
    }

    #[test]
    fn every_change_of_a_character_is_found() {
        let line = checked_line(r#"{"class":"wine glass"}"#);
        let line = line.trim_end_matches('\n').as_bytes();
        assert_eq!(read_checked_line(line).unwrap(), br#"{"class":"wine glass"}"#.to_vec());
        for place in 0..line.len() {
            for bit in 0..8 {
                let mut damaged = line.to_vec();
                damaged[place] ^= 1 << bit;
                assert!(read_checked_line(&damaged).is_err(), "byte {place}, bit {bit}");
            }
            assert!(read_checked_line(&line[..place]).is_err());
        }
    }
}
