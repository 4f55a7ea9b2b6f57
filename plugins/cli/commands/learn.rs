//! `manifactor learn`: learns semantic rules from maps.
use crate::failure::Failure;
use crate::input::destination::refuse_to_replace;
use crate::input::kind::{self, InputKind};
use crate::output;
use crate::output::text::{Table, count};
use crate::status::Status;
use clap::Args;
use manifactor::config::{Document, Format};
use manifactor::formats::whole::{check_writable, write_whole};
use manifactor::slam::prior_map::PriorMap;
use manifactor::slam::semantics::learn::{LearnedOrientation, LearnedPriors};
use std::path::{Path, PathBuf};

/// Learn priors from the maps of earlier runs: sizes and orientation of objects, by class.
///
/// Writes a file of semantic rules, which a run reads with `semantics = "priors.toml"`. The sizes of a class
/// are shrunk towards the table of `sizes = "household"`. Classes that the maps do not have get the prior of
/// all objects together.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  manifactor run examples/desk/desk.toml --out out/desk\n  manifactor learn out/desk/ours/map.json --out priors.toml"
)]
pub(crate) struct Learn {
    /// The maps: map.json in the folder of a variant of a run.
    #[arg(required = true, value_name = "MAP")]
    maps: Vec<PathBuf>,
    /// Write the rules to this file (.toml).
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
}

impl Learn {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        self.check_out()?;
        let maps: Vec<PriorMap> = self.maps.iter().map(|map| read(map)).collect::<Result<_, _>>()?;
        self.warn_of_repeated_objects(&maps);
        let learned = LearnedPriors::learn(&maps).map_err(|error| {
            Failure::with_help(error, "give the map.json of a run that maps objects of known classes")
        })?;
        for (class, similar) in learned.unknown_classes() {
            let similar = similar.map_or(String::new(), |name| format!("; is it `{name}`?"));
            output::print_note(&format!(
                "`household` has no size of `{class}`, so its prior is shrunk towards all objects{similar}"
            ));
        }
        write_whole(&self.out, learned.to_string().as_bytes()).map_err(Failure::at(&self.out))?;
        let (classes, objects) =
            (count(learned.classes.len(), "class"), count(learned.pooled.objects, "object"));
        let written = format!("\n{classes} from {objects} written to {}\n", self.out.display());
        output::print(&(table(&learned).text() + &written));
        Ok(Status::Done)
    }

    /// Warns of maps of one room: an object in several maps counts as several, which makes the priors too strong.
    fn warn_of_repeated_objects(&self, maps: &[PriorMap]) {
        for (i, map) in maps.iter().enumerate() {
            let earlier = maps.iter().zip(&self.maps).take(i);
            for (other, path) in earlier {
                let (shared, smaller) =
                    (map.shared_objects(other), map.objects.len().min(other.objects.len()));
                if 2 * shared > smaller {
                    let again = self.maps.get(i).unwrap_or(path).display();
                    output::print_message(&format!(
                        "warning: {shared} of {} in {again} are also in {}, and count twice: give one map of each room",
                        count(map.objects.len(), "object"),
                        path.display()
                    ));
                }
            }
        }
    }

    /// Returns an error if the rules cannot be written.
    fn check_out(&self) -> Result<(), Failure> {
        if !matches!(Format::of_path(&self.out), Some(Format::Toml)) {
            let message = format!("{}: rules are written as TOML", self.out.display());
            return Err(Failure::with_help(message, "give a name that ends in .toml"));
        }
        if !self.force {
            refuse_to_replace(&self.out, &self.out, "exists already")?;
        }
        check_writable(&self.out).map_err(Failure::at(&self.out))
    }
}

/// Reads a map, and warns if little can be learned from it.
fn read(path: &Path) -> Result<PriorMap, Failure> {
    kind::MAP.refuse_folder(path)?;
    if let Ok(document) = Document::open(path) {
        kind::MAP.check(path, InputKind::of_document(&document))?;
    }
    let map = PriorMap::read(path)?;
    let path = path.display();
    if map.objects.is_empty() {
        output::print_message(&format!("warning: {path} has no objects"));
    } else if map.up.is_none() {
        output::print_message(&format!(
            "warning: {path} has no up direction, so no orientation is learned from it; set `[gravity]` in its run"
        ));
    }
    Ok(map)
}

fn table(learned: &LearnedPriors) -> Table {
    let mut table =
        Table::of_numbers(&["class", "objects", "semi-axes (m)", "spread", "vertical axis", "of"]);
    let pooled = ("all", &learned.pooled);
    let classes = learned.classes.iter().map(|(class, prior)| (class.as_str(), prior));
    for (class, prior) in classes.chain([pooled]) {
        let orientation = prior.orientation.orientation(&learned.pooled.orientation);
        let vertical = match orientation {
            LearnedOrientation::Longest => "longest",
            LearnedOrientation::Shortest => "shortest",
            LearnedOrientation::Lying => "not the longest",
            LearnedOrientation::Resting => "any",
            LearnedOrientation::Free => "-",
        };
        table.row([
            class.to_owned(),
            prior.objects.to_string(),
            prior.semi_axes().map(|s| format!("{s:.3}")).join(" "),
            prior.sizes.map(|size| format!("{:.2}", size.sigma.exp())).join(" "),
            vertical.to_owned(),
            prior.orientation.objects().to_string(),
        ]);
    }
    table
}
