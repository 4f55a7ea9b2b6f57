//! Standard output: results only; everything else goes to stderr. And pictures, which go to files.
use crate::failure::Failure;
use crate::text;
use manifactor::slam::output::write_whole;
use manifactor::viz::Picture;
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether results were lost on their way out.
static LOST: AtomicBool = AtomicBool::new(false);

/// Whether standard output could not take all that was printed.
pub(crate) fn is_lost() -> bool {
    LOST.load(Ordering::Relaxed)
}

/// Prints text. A reader that has heard enough, such as `head`, is no error.
pub(crate) fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if let Err(error) = written
        && error.kind() != ErrorKind::BrokenPipe
    {
        LOST.store(true, Ordering::Relaxed);
        eprintln!("cannot write to standard output: {error}");
    }
}

/// Says something that is worth knowing, on stderr.
pub(crate) fn note(note: &str) {
    eprintln!("note: {}", text::printable(note));
}

/// Prints one JSON document.
pub(crate) fn json(value: &impl Serialize) {
    match serde_json::to_string_pretty(value) {
        Ok(text) => print(&(text + "\n")),
        Err(error) => eprintln!("cannot write JSON: {error}"),
    }
}

/// Writes pictures into a folder, each as SVG and as PNG.
pub(crate) fn pictures(folder: &Path, pictures: &[Picture]) -> Result<(), Failure> {
    for picture in pictures {
        write_whole(&folder.join(format!("{}.svg", picture.name)), picture.svg())?;
        write_whole(&folder.join(format!("{}.png", picture.name)), picture.png().map_err(Failure::input)?)?;
    }
    Ok(())
}
