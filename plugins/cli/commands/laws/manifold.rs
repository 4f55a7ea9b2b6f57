//! `manifactor check-manifold`: whether a type of variables keeps the laws, before a factor meets it.
use super::linked;
use crate::failure::Failure;
use crate::output;
use crate::status::Status;
use clap::Args;
use manifactor::testing::ManifoldCheck;

/// Check a type of variables: that `retract` and `local` undo each other, `seed` against differences, and its document.
///
/// At random pairs of points: around the example in its docs, near it and far from it, wherever its registered strategy draws,
/// and at its singular points. Exit code 1 where a law is broken; the two points and the tangent vector are shown.
#[derive(Debug, Args)]
pub(crate) struct CheckManifold {
    /// The type, one of `manifactor list variables`.
    name: String,
    /// How many pairs of points are drawn.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    points: u32,
    /// Where the random numbers begin: the same seed draws the same points.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print JSON: everything that was found.
    #[arg(long)]
    pub(crate) json: bool,
}

impl CheckManifold {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let entry = linked("variable", &self.name, "register_manifold!(…)")?;
        let check = ManifoldCheck { points: self.points as usize, seed: self.seed };
        let report = check.run(entry).map_err(Failure::input)?;
        match self.json {
            true => output::json(&report),
            false => output::print(&report.to_string()),
        }
        Ok(if report.holds() { Status::Done } else { Status::Broken })
    }
}
