//! Relocalization by the classes and the layout of objects.
//!
//! If the up direction is known, two pairs of objects with similar classes and equal distances in both
//! maps give a hypothesis; otherwise three pairs do. Its score is the log-likelihood ratio of this place
//! against a different room, whose objects are scattered like those of the map. It counts objects that match,
//! objects of the run without a match, and objects of the map that should have been detected. A different room
//! fits somewhere by chance, so the score is reduced by the logarithm of the number of places.
use super::agreement::Agreement;
use manifactor_association::best_assignment;
use manifactor_geometry::{PointPairs, Se3};
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Direction, Noise};
use manifactor_quadric::DualQuadric;
use manifactor_recording::fusion::ClassFusion;
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use nalgebra::{DMatrix, Matrix3, SymmetricEigen, Vector3};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

mod hypotheses;

/// An object used for relocalization.
#[derive(Debug, Clone)]
pub(crate) struct LayoutObject {
    pub id: ObjectId,
    centre: Vector3<f64>,
    /// Standard deviation of the centre, in metres.
    sigma: f64,
    classes: ClassFusion,
}

/// The objects of the run (local) and of the prior map (known).
#[derive(Debug)]
pub(crate) struct Layout {
    local: Vec<LayoutObject>,
    known: Vec<LayoutObject>,
    /// Up direction in both.
    up: Option<[Direction; 2]>,
    /// Pairs that may show one object.
    pairs: Vec<CandidateMatch>,
    /// Logarithm of the volume of the known marks, in m³: negative mean logarithm of their density.
    log_volume: f64,
    /// Median distance of a known mark to its nearest neighbour.
    gap: f64,
}

/// A candidate match of a local and a known mark.
#[derive(Debug, Clone, Copy)]
struct CandidateMatch {
    local: usize,
    known: usize,
    /// Log-likelihood ratio of the match before poses are compared, in nats: from the classes, minus the
    /// logarithm of the number of known marks. Zero if equal ids identify the mark.
    evidence: f64,
    /// Standard deviation of the offset between both, in metres.
    sigma: f64,
}

/// A pose of the local marks in the prior map.
#[derive(Debug, Clone)]
pub(crate) struct AlignedLayout {
    pub known_from_local: Se3,
    /// Matched marks: local ids, known ids.
    pub matches: Vec<(ObjectId, ObjectId)>,
    /// Log-likelihood ratio of this pose against a different room, in nats; from `align`, the lead over the
    /// second best explanation.
    pub lead: f64,
    centre: Vector3<f64>,
    /// Standard deviations in rad and m, at the centre of the matched local marks.
    sigmas: [f64; 2],
    /// Up direction in the prior map, if known in both.
    up: Option<Direction>,
}

/// Standard deviation added to the centre of an object, relative to its mean semi-axis. On fr1, centres of
/// objects that were found again are apart by 0.3 of both sizes (median).
const CENTRE_SIGMA_OF_SIZE: f64 = 0.2;
/// Number of detections below which an object may be an error of the detector.
const MIN_DETECTIONS: usize = 8;
/// Probability that an object is new or removed since the map was made, or is an error of the detector.
const CHANGED_SHARE: f64 = 0.2;
/// Share of boxes with a random class, one of `CLASS_COUNT`.
const CLASS_ERROR: f64 = 0.1;
const CLASS_COUNT: f64 = 20.0;
/// Distance of matching marks, at most, in standard deviations.
const MAX_MATCH_SIGMA: f64 = 3.0;
/// Number of distinct hypotheses that are refined.
const MAX_REFINED_HYPOTHESES: usize = 40;
/// Rounds that alternate between matching and pose estimation.
const MATCHING_ROUNDS: usize = 5;
/// Two poses count as one if each mark moves by less than this, in units of twice its σ.
const SAME_POSE_SIGMA: f64 = 3.0;
/// Required number of matches. Four objects that stand nearly in a plane have nearly the same layout in a mirror:
/// with four, 8 of 16 mirrored streams of fr1 are accepted.
const MIN_MATCHES: usize = 5;
/// Required lead over the second best explanation, in nats: at most one in 10,000 places is wrong, if the
/// model holds.
const MIN_LEAD_NATS: f64 = 9.2;
/// Factor on the standard deviations of the pose, because the errors of the objects of a run are correlated: on
/// fr1, with 10 to 20 matches, poses are off by 2° and 5 cm (median).
const POSE_SIGMA_SCALE: f64 = 2.0;
/// Required overlap of the boxes of matched objects with the projections of the prior ellipsoids. Right poses on
/// fr1 have 0.5 or more. It rejects a place where centres fit, and sizes do not.
const MIN_OVERLAP: f64 = 0.45;
/// Smallest spread of the known marks along an axis, in metres. It keeps the volume of a map in a plane
/// positive.
const MIN_SPREAD_M: f64 = 0.05;

/// Weight of the up direction relative to all marks together.
const UP_WEIGHT: f64 = 10.0;
/// Standard deviation of the tilt, in radians. With equal σ in all directions, the trajectory tilted by up to
/// 13° on fr1.
const TILT_SIGMA_RAD: f64 = 0.01;
/// Relative spread of the marks below which a direction is undetermined.
const MIN_RELATIVE_SPREAD: f64 = 1e-3;

impl LayoutObject {
    /// Creates a mark. `variance` is the variance of the centre, the mean over three directions, in m².
    pub(crate) fn new(id: ObjectId, quadric: &DualQuadric, variance: f64, classes: &ClassFusion) -> Self {
        let size = quadric.semi_axes.mean();
        let sigma = (variance + (CENTRE_SIGMA_OF_SIZE * size).powi(2)).sqrt();
        Self { id, centre: quadric.centroid(), sigma, classes: classes.clone() }
    }
}

impl Layout {
    /// Creates the layout of local marks in a prior map. `up` is the up direction of the local marks.
    /// With `by_name`, equal ids are the same object.
    pub(crate) fn new(
        local: Vec<LayoutObject>,
        up: Option<Direction>,
        map: &PriorMap,
        by_name: bool,
    ) -> Self {
        let mark = |object: &Arc<PriorObject>| {
            let variance = object.covariance().fixed_view::<3, 3>(3, 3).trace() / 3.0;
            LayoutObject::new(object.id, &object.quadric, variance, &object.classes)
        };
        let known: Vec<LayoutObject> =
            map.objects.iter().filter(|object| is_reliable(&object.classes)).map(mark).collect();
        let log_volume = log_volume(&known);
        let up = up.zip(map.up).map(|(local, known)| [local, known]);
        let gap = gap(&known);
        let mut layout = Self { local, known, up, pairs: vec![], log_volume, gap };
        layout.pairs = layout.pairs(by_name);
        layout
    }

    fn pairs(&self, by_name: bool) -> Vec<CandidateMatch> {
        let mut usual: HashMap<&str, f64> = HashMap::new();
        for mark in &self.known {
            for (class, share) in mark.classes.shares() {
                *usual.entry(class).or_default() += share / self.known.len() as f64;
            }
        }
        let (doubt, one_of_all) = (CLASS_ERROR / CLASS_COUNT, (self.known.len() as f64).ln());
        let mut pairs = vec![];
        for (l, local) in self.local.iter().enumerate() {
            let over = |of: &dyn Fn(&str) -> f64| -> f64 {
                local.classes.shares().map(|(class, share)| share * of(class)).sum()
            };
            let by_chance =
                (1.0 - CLASS_ERROR) * over(&|class| usual.get(class).copied().unwrap_or_default()) + doubt;
            for (k, known) in self.known.iter().enumerate() {
                let is_nameless = local.classes.is_nameless() || known.classes.is_nameless();
                let evidence = match by_name {
                    true if local.id == known.id => 0.0,
                    false if is_nameless => -one_of_all,
                    false if local.classes.is_compatible(&known.classes) => {
                        let by_class =
                            (1.0 - CLASS_ERROR) * over(&|class| known.classes.share(class)) + doubt;
                        (by_class / by_chance).ln() - one_of_all
                    }
                    _ => continue,
                };
                pairs.push(CandidateMatch {
                    local: l,
                    known: k,
                    evidence,
                    sigma: local.sigma.hypot(known.sigma),
                });
            }
        }
        pairs.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        pairs
    }

    /// Returns the pose of the local marks, if it is unique. `agreement` compares the detections with a pose.
    pub(super) fn align(
        &self,
        agreement: impl Fn(&AlignedLayout) -> Agreement,
    ) -> Option<(AlignedLayout, Agreement)> {
        let possible: Vec<AlignedLayout> =
            self.ranked_poses().into_iter().map(|ranked| self.aligned(ranked)).collect();
        let best = possible.first().map(|aligned| (aligned.lead, aligned.matches.len()));
        tracing::debug!(
            local = self.local.len(),
            known = self.known.len(),
            ?best,
            "looked for a place in a map"
        );
        // missed objects only reduce a score, and the comparison with the detections is slow
        if possible.iter().all(|aligned| aligned.lead < MIN_LEAD_NATS) {
            return None;
        }
        let mut best: Option<(AlignedLayout, Agreement)> = None;
        // the score of a different room
        let mut second = 0.0_f64;
        for mut aligned in possible {
            if aligned.lead <= second {
                continue;
            }
            let agreement = agreement(&aligned);
            aligned.lead += agreement.missed;
            match &mut best {
                Some((best, _)) if aligned.lead <= best.lead => second = second.max(aligned.lead),
                best => {
                    let before = best.replace((aligned, agreement));
                    second = before.map_or(second, |(before, _)| second.max(before.lead));
                }
            }
        }
        let (mut best, agreement) = best?;
        best.lead -= second;
        let AlignedLayout { lead, matches, .. } = &best;
        tracing::debug!(lead, matches = matches.len(), ?agreement, "a place in the prior map");
        let is_clear =
            matches.len() >= MIN_MATCHES && *lead >= MIN_LEAD_NATS && agreement.overlap >= MIN_OVERLAP;
        is_clear.then_some((best, agreement))
    }

    /// Returns candidate poses with scores and matches, the best first.
    fn ranked_poses(&self) -> Vec<(f64, Se3, Vec<CandidateMatch>)> {
        let mut places: Vec<(f64, Se3, Vec<CandidateMatch>)> = vec![];
        for place in self.promising_poses() {
            let Some((score, place, matches)) = self.refine_pose(place) else { continue };
            match places.iter_mut().find(|(_, other, _)| self.is_same_pose(other, &place)) {
                Some(other) if score > other.0 => *other = (score, place, matches),
                Some(_) => {}
                None => places.push((score, place, matches)),
            }
        }
        places.sort_by(|(a, ..), (b, ..)| b.total_cmp(a));
        places
    }

    /// Returns the poses with the highest score bounds. Many hypotheses describe one pose; each pose is
    /// listed once, so that the second best pose is included.
    fn promising_poses(&self) -> Vec<Se3> {
        let hypotheses = self.hypotheses().into_iter();
        let mut rough: Vec<(f64, Se3)> = hypotheses.map(|place| (self.score_bound(&place), place)).collect();
        rough.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut places: Vec<Se3> = vec![];
        for (_, place) in rough {
            if places.len() == MAX_REFINED_HYPOTHESES {
                break;
            }
            if !places.iter().any(|other| self.is_same_pose(other, &place)) {
                places.push(place);
            }
        }
        places
    }

    /// Returns whether two pairs are compatible: the marks have equal distances in both sets.
    fn are_compatible(&self, a: &CandidateMatch, b: &CandidateMatch) -> bool {
        if a.local == b.local || a.known == b.known {
            return false;
        }
        let local = self.local[b.local].centre - self.local[a.local].centre;
        let known = self.known[b.known].centre - self.known[a.known].centre;
        let (sigma, apart) = (a.sigma.hypot(b.sigma), local.norm());
        let is_as_high =
            self.up.is_none_or(|[u, v]| (local.dot(&u) - known.dot(&v)).abs() < MAX_MATCH_SIGMA * sigma);
        // marks that are too close do not determine a direction
        apart > sigma && (apart - known.norm()).abs() < MAX_MATCH_SIGMA * sigma && is_as_high
    }

    /// Returns the least squares pose of some pairs (Umeyama); `None` if it is not determined.
    fn fit_pose(&self, pairs: &[CandidateMatch]) -> Option<Se3> {
        if pairs.len() < 2 {
            return None;
        }
        let centres = |pair: &CandidateMatch| (self.local[pair.local].centre, self.known[pair.known].centre);
        let weighted = |pair: &CandidateMatch| (centres(pair).0, centres(pair).1, pair.sigma.powi(-2));
        let mut points = PointPairs::new(pairs.iter().map(weighted));
        if let Some([u, v]) = self.up {
            // the up direction is more accurate than any mark
            points.add_direction(&u, &v, UP_WEIGHT);
        }
        points.rigid(MIN_RELATIVE_SPREAD).map(|found| Se3::new(found.rotation, found.translation))
    }

    /// Returns the log-likelihood ratio of a local mark with this match at a pose, in nats; `None` if the marks
    /// are too far apart. The mark may be a new object, so it is never below that of an unmatched mark.
    fn gain(&self, place: &Se3, pair: &CandidateMatch) -> Option<f64> {
        let apart = place.act(&self.local[pair.local].centre) - self.known[pair.known].centre;
        let square = apart.norm_squared() / (pair.sigma * pair.sigma);
        let density = -0.5 * square - 1.5 * (TAU * pair.sigma * pair.sigma).ln();
        let ratio = mixed_with_change(pair.evidence + density + self.log_volume);
        Some(ratio).filter(|_| square < MAX_MATCH_SIGMA * MAX_MATCH_SIGMA)
    }

    /// Returns an upper bound of the score of a pose: it lets a known mark match several local ones.
    fn score_bound(&self, place: &Se3) -> f64 {
        let mut best = vec![0.0_f64; self.local.len()];
        for pair in &self.pairs {
            if let Some(gain) = self.gain(place, pair) {
                best[pair.local] = best[pair.local].max(gain);
            }
        }
        best.iter().sum()
    }

    /// Returns the best pose near this one, with its score and matches.
    fn refine_pose(&self, mut place: Se3) -> Option<(f64, Se3, Vec<CandidateMatch>)> {
        for _ in 0..MATCHING_ROUNDS {
            place = self.fit_pose(&self.matches(&place))?;
        }
        // the last step may have moved marks apart, so match again
        let matches = Some(self.matches(&place)).filter(|matches| matches.len() >= 2)?;
        let gained: f64 = matches.iter().filter_map(|pair| self.gain(&place, pair)).sum();
        let is_matched = |l: usize| matches.iter().any(|pair: &CandidateMatch| pair.local == l);
        let alone = (0..self.local.len())
            .filter(|l| !is_matched(*l) && self.is_among_known(&place.act(&self.local[*l].centre)));
        Some((gained + CHANGED_SHARE.ln() * alone.count() as f64, place, matches))
    }

    fn matches(&self, place: &Se3) -> Vec<CandidateMatch> {
        let gains: Vec<(usize, usize, f64)> = self
            .pairs
            .iter()
            .filter_map(|pair| Some((pair.local, pair.known, self.gain(place, pair)?)))
            .collect();
        let matched = best_assignment(self.local.len(), self.known.len(), &gains);
        let is_match = |pair: &&CandidateMatch| matched[pair.local] == Some(pair.known);
        self.pairs.iter().filter(is_match).copied().collect()
    }

    /// Returns whether two poses place all marks at about the same points.
    fn is_same_pose(&self, one: &Se3, two: &Se3) -> bool {
        self.local.iter().all(|mark| {
            (one.act(&mark.centre) - two.act(&mark.centre)).norm() < SAME_POSE_SIGMA * 2.0 * mark.sigma
        })
    }

    /// Returns whether a point lies among the known marks.
    fn is_among_known(&self, point: &Vector3<f64>) -> bool {
        let nearest =
            self.known.iter().map(|mark| (mark.centre - point).norm()).fold(f64::INFINITY, f64::min);
        nearest < self.gap
    }

    /// Returns a ranked pose with its accuracy. Its lead is the score, reduced by the logarithm of the number
    /// of poses in the map that are distinct at this accuracy.
    fn aligned(&self, (score, place, matches): (f64, Se3, Vec<CandidateMatch>)) -> AlignedLayout {
        let n = matches.len() as f64;
        let centre = matches.iter().map(|pair| self.local[pair.local].centre).sum::<Vector3<f64>>() / n;
        let mean = |of: &dyn Fn(&CandidateMatch) -> f64| (matches.iter().map(of).sum::<f64>() / n).sqrt();
        let shift = mean(&|pair| pair.sigma * pair.sigma) / n.sqrt();
        let turn = shift / mean(&|pair| (self.local[pair.local].centre - centre).norm_squared());
        let [log_turn, log_shift] = [turn, shift].map(|sigma| (TAU.sqrt() * sigma).ln());
        let log_turns = match self.up {
            Some(_) => TAU.ln() - log_turn,
            None => (2.0 * TAU * TAU).ln() - 3.0 * log_turn,
        };
        let name = |pair: &CandidateMatch| (self.local[pair.local].id, self.known[pair.known].id);
        AlignedLayout {
            known_from_local: place,
            matches: matches.iter().map(name).collect(),
            lead: score - (self.log_volume - 3.0 * log_shift) - f64::max(log_turns, 0.0),
            centre,
            sigmas: [turn, shift],
            up: self.up.map(|[_, up]| up),
        }
    }
}

/// Returns the log-likelihood ratio of an object that is unchanged with the ratio `ratio`, or changed.
pub(super) fn mixed_with_change(ratio: f64) -> f64 {
    ((1.0 - CHANGED_SHARE) * ratio.exp() + CHANGED_SHARE).ln()
}

/// Returns whether an object has enough detections to be used.
pub(super) fn is_reliable(classes: &ClassFusion) -> bool {
    classes.detections() >= MIN_DETECTIONS
}

/// Returns the logarithm of the volume of marks: that of a normal distribution along their principal axes.
/// Medians keep single marks far away from enlarging it.
fn log_volume(marks: &[LayoutObject]) -> f64 {
    let n = marks.len().max(1) as f64;
    let mean = marks.iter().map(|mark| mark.centre).sum::<Vector3<f64>>() / n;
    let scatter = marks.iter().map(|mark| (mark.centre - mean) * (mark.centre - mean).transpose());
    let axes = SymmetricEigen::new(scatter.sum::<Matrix3<f64>>()).eigenvectors;
    let spread = |axis: usize| {
        let along: Vec<f64> = marks.iter().map(|mark| axes.column(axis).dot(&mark.centre)).collect();
        let middle = median(along.clone());
        let deviations = along.iter().map(|place| (place - middle).abs()).collect();
        STD_PER_MEDIAN_DEVIATION * median(deviations) + MIN_SPREAD_M
    };
    (0..3).map(|axis| spread(axis).ln() + 0.5 * (TAU * std::f64::consts::E).ln()).sum()
}

/// Standard deviation of a normal distribution relative to its median absolute deviation.
const STD_PER_MEDIAN_DEVIATION: f64 = 1.4826;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Returns the median distance of a mark to its nearest neighbour.
fn gap(marks: &[LayoutObject]) -> f64 {
    let to_next = |mark: &LayoutObject| {
        let others = marks.iter().filter(|other| other.id != mark.id);
        others.map(|other| (other.centre - mark.centre).norm()).fold(f64::INFINITY, f64::min)
    };
    median(marks.iter().map(to_next).collect())
}

impl AlignedLayout {
    /// Returns the noise of a local pose in the prior map: rad, then m, in its own frame.
    ///
    /// # Errors
    /// If the pose is not finite.
    pub(crate) fn noise(&self, local: &Se3) -> Result<Noise, NoiseError> {
        let [turn, shift] = self.sigmas.map(|sigma| POSE_SIGMA_SCALE * sigma);
        let shift = shift.hypot(turn * (local.translation - self.centre).norm());
        let mut covariance = DMatrix::from_diagonal_element(6, 6, shift * shift);
        let known_from_camera = self.known_from_local.rotation.compose(&local.rotation);
        let tilt = self.up.map_or(turn, |_| TILT_SIGMA_RAD);
        let up = self.up.map_or(Vector3::z(), |up| known_from_camera.inverse().act(&up));
        let turns = Matrix3::identity() * (tilt * tilt) + up * up.transpose() * (turn * turn - tilt * tilt);
        covariance.view_mut((0, 0), (3, 3)).copy_from(&turns);
        Noise::covariance(covariance)
    }
}

#[cfg(test)]
mod tests;
