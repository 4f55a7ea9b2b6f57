//! Dependencies between the folders of a crate: the rooms of a house, in floors.
//!
//! A room is a module at the root of a crate, with its folder. Rooms that depend on each other are one
//! room.
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Largest number of source files in a folder, small enough for an overview.
const FILES: usize = 14;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn is_crate(folder: &Path) -> bool {
    folder.join("Cargo.toml").is_file() && folder.join("lib.rs").is_file()
}

/// The folders of crates below `core` and `plugins`; a crate's folder may hold others.
fn crates() -> Vec<PathBuf> {
    let mut folders = vec![root().join("core"), root().join("plugins")];
    let mut crates = vec![];
    while let Some(folder) = folders.pop() {
        let inner = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        folders.extend(inner.filter(|path| is_crate(path)));
        crates.extend(is_crate(&folder).then_some(folder));
    }
    crates.sort();
    crates
}

/// The source files of a crate below a folder, without tests, examples and other crates.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = vec![];
    for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() && !is_crate(&path) && !["tests", "examples", "plugin_template"].contains(&name) {
            files.extend(sources(&path));
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") {
            files.push(path);
        }
    }
    files
}

/// Returns the first names after `crate::` in the imports and paths of a file, without comments and tests.
fn named(source: &str) -> BTreeSet<String> {
    // a module of tests in a file of its own ends nothing
    let is_block =
        |(at, _): &(usize, &str)| source[*at..].lines().nth(1).is_some_and(|line| line.ends_with('{'));
    let tests = source.match_indices("#[cfg(test)]\nmod").find(is_block).map_or(source.len(), |(at, _)| at);
    let code: String = source[..tests]
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n")
        .collect();
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut names = BTreeSet::new();
    for (at, marker) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c == '$' || c == '_' || c.is_alphanumeric()) {
            continue;
        }
        let rest = &code[at + marker.len()..];
        match rest.strip_prefix('{').and_then(|group| group.split_once(';')) {
            None => names.extend([word(rest)]),
            Some((group, _)) => {
                let mut depth = 0;
                let parts = group.split(|c| {
                    depth += i32::from(c == '{') - i32::from(c == '}');
                    c == ',' && depth == 0
                });
                names.extend(parts.map(|part| word(part.trim_start())));
            }
        }
    }
    names
}

/// Returns the room of each name that a crate exports at its root.
fn shown(lib: &str) -> BTreeMap<String, String> {
    let uses = lib.split(';').filter_map(|part| part.rsplit_once("pub use ")).map(|(_, path)| path);
    let mut shown = BTreeMap::new();
    for (room, names) in uses.filter_map(|path| path.split_once("::")) {
        for name in names.split([',', '{', '}', ':']).map(str::trim).filter(|name| !name.is_empty()) {
            shown.insert(name.to_owned(), room.trim().to_owned());
        }
    }
    shown
}

/// Returns the rooms that each room needs.
fn needs(of_crate: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let lib = std::fs::read_to_string(of_crate.join("lib.rs")).unwrap();
    let shown = shown(&lib);
    let mut needs: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let room_of = |file: &Path| {
        let first = file.strip_prefix(of_crate).unwrap().components().next().unwrap();
        first.as_os_str().to_str().unwrap().trim_end_matches(".rs").to_owned()
    };
    let files = sources(of_crate);
    let rooms: BTreeSet<String> = files
        .iter()
        .map(|file| room_of(file))
        .filter(|r| !["lib", "main", "testing"].contains(&r.as_str()))
        .collect();
    for file in &files {
        let room = room_of(file);
        if !rooms.contains(&room) {
            continue;
        }
        let text = std::fs::read_to_string(file).unwrap();
        // at the root of a crate, `super` is the crate
        let is_at_root = file.parent() == Some(of_crate);
        let text = if is_at_root { text.replace("super::", "crate::") } else { text };
        let others = named(&text).into_iter().map(|name| shown.get(&name).cloned().unwrap_or(name));
        let others: Vec<_> = others.filter(|other| rooms.contains(other) && *other != room).collect();
        needs.entry(room).or_default().extend(others);
    }
    needs
}

/// Returns the rooms of a crate by floor, from the ground up. The remaining rooms depend on each other, or
/// on such rooms; they are returned with their needs.
fn floors(of_crate: &Path) -> (Vec<BTreeSet<String>>, BTreeMap<String, BTreeSet<String>>) {
    let (mut left, mut floors) = (needs(of_crate), vec![]);
    loop {
        let floor: BTreeSet<String> =
            left.iter().filter(|(_, needs)| needs.is_empty()).map(|(room, _)| room.clone()).collect();
        if floor.is_empty() {
            return (floors, left);
        }
        left.retain(|room, _| !floor.contains(room));
        left.values_mut().for_each(|needs| needs.retain(|need| !floor.contains(need)));
        floors.push(floor);
    }
}

#[test]
fn rooms_are_in_floors() {
    let mut circles = vec![];
    for of_crate in crates() {
        let name = of_crate.strip_prefix(root()).unwrap().display().to_string();
        let needs = floors(&of_crate).1.into_iter();
        circles.extend(needs.map(|(room, needs)| format!("{name}: {room} needs {needs:?}")));
    }
    assert!(circles.is_empty(), "rooms that need each other, and what needs those:\n{}", circles.join("\n"));
}

#[test]
fn the_plan_of_the_house_is_as_it_is_built() {
    let page = std::fs::read_to_string(root().join("docs/decisions/folders.md")).unwrap();
    let mut wrong = vec![];
    for of_crate in crates() {
        let name = of_crate.file_name().unwrap().to_str().unwrap();
        let floor = |rooms: &BTreeSet<String>| rooms.iter().cloned().collect::<Vec<_>>().join(", ");
        let floors = floors(&of_crate).0.iter().map(floor).collect::<Vec<_>>().join(" · ");
        let files = sources(&of_crate).iter().filter(|file| file.parent() == Some(&of_crate)).count();
        let is_row = |line: &&str| line.starts_with(&format!("| {name} | {floors} | {files} |"));
        if page.lines().filter(is_row).count() != 1 {
            wrong.push(format!("| {name} | {floors} | {files} |"));
        }
    }
    assert!(wrong.is_empty(), "docs/decisions/folders.md should have these rows:\n{}", wrong.join("\n"));
}

#[test]
fn no_folder_has_more_files_than_a_reader_takes_in() {
    let tests = crates().into_iter().map(|of_crate| of_crate.join("tests")).filter(|tests| tests.is_dir());
    for tree in crates().into_iter().chain(tests).chain([root().join("tests")]) {
        let mut files: BTreeMap<PathBuf, usize> = BTreeMap::new();
        for file in sources(&tree) {
            *files.entry(file.parent().unwrap().to_owned()).or_default() += 1;
        }
        for (folder, count) in files {
            assert!(count <= FILES, "{} has {count} files; sort them into folders", folder.display());
        }
    }
}
