//! The solver, the start and their settings, from `--solver`, `--start`, `--set` and the document.
use crate::failure::Failure;
use crate::input::choice::choose;
use clap::Args;
use manifactor::config::{Document, Section, SourceText};
use manifactor::solve::{Optimizer, Start};

/// `--solver`, `--start` and `--set`.
#[derive(Debug, Args)]
pub(crate) struct SolverArguments {
    /// The solver, one of `manifactor list solvers`, with its default settings; `--set` still applies. Short
    /// names: `lm` for levenberg_marquardt, `gn` for gauss_newton, `dl` for dogleg.
    #[arg(long, value_name = "NAME", value_parser = full_name)]
    solver: Option<String>,
    /// The initial values, one of `manifactor list starts`. Default: the values in the graph.
    #[arg(long, value_name = "NAME")]
    start: Option<String>,
    /// Set a value of the document, such as `solver.stop.max_iterations=50` or
    /// `factors[2].noise.sigma=0.1`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Short names of solvers, with the names in the catalogue.
const SHORT_NAMES: [(&str, &str); 3] =
    [("lm", "levenberg_marquardt"), ("gn", "gauss_newton"), ("dl", "dogleg")];

/// Returns the name in the catalogue for the name of a solver on the command line.
#[expect(clippy::unnecessary_wraps, reason = "the form of a parser of arguments")]
fn full_name(name: &str) -> Result<String, String> {
    let short = SHORT_NAMES.iter().find(|(short, _)| short.eq_ignore_ascii_case(name));
    Ok(short.map_or(name, |(_, full)| full).to_owned())
}

impl SolverArguments {
    /// Returns whether `--start` is given.
    pub(crate) fn names_a_start(&self) -> bool {
        self.start.is_some()
    }

    /// Creates arguments with `--set` alone.
    pub(crate) fn set_only(set: &[String]) -> Self {
        Self { solver: None, start: None, set: set.to_vec() }
    }

    /// Applies `--set` to the document.
    pub(crate) fn apply(&self, document: &mut Document) -> Result<(), Failure> {
        Ok(document.set(&self.set)?)
    }

    /// Reads the field `solver` of a document's table. Default: `auto`.
    pub(crate) fn read_solver(
        &self,
        section: &mut Section<'_>,
        document: &SourceText,
    ) -> Option<Box<dyn Optimizer>> {
        let argument = ("--solver", self.solver.as_deref());
        choose(section, "solver", argument, "auto", document)
    }

    /// Reads the field `start` of a document's table. Default: the values in the graph.
    pub(crate) fn read_start(
        &self,
        section: &mut Section<'_>,
        document: &SourceText,
    ) -> Option<Box<dyn Start>> {
        choose(section, "start", ("--start", self.start.as_deref()), "given", document)
    }
}

#[cfg(test)]
mod tests {
    use super::{SHORT_NAMES, full_name};
    use manifactor::graph::catalogue::find;

    #[test]
    fn short_names_stand_for_registered_solvers_and_hide_none() {
        for (short, full) in SHORT_NAMES {
            assert!(find("solver", full).is_some() && find("solver", short).is_none(), "{short}: {full}");
            assert_eq!(full_name(&short.to_uppercase()).as_deref(), Ok(full));
        }
        assert_eq!(full_name("auto").as_deref(), Ok("auto"));
    }
}
