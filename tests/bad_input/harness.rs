//! Runs the binary on a file, and shows the result.
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Time limit of a case: hundreds of times the duration of the slowest one on a busy machine.
const PATIENCE: Duration = Duration::from_secs(600);
/// Limit of the address space of a case. Unit: KiB.
const MEMORY: u32 = 4 << 20;
/// Largest part of an input that is shown. Unit: bytes.
const SHOWN: usize = 300;

/// A name, and the content of the file.
pub(crate) type Case = (&'static str, Vec<u8>);

/// Creates a case from text.
pub(crate) fn text(name: &'static str, text: impl Into<String>) -> Case {
    (name, text.into().into_bytes())
}

/// Runs `command` on each case, with `FILE` for the file, and returns a report of all.
pub(crate) fn account(file: &str, command: &str, cases: Vec<Case>) -> String {
    let mut account = String::new();
    for (name, bytes) in cases {
        save_case(name, file, &bytes);
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(file), &bytes).unwrap();
        let _ = write!(account, "## {name}\n{}\n{}\n", shown(&bytes), ended(folder.path(), command, file));
    }
    account
}

/// Writes a case into the folder `MANIFACTOR_KEEP`, if it is set, for tests of other programs.
fn save_case(name: &str, file: &str, bytes: &[u8]) {
    let Some(folder) = std::env::var_os("MANIFACTOR_KEEP") else { return };
    let extension = Path::new(file).extension().unwrap().to_str().unwrap();
    let name = format!("{}.{extension}", name.replace(' ', "_"));
    std::fs::write(Path::new(&folder).join(name), bytes).unwrap();
}

/// Runs `command` in a folder, and returns its exit code and its messages.
pub(crate) fn ended(folder: &Path, command: &str, file: &str) -> String {
    let arguments = command.split_whitespace().map(|word| if word == "FILE" { file } else { word });
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_manifactor"))
        .args(arguments)
        .args(["--threads", "1"])
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .env_remove("MANIFACTOR_DATA")
        .stdin(Stdio::null())
        .stdout(std::fs::File::create(folder.join(".stdout")).unwrap())
        .stderr(std::fs::File::create(folder.join(".stderr")).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if begun.elapsed() > PATIENCE => {
                child.kill().unwrap();
                child.wait().unwrap();
                panic!("`{command}` hangs");
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let said = String::from_utf8(std::fs::read(folder.join(".stderr")).unwrap()).unwrap();
    let code = status.code().unwrap_or_else(|| panic!("{status}: {said}"));
    assert!(!said.contains("panicked"), "{said}");
    // temporary folders have a different name each time
    let said = said.replace(&folder.display().to_string(), "FOLDER");
    // the termination of a solve is a result and thus on standard output, above the parts that differ each
    // time
    let results = String::from_utf8(std::fs::read(folder.join(".stdout")).unwrap()).unwrap();
    let ending =
        results.lines().skip_while(|line| !line.starts_with("start")).skip(1).take(1).collect::<String>();
    let ending = if code == 1 { ending } else { String::new() };
    // with several undetermined directions, rounding selects the reported one
    let warnings = results.lines().filter(|line| line.starts_with("warning"));
    let warnings =
        warnings.map(|line| line.find("constrains").map_or(line, |at| &line[..at + "constrains".len()]));
    let warnings: String = warnings.map(|line| format!("{line}\n")).collect();
    let ending = warnings + &ending;
    assert!(code == 0 || !said.trim().is_empty() || !ending.is_empty(), "exit code {code}, and not a word");
    format!("exit code {code}\n{}\n", [said.trim_end(), &ending].join("\n").trim())
}

/// An input as text, shortened.
fn shown(bytes: &[u8]) -> String {
    let text: String =
        bytes.iter().take(SHOWN).flat_map(|b| std::ascii::escape_default(*b)).map(char::from).collect();
    let text = text.replace("\\n", "\n").replace("\\\"", "\"").replace("\\'", "'");
    let more = if bytes.len() > SHOWN { format!("… ({} bytes)", bytes.len()) } else { String::new() };
    text.lines()
        .chain([more.as_str()])
        .filter(|l| !l.is_empty())
        .fold(String::new(), |all, l| all + "    " + l + "\n")
}
