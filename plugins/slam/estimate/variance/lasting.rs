//! What lasts of the errors of boxes: how much of them, for how long, and variables for it.
//!
//! An error is x + o: x is new in each box, o changes slowly, as a first-order Gauss-Markov process. Its covariance at a distance of t is
//! σ² s exp(-t/T): s the share that lasts, T its time. The variables of an object are o in one interval after the other.
use super::boxes::{self, BoxComponent, group};
use super::components::{Components, Measures, VarianceError, measures, times};
use super::correlation::LONGEST;
use super::{BoxGroups, VarianceSettings};
use crate::input::sequence::Sequence;
use crate::mapping::Mapping;
use manifactor_geometry::{Between, Point4, Prior};
use manifactor_graph::loss::Loss;
use manifactor_graph::{Factor, FactorEntry, Key, Noise, Values};
use manifactor_quadric::{BoundingBoxFactor, BoundingBoxOffset};
use nalgebra::Vector4;
use serde::Serialize;
use std::collections::HashMap;
use std::sync::Arc;

/// What lasts of the errors of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LastingComponent {
    /// Its part of the variance, from 0 to 1.
    pub share: f64,
    /// After so many seconds 1/e of it is left.
    pub seconds: f64,
}

/// Errors last if their products are above zero by so many standard errors of those that do not.
const CLEAR: f64 = 3.0;
/// Times that are tried, each longer than the one before by a factor of √2, from the mean interval between boxes on.
const TIMES: i32 = 17;
/// An interval is this part of the time for which errors last.
const INTERVAL: f64 = 0.5;
/// After so many times T nothing is left.
const GONE: f64 = 10.0;

/// The share and the time by least squares from the products of all pairs of errors of a series, whose expectation is σ² s exp(-t/T). The
/// series, of times and errors, are pooled. `None` where nothing lasts.
pub(super) fn lasting(series: &[Vec<(f64, f64)>]) -> Option<LastingComponent> {
    let errors = series.iter().map(Vec::len).sum::<usize>() as f64;
    let power = series.iter().flatten().map(|(_, error)| error * error).sum::<f64>() / errors;
    let pairs = || {
        series.iter().flat_map(|series| {
            series.iter().enumerate().flat_map(|(i, (t, x))| {
                series.iter().skip(i + 1).take(LONGEST).map(move |(u, y)| ((u - t).abs(), x * y))
            })
        })
    };
    let steps = series.iter().flat_map(|series| series.windows(2));
    let (count, sum) =
        steps.fold((0.0, 0.0), |(n, sum), pair| (n + 1.0, sum + (pair[1].0 - pair[0].0).abs()));
    let interval: f64 = sum / count;
    if !(power > 0.0 && interval > 0.0) {
        return None;
    }
    let tried = (0..TIMES).map(|step| {
        let seconds = interval * 2f64.powf(0.5 * f64::from(step));
        let (products, squares) = pairs().fold((0.0, 0.0), |(products, squares), (t, product)| {
            let left = (-t / seconds).exp();
            (products + left * product, squares + left * left)
        });
        // the fall of the sum of squares is the square of this
        (products / f64::sqrt(squares), LastingComponent { share: products / squares / power, seconds })
    });
    let (clear, best) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (clear > CLEAR * power).then_some(LastingComponent { share: best.share.min(1.0), ..best })
}

/// The variance of the mean over an interval of what lasts, as a part of its variance at one time.
fn kept_by_mean(interval: f64) -> f64 {
    2.0 / (interval * interval) * (interval - 1.0 + (-interval).exp())
}

/// A box: its factor's place in the graph, its time and its extents.
struct Place {
    entry: usize,
    time: f64,
    size: [f64; 2],
}

impl Components {
    /// Gives the boxes of each object offsets in common, one for each interval of time in which there are boxes, and so much of the noise that
    /// they have it no more. Offsets begin at zero.
    ///
    /// # Errors
    /// A standard deviation that is zero or not finite.
    pub(in crate::estimate) fn add_offsets(
        &self,
        mapping: &mut Mapping,
        values: &mut Values,
        sequence: &Sequence,
        settings: &VarianceSettings,
        loss: Option<&Arc<dyn Loss>>,
    ) -> Result<(), VarianceError> {
        let times = times(sequence);
        let mut places: HashMap<Key, Vec<Place>> = HashMap::new();
        for (i, entry) in mapping.graph.factors().iter().enumerate() {
            if let (Measures::Box { object }, Some(size)) = (measures(entry), boxes::size(entry)) {
                let time = entry.keys.first().and_then(|pose| times.get(pose)).copied().unwrap_or_default();
                places.entry(object).or_default().push(Place { entry: i, time, size });
            }
        }
        let mut offsets = Offsets { mapping, values, loss };
        for object in offsets.mapping.objects.clone() {
            let component = self.boxes.get(&group(&object, settings.boxes)).copied();
            let component = component.filter(|_| settings.boxes != BoxGroups::Given);
            let Some((component, lasting)) = component.and_then(|c| Some((c, c.lasting?))) else { continue };
            if let Some(boxes) = places.get(&object.key) {
                offsets.add(&object.key, boxes, &component, lasting)?;
            }
        }
        Ok(())
    }
}

/// A graph that gets offsets.
struct Offsets<'a> {
    mapping: &'a mut Mapping,
    values: &'a mut Values,
    loss: Option<&'a Arc<dyn Loss>>,
}

impl Offsets<'_> {
    /// Those of one object, whose boxes are in the order of time.
    fn add(
        &mut self,
        object: &Key,
        boxes: &[Place],
        component: &BoxComponent,
        lasting: LastingComponent,
    ) -> Result<(), VarianceError> {
        let length = INTERVAL * lasting.seconds;
        let kept = lasting.share * kept_by_mean(INTERVAL);
        let sigmas = |[x, y]: [f64; 2], by: f64| [x, y, x, y].map(|size| by * component.at(size));
        let mean = [0, 1].map(|i| boxes.iter().map(|b| b.size[i]).sum::<f64>() / boxes.len() as f64);
        let mut knots: Vec<f64> = vec![];
        let mut rest = boxes;
        while let Some(first) = rest.first() {
            let within = rest.iter().take_while(|b| b.time < first.time + length).count().max(1);
            let (here, later) = rest.split_at(within);
            let key = offset_key(object, knots.len());
            for place in here {
                let noise = Noise::sigmas(&sigmas(place.size, (1.0 - kept).sqrt()))?;
                self.shift(place.entry, key.clone(), noise);
            }
            self.values.insert(key, Point4::new(Vector4::zeros()));
            knots.push(here.iter().map(|b| b.time).sum::<f64>() / here.len() as f64);
            rest = later;
        }
        // A Gauss-Markov chain in factors that there are: with c the correlation of neighbours, c/(1 - c²)/σ² between them, and
        // (1/(1 + c) + 1/(1 + c') - 1)/σ² for each, add up to its information.
        let correlation = |k: usize| {
            let steps = k
                .checked_sub(1)
                .and_then(|before| Some((knots.get(k)? - knots.get(before)?) / lasting.seconds));
            steps.filter(|steps| *steps < GONE).map_or(0.0, |steps| (-steps).exp())
        };
        for k in 0..knots.len() {
            let [before, after] = [correlation(k), correlation(k + 1)];
            let alone = 1.0 / (1.0 + before) + 1.0 / (1.0 + after) - 1.0;
            let zero = Prior { value: Point4::new(Vector4::zeros()) };
            let noise = Noise::sigmas(&sigmas(mean, (kept / alone).sqrt()))?;
            self.push(vec![offset_key(object, k)], Arc::new(zero), noise);
            if after > 0.0 {
                let same = Between { relative: Point4::new(Vector4::zeros()) };
                let noise = Noise::sigmas(&sigmas(mean, (kept * (1.0 - after * after) / after).sqrt()))?;
                self.push([k, k + 1].map(|k| offset_key(object, k)).to_vec(), Arc::new(same), noise);
            }
        }
        Ok(())
    }

    /// Gives a box an offset.
    fn shift(&mut self, entry: usize, offset: Key, noise: Noise) {
        let Some(entry) = self.mapping.graph.factors_mut().get_mut(entry) else { return };
        let factor = entry.factor.erased().as_any().downcast_ref::<BoundingBoxFactor>();
        let Some(factor) = factor.cloned() else { return };
        entry.factor = Arc::new(BoundingBoxOffset(factor));
        entry.keys.push(offset);
        entry.loss = self.loss.cloned();
        entry.noise = match entry.noise.observed() {
            Some(observed) => noise.observing(observed),
            None => noise,
        };
    }

    fn push(&mut self, keys: Vec<Key>, factor: Arc<dyn Factor>, noise: Noise) {
        self.mapping.graph.push(FactorEntry { keys, name: None, factor, noise, loss: None });
    }
}

/// The key of an object's offset in an interval.
fn offset_key(object: &Key, interval: usize) -> Key {
    Key::indexed(&format!("{object}_offset"), interval)
}
