use super::*;
use std::fs;
use tempfile::{TempDir, tempdir};

fn claim(folder: &Path, command: &str, force: bool) -> Result<OutputFolder, FolderError> {
    OutputFolder::claim(folder, command, Path::new("/robot/desk.toml"), force)
}

/// Returns a folder with one file.
fn with(name: &str, text: &str) -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let files = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = files.map(|f| f.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn the_same_command_may_write_again() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("new/out");
    drop(claim(&out, "run", false).unwrap());
    fs::write(out.join("report.json"), "{}").unwrap();
    drop(claim(&out, "run", false).unwrap());
    assert_eq!(fs::read_to_string(out.join(MARKER_FILE)).unwrap(), "manifactor run \"/robot/desk.toml\"\n");
}

#[test]
fn another_command_or_document_may_not() {
    let folder = tempdir().unwrap();
    drop(claim(folder.path(), "run", false).unwrap());
    fs::write(folder.path().join("report.json"), "{}").unwrap();
    let refused = claim(folder.path(), "simulate", false).unwrap_err().to_string();
    let expected =
        r#"the results of `manifactor run "/robot/desk.toml"`, and `manifactor simulate "/robot/desk.toml"`"#;
    assert!(refused.contains(expected), "{refused}");
    let other = Path::new("/other/desk.toml");
    assert!(matches!(
        OutputFolder::claim(folder.path(), "run", other, false),
        Err(FolderError::Other { .. })
    ));
    drop(OutputFolder::claim(folder.path(), "run", other, true).unwrap());
    assert!(claim(folder.path(), "run", false).is_err());
}

#[test]
fn a_folder_of_other_files_is_refused_and_unchanged() {
    let folder = with("odometry.txt", "a recording");
    let refused = claim(folder.path(), "simulate", false).unwrap_err();
    assert!(refused.to_string().ends_with("such as odometry.txt"), "{refused}");
    assert_eq!(names(folder.path()), ["odometry.txt"]);
    drop(claim(folder.path(), "simulate", true).unwrap());
    assert!(claim(folder.path(), "simulate", false).is_ok());
}

#[test]
fn a_file_that_is_called_like_a_marker_is_none() {
    let folder = with(MARKER_FILE, "notes");
    let refused = claim(folder.path(), "run", false).unwrap_err();
    assert!(refused.to_string().ends_with("such as .manifactor"), "{refused}");
    assert_eq!(fs::read_to_string(folder.path().join(MARKER_FILE)).unwrap(), "notes");
    // the marker of a process that was killed before it wrote anything
    for text in ["", "manifactor simulate \"a.toml\"\nprocess 12\n"] {
        let folder = with(MARKER_FILE, text);
        assert!(claim(folder.path(), "run", false).is_ok());
        let folder = with(MARKER_FILE, text);
        fs::write(folder.path().join("precious"), "").unwrap();
        assert!(claim(folder.path(), "run", false).is_err());
    }
}

#[test]
fn two_processes_at_once_are_refused_and_the_first_is_named() {
    let folder = tempdir().unwrap();
    let first = claim(folder.path(), "run", false).unwrap();
    for force in [false, true] {
        let refused = claim(folder.path(), "run", force).unwrap_err().to_string();
        let us = format!("in use: process {} writes into it", std::process::id());
        assert!(refused.ends_with(&us), "{refused}");
    }
    drop(first);
    assert!(claim(folder.path(), "run", false).is_ok());
}

#[test]
fn the_folder_of_a_variant_belongs_to_its_run() {
    let folder = tempdir().unwrap();
    drop(claim(folder.path(), "run", false).unwrap());
    let variant = folder.path().join("estimate");
    fs::create_dir(&variant).unwrap();
    fs::write(variant.join("config.toml"), "").unwrap();
    assert!(claim(&variant, "experiment", false).is_err());
    // as a run of its `config.toml`, which is a different document
    let config = variant.join("config.toml");
    assert!(OutputFolder::claim(&variant, "run", &config, false).is_ok());
}

#[test]
fn leftovers_of_a_killed_run_are_removed_and_other_files_are_not() {
    let folder = tempdir().unwrap();
    let left = ".manifactor-0123456789abcdef.unfinished";
    let inner = folder.path().join("repeat");
    fs::create_dir(&inner).unwrap();
    for place in [folder.path(), &inner] {
        fs::write(place.join(left), "half").unwrap();
        fs::write(place.join("thesis.unfinished"), "precious").unwrap();
    }
    // files that exist before a forced claim were not written by this command
    drop(claim(folder.path(), "experiment", true).unwrap());
    assert!(inner.join(left).exists() && folder.path().join(left).exists());
    drop(claim(folder.path(), "experiment", false).unwrap());
    assert_eq!(names(folder.path()), [MARKER_FILE, "repeat", "thesis.unfinished"]);
    assert_eq!(names(&inner), ["thesis.unfinished"]);
}

#[test]
#[cfg(unix)]
fn a_marker_that_is_a_link_is_refused() {
    let folder = tempdir().unwrap();
    let precious = folder.path().join("precious");
    fs::write(&precious, "manifactor run\nprecious").unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    std::os::unix::fs::symlink(&precious, out.join(MARKER_FILE)).unwrap();
    for force in [false, true] {
        let refused = claim(&out, "run", force).unwrap_err();
        assert!(refused.to_string().contains("it is a link"), "{refused}");
    }
    assert_eq!(fs::read_to_string(&precious).unwrap(), "manifactor run\nprecious");
}
