//! `manifactor new`: writes the files of a new crate.
use crate::failure::Failure;
use crate::output;
use crate::status::Status;
use clap::{Args, Subcommand};
use manifactor::graph::catalogue::find;
use manifactor::slam::output::write_whole;
use std::path::{Path, PathBuf};

/// Write the files of a new project.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor new plugin on_the_shelf")]
pub(crate) struct New {
    #[command(subcommand)]
    project: NewProject,
}

#[derive(Debug, Subcommand)]
enum NewProject {
    Plugin(Plugin),
}

/// A crate with one factor, its tests, an example graph and run, a binary that knows the factor, and a
/// README.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor new plugin on_the_shelf")]
struct Plugin {
    /// Name of the folder, the crate and the factor, in snake case or with hyphens.
    name: String,
    /// A local checkout of Manifactor to depend on. Default: its Git repository.
    #[arg(long, value_name = "PATH")]
    manifactor: Option<PathBuf>,
}

const FILES: [(&str, &str); 9] = [
    (".gitignore", include_str!("../plugin_template/gitignore.in")),
    ("Cargo.toml", include_str!("../plugin_template/Cargo.toml.in")),
    ("README.md", include_str!("../plugin_template/README.md.in")),
    ("graph.toml", include_str!("../plugin_template/graph.toml.in")),
    ("src/lib.rs", include_str!("../plugin_template/lib.rs.in")),
    ("src/main.rs", include_str!("../plugin_template/main.rs.in")),
    ("src/{name}.rs", include_str!("../plugin_template/factor.rs.in")),
    ("run.toml", include_str!("../plugin_template/run.toml.in")),
    ("tests/examples.rs", include_str!("../plugin_template/examples_test.rs.in")),
];

impl New {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let NewProject::Plugin(plugin) = &self.project;
        plugin.write()
    }
}

impl Plugin {
    fn write(&self) -> Result<Status, Failure> {
        let folder = Path::new(&self.name);
        let crate_name = folder.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let names = Names::of(crate_name)?;
        if find("factor", &names.factor).is_some() {
            return Err(Failure::with_help(
                format!("the factor `{}` exists already; see `manifactor explain {0}`", names.factor),
                "choose another name: a binary cannot have two factors with one name",
            ));
        }
        let (source, cli_source) = self.sources()?;
        // a dangling symbolic link counts as existing too
        if folder.symlink_metadata().is_ok() {
            let there = format!("{} exists already", folder.display());
            return Err(Failure::with_help(there, "choose another name, or remove the folder first"));
        }
        for (path, text) in FILES {
            let fill = |text: &str| {
                text.replace("{crate}", &names.of_crate)
                    .replace("{crate_ident}", &names.of_crate.replace('-', "_"))
                    .replace("{name}", &names.factor)
                    .replace("{type}", &names.of_type)
                    .replace("{source}", &source)
                    .replace("{cli_source}", &cli_source)
            };
            let path = folder.join(fill(path));
            write_whole(&path, fill(text))?;
        }
        output::print(&format!("{0} is written. Next steps:\n  cd {0}\n  cargo test\n", folder.display()));
        Ok(Status::Done)
    }

    /// Returns the sources of the two crates that the plugin depends on, for its manifest.
    fn sources(&self) -> Result<(String, String), Failure> {
        let Some(path) = &self.manifactor else {
            let git = format!("git = \"{}\"", env!("CARGO_PKG_REPOSITORY"));
            return Ok((git.clone(), git));
        };
        let root = path.canonicalize().map_err(Failure::at(path))?;
        let cli = root.join("plugins").join("cli");
        if !cli.join("Cargo.toml").is_file() {
            let what = format!(
                "{} is not a checkout of Manifactor: it has no plugins/cli/Cargo.toml",
                root.display()
            );
            return Err(Failure::with_help(what, "give the root folder of a checkout"));
        }
        // a basic string of TOML can hold any character, and JSON strings are valid TOML
        let text = |path: &Path| serde_json::to_string(&path.display().to_string()).unwrap_or_default();
        Ok((format!("path = {}", text(&root)), format!("path = {}", text(&cli))))
    }
}

/// The names of the crate, the factor and its type.
struct Names {
    of_crate: String,
    factor: String,
    of_type: String,
}

impl Names {
    fn of(name: &str) -> Result<Self, Failure> {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
        let words: Vec<&str> = name.split(['_', '-']).collect();
        let begins = |w: &&str| w.starts_with(|c: char| c.is_ascii_lowercase());
        if !(name.chars().all(plain) && words.iter().all(begins))
            || KEYWORDS.contains(&name)
            || TAKEN.contains(&name)
        {
            return Err(Failure::with_help(
                format!("`{name}` cannot be the name of a crate and of a factor"),
                "use words of lower-case letters and digits, joined by `_` or `-`, such as `on_the_shelf`, and no keyword of Rust",
            ));
        }
        // Cargo treats - and _ alike
        if CRATES.contains(&name.replace('-', "_").as_str()) {
            return Err(Failure::with_help(
                format!(
                    "`{name}` is the name of a crate of Rust or of Manifactor, so a plugin cannot have it"
                ),
                "choose another name, such as `on_the_shelf`",
            ));
        }
        let capital = |w: &&str| w[..1].to_ascii_uppercase() + &w[1..];
        Ok(Self {
            of_crate: name.to_owned(),
            factor: name.replace('-', "_"),
            of_type: words.iter().map(capital).collect(),
        })
    }
}

/// Reserved words of Rust, and files of a crate that are not modules.
const TAKEN: [&str; 15] = [
    "abstract", "become", "box", "do", "final", "macro", "override", "priv", "try", "typeof", "unsized",
    "virtual", "yield", "main", "lib",
];

/// Crate names that would clash: crates of Rust, of the workspace and of a plugin's manifest, and the build
/// script.
const CRATES: [&str; 36] = [
    "alloc",
    "build",
    "core",
    "proc_macro",
    "std",
    "test",
    "schemars",
    "serde",
    "manifactor",
    "manifactor_association",
    "manifactor_bench",
    "manifactor_cli",
    "manifactor_config",
    "manifactor_document",
    "manifactor_experiment",
    "manifactor_expression",
    "manifactor_formats",
    "manifactor_fuzz",
    "manifactor_geometry",
    "manifactor_graph",
    "manifactor_inertial",
    "manifactor_mapping",
    "manifactor_metrics",
    "manifactor_online",
    "manifactor_python",
    "manifactor_quadric",
    "manifactor_recording",
    "manifactor_ros",
    "manifactor_run",
    "manifactor_semantic",
    "manifactor_simulator",
    "manifactor_slam",
    "manifactor_smoother",
    "manifactor_solve",
    "manifactor_testing",
    "manifactor_viz",
];

/// Keywords, which cannot be the name of a module.
const KEYWORDS: [&str; 38] = [
    "as", "async", "await", "break", "const", "continue", "crate", "dyn", "else", "enum", "extern", "false",
    "fn", "for", "gen", "if", "impl", "in", "let", "loop", "match", "mod", "move", "mut", "pub", "ref",
    "return", "self", "static", "struct", "super", "trait", "true", "type", "unsafe", "use", "where",
    "while",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_the_conventions_of_rust() {
        let names = Names::of("on-the_shelf2").unwrap();
        assert_eq!((names.factor.as_str(), names.of_type.as_str()), ("on_the_shelf2", "OnTheShelf2"));
        for bad in [
            "",
            "Shelf",
            "2shelf",
            "on__shelf",
            "the shelf",
            "match",
            "try",
            "yield",
            "main",
            "lib",
            "shelf-",
            "../é",
        ] {
            assert!(Names::of(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn crates_of_rust_and_of_the_workspace_are_refused() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let manifest = std::fs::read_to_string(root.join("Cargo.toml")).unwrap();
        let members = manifest.lines().find_map(|line| line.strip_prefix("members = ")).unwrap();
        let members: Vec<String> = serde_json::from_str(members).unwrap();
        let name = |member: String| {
            let manifest = std::fs::read_to_string(root.join(member).join("Cargo.toml")).unwrap();
            let name = manifest.lines().find_map(|line| line.strip_prefix("name = ")).unwrap().to_owned();
            name.trim_matches('"').to_owned()
        };
        let packages: Vec<String> = members.into_iter().map(name).collect();
        assert!(packages.iter().any(|package| package == "manifactor-cli"));
        let of_rust =
            ["build", "std", "core", "alloc", "test", "proc_macro", "proc-macro", "manifactor_cli", "serde"];
        for taken in packages.iter().map(String::as_str).chain(of_rust) {
            let error = Names::of(taken).err().unwrap().to_string();
            assert!(error.contains("is the name of a crate"), "{taken}: {error}");
        }
        assert!(Names::of("manifactor-shelf").is_ok() && Names::of("cores").is_ok());
    }
}
