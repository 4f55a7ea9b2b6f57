//! `manifactor evaluate`: a trajectory against the truth.
use crate::failure::Failure;
use crate::output;
use crate::output::text::{self, Table};
use crate::status::Status;
use clap::{Args, ValueEnum};
use manifactor::formats::detections::{self, Detection};
use manifactor::formats::tum;
use manifactor::graph::checked::Positive;
use manifactor::slam::metrics::{
    Alignment, MetricsError, Pairing, Statistics, absolute_error, align, associate, identity, relative_error,
};
use serde_json::json;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::iter::repeat;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Compare two trajectories in TUM's format (timestamp tx ty tz qx qy qz qw): ATE and RPE.
///
/// With --boxes, compare which boxes go together to objects instead, in two files of detections (CSV, as of the source `tum`).
#[derive(Debug, Args)]
pub(crate) struct Evaluate {
    /// The true trajectory; or the true objects of boxes.
    truth: PathBuf,
    /// The estimated one; or those that they were put to.
    estimate: PathBuf,
    /// Compare objects of boxes: of equal boxes at equal times, the `object_key` of the one file with that of the other. Boxes that
    /// have none, or 0, in the first do not count; in the second they are alone.
    #[arg(long, conflicts_with_all = ["align", "within", "delta", "all_pairs"])]
    boxes: bool,
    /// How the estimate is brought into the frame of the truth.
    #[arg(long, value_enum, default_value = "se3")]
    align: Align,
    /// How far apart in time two poses of one pair may be, in seconds.
    #[arg(long, value_name = "SECONDS", default_value = "0.02", value_parser = positive, allow_negative_numbers = true)]
    within: Positive,
    /// Poses between the two ends of a relative error.
    #[arg(long, value_name = "POSES", default_value = "1")]
    delta: NonZeroUsize,
    /// Relative errors from each pose on, not from each end to the next.
    #[arg(long)]
    all_pairs: bool,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

fn positive(text: &str) -> Result<Positive, String> {
    let number = text.parse::<f64>().map_err(|_| "expected a number".to_owned())?;
    Positive::new(number).map_err(|e| e.to_string())
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Align {
    /// The rotation and translation that bring the positions closest.
    Se3,
    /// And a scale.
    Sim3,
    /// So that the first poses agree.
    First,
    /// Not at all.
    None,
}

impl From<Align> for Alignment {
    fn from(align: Align) -> Self {
        match align {
            Align::Se3 => Self::Se3,
            Align::Sim3 => Self::Sim3,
            Align::First => Self::FirstPose,
            Align::None => Self::None,
        }
    }
}

impl Evaluate {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        if self.boxes {
            return self.boxes();
        }
        let (truth, estimate) = (tum::read(&self.truth)?, tum::read(&self.estimate)?);
        let pairing = if self.all_pairs { Pairing::All } else { Pairing::Consecutive };
        let measure = || -> Result<_, MetricsError> {
            let pairs = associate(&truth.poses, &estimate.poses, self.within.get())?;
            let (similarity, pairs) = align(&pairs, self.align.into())?;
            let (ate, rpe) = (absolute_error(&pairs)?, relative_error(&pairs, self.delta.get(), pairing)?);
            Ok((similarity.scale, pairs.len(), ate, rpe))
        };
        let (scale, pairs, ate, rpe) = measure().map_err(Failure::input)?;
        let poses = [estimate.poses.len(), truth.poses.len()];
        let warning = (2 * pairs < poses[0].min(poses[1])).then(|| {
            let within = self.within.get();
            format!(
                "the errors are over {pairs} poses, less than half of the {} of the estimate and of the {} of the truth: no other \
                 pose has a partner within {within} s; --within SECONDS sets the limit",
                poses[0], poses[1]
            )
        });
        if self.json {
            output::json(&json!({
                "pairs": pairs, "poses": { "estimate": poses[0], "truth": poses[1] }, "warning": warning,
                "scale": scale, "ate": ate,
                "rpe": { "translation": rpe.translation, "rotation": rpe.rotation },
            }));
            return Ok(Status::Done);
        }
        let mut table = Table::of_numbers(&["error", "rmse", "mean", "median", "std", "min", "max"]);
        table.row(row("ATE, m", &ate));
        table.row(row("RPE translation, m", &rpe.translation));
        table.row(row("RPE rotation, rad", &rpe.rotation));
        let pairs = text::count(pairs, "matched pose");
        output::print(&format!(
            "{pairs} ({} in the estimate, {} in the truth), scale {scale:.6}\n{}\n",
            poses[0],
            poses[1],
            table.text()
        ));
        if let Some(warning) = warning {
            output::say(&format!("warning: {warning}"));
        }
        Ok(Status::Done)
    }
}

impl Evaluate {
    /// Objects of boxes.
    fn boxes(&self) -> Result<Status, Failure> {
        let (truth, put) = (detections::read(&self.truth)?, detections::read(&self.estimate)?);
        // 0.0 and -0.0 are equal, and have different bits
        let bits = |x: f64| (x + 0.0).to_bits();
        let key = |d: &Detection| [d.timestamp, d.xmin, d.ymin, d.xmax, d.ymax].map(bits);
        let object = |d: &Detection| d.object_key.filter(|key| *key != 0);
        let mut boxes: HashMap<_, EqualBoxes> = HashMap::new();
        for d in &truth {
            let equal = boxes.entry(key(d)).or_default();
            equal.timestamp = d.timestamp + 0.0;
            equal.truths.push(object(d));
        }
        put.iter().for_each(|d| boxes.entry(key(d)).or_default().found.push(object(d)));
        let named = pair_boxes(boxes.into_values().collect());
        let missing = named.iter().filter(|(_, put)| put.is_none()).count();
        if named.is_empty() || missing == named.len() {
            let (truth, put) = (self.truth.display(), self.estimate.display());
            return Err(Failure::input(format!(
                "{put} has none of the {} of {truth} that have an object: are time stamps and sides written alike?",
                text::count(named.len(), "box")
            )));
        }
        let scores = identity(named.iter().map(|(truth, put)| (*truth, put.flatten())));
        if self.json {
            output::json(&json!({ "missing": missing, "scores": scores }));
            return Ok(Status::Done);
        }
        let mut table = Table::of_numbers(&["pairs of boxes", "precision", "recall", "F1"]);
        let number = |x: f64| format!("{x:.4}");
        table.row([
            "together".to_owned(),
            number(scores.precision),
            number(scores.recall),
            number(scores.f1),
        ]);
        let mut told = format!(
            "{}, {}, {} of 3 boxes or more\n{}\n",
            text::count(scores.boxes, "box"),
            text::count(scores.true_objects, "true object"),
            text::count(scores.objects, "object"),
            table.text()
        );
        told += &format!(
            "homogeneity {:.4}, completeness {:.4}, identity F1 {:.4}, {}\n",
            scores.homogeneity,
            scores.completeness,
            scores.identity_f1,
            text::count(scores.switches, "switch")
        );
        if missing > 0 {
            told += &format!("{} not in {}: alone\n", text::count(missing, "box"), self.estimate.display());
        }
        output::print(&told);
        Ok(Status::Done)
    }
}

/// The object of a box, if it has one.
type Object = Option<u32>;

/// The boxes of one time with the same sides: their objects in the truth, and in the estimate.
#[derive(Default)]
struct EqualBoxes {
    timestamp: f64,
    truths: Vec<Object>,
    found: Vec<Object>,
}

/// Returns, in order of time, the true object of each box that has one, and its object in the estimate if the box is there.
///
/// Equal boxes with different objects are paired so that the order of the rows does not matter: first the objects that share
/// the most other boxes, then the rest by number.
fn pair_boxes(boxes: Vec<EqualBoxes>) -> Vec<(u32, Option<Object>)> {
    let mut shared: BTreeMap<(Object, Object), usize> = BTreeMap::new();
    for equal in &boxes {
        if let ([truth], [found]) = (equal.truths.as_slice(), equal.found.as_slice()) {
            *shared.entry((*truth, *found)).or_default() += 1;
        }
    }
    let mut pairs = vec![];
    for EqualBoxes { timestamp, mut truths, mut found } in boxes {
        // boxes without an object come last
        let order = |object: &Object| (object.is_none(), *object);
        truths.sort_unstable_by_key(order);
        found.sort_unstable_by_key(order);
        for (truth, partner) in most_shared(&truths, &found, &shared) {
            let place = |list: &[Object], object| list.iter().position(|other| *other == object);
            while let (Some(i), Some(j)) = (place(&truths, truth), place(&found, partner)) {
                pairs.push((timestamp, truths.remove(i), Some(found.remove(j))));
            }
        }
        let rest = found.into_iter().map(Some).chain(repeat(None));
        pairs.extend(truths.into_iter().zip(rest).map(|(truth, found)| (timestamp, truth, found)));
    }
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2))));
    pairs.into_iter().filter_map(|(_, truth, found)| Some((truth?, found))).collect()
}

/// The pairs of a true object and one of the estimate that share other boxes, the most first; none if there is no choice.
fn most_shared(
    truths: &[Object],
    found: &[Object],
    shared: &BTreeMap<(Object, Object), usize>,
) -> Vec<(Object, Object)> {
    if truths.len() < 2 && found.len() < 2 {
        return vec![];
    }
    let found: BTreeSet<Object> = found.iter().copied().collect();
    let truths: BTreeSet<Object> = truths.iter().copied().collect();
    let mut pairs: Vec<_> = truths
        .into_iter()
        .flat_map(|truth| shared.range((truth, None)..=(truth, Some(u32::MAX))))
        .filter(|((_, partner), _)| found.contains(partner))
        .map(|(pair, count)| (Reverse(*count), *pair))
        .collect();
    pairs.sort_unstable();
    pairs.into_iter().map(|(_, pair)| pair).collect()
}

fn row(name: &str, s: &Statistics) -> [String; 7] {
    let [rmse, mean, median, std, min, max] =
        [s.rmse, s.mean, s.median, s.std, s.min, s.max].map(|x| format!("{x:.6}"));
    [name.to_owned(), rmse, mean, median, std, min, max]
}
