//! `manifactor check-manifold`: checks whether a type of variables keeps its laws before a factor uses it.
use super::linked;
use crate::failure::Failure;
use crate::output;
use crate::status::Status;
use clap::Args;
use manifactor::testing::ManifoldCheck;

/// Check a type of variables: that `retract` and `local` are inverse, `seed` against finite differences,
/// and its document.
///
/// The pairs of points are random: around the example in its docs, close together and far apart, from its
/// registered strategy, and at its singular points. If a law is broken, the two points and the tangent
/// vector are shown and the exit code is 1.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor check-manifold se3")]
pub(crate) struct CheckManifold {
    /// The type, one of `manifactor list variables`.
    name: String,
    /// Number of random pairs of points.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    points: u32,
    /// Seed of the random numbers; the same seed gives the same points.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print JSON: all results.
    #[arg(long)]
    pub(crate) json: bool,
}

impl CheckManifold {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let entry = linked("variable", &self.name, "register_manifold!(…)")?;
        let check = ManifoldCheck { points: self.points as usize, seed: self.seed };
        let report = check.run(entry).map_err(Failure::input)?;
        match self.json {
            true => output::print_json(&report),
            false => output::print(&report.to_string()),
        }
        Ok(if report.holds() { Status::Done } else { Status::Broken })
    }
}
