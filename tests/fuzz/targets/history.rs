//! Histories of the smoother, with one change per line and arbitrary numbers.
use super::{is_finite, third};
use manifactor::geometry::{BearingRange2, Between, Point2, Prior, Range, Se2, So2};
use manifactor::graph::checked::Positive;
use manifactor::graph::{Fixed, Variable};
use manifactor::prelude::*;
use manifactor::smoother::{FactorId, Smoother, SmootherSettings};

/// Longer histories are truncated, so that each input is fast.
const LONGEST: usize = 120;
/// Largest number of passes in one update.
const PASSES: usize = 3;

/// Applies changes, updates, and restarts. A failed update has no effect, a saved session continues bit for
/// bit, and all estimates are finite.
///
/// The first line can have settings, `settings {"relinearize_every": 1}`. Indices count variables and
/// factors, and wrap around.
pub fn history(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut lines = text.lines().take(LONGEST).peekable();
    let written = lines.next_if(|line| line.starts_with("settings"));
    let settings = written.and_then(|line| serde_json::from_str(line.strip_prefix("settings")?).ok());
    let mut settings: SmootherSettings = settings.unwrap_or_default();
    settings.passes = settings.passes.min(PASSES);
    let session = Smoother::new(settings);
    let mut own = TrackedSmoother::new(session);
    // a session that has never processed the failed updates
    let mut twin: Option<TrackedSmoother> = None;
    for line in lines.map(Line::new) {
        match line.name() {
            "update" => {
                let failed = !own.update();
                if let Some(twin) = &mut twin {
                    assert_eq!(failed, !twin.update(), "one of two equal sessions fails");
                    assert_eq!(own.bits(), twin.bits(), "a failed update has left a trace");
                }
                if failed && twin.is_none() {
                    twin = Some(own.restarted());
                }
            }
            "restart" if own.is_idle => {
                own = own.restarted();
            }
            _ => {
                let changed = own.change(&line);
                if let Some(twin) = &mut twin {
                    assert_eq!(changed, twin.change(&line), "{:?}", line.0);
                }
            }
        }
    }
    own.update();
    own.finish();
}

/// Words of a line: the name of a change, then its numbers.
struct Line<'a>(Vec<&'a str>);

impl<'a> Line<'a> {
    fn new(line: &'a str) -> Self {
        Self(line.split_whitespace().collect())
    }

    fn name(&self) -> &'a str {
        self.0.first().copied().unwrap_or_default()
    }

    fn number(&self, place: usize) -> f64 {
        self.0.get(place).and_then(|word| word.parse().ok()).unwrap_or_default()
    }

    fn index(&self, place: usize) -> usize {
        self.0.get(place).and_then(|word| word.parse().ok()).unwrap_or_default()
    }

    fn numbers<const N: usize>(&self, from: usize) -> [f64; N] {
        std::array::from_fn(|i| self.number(from + i))
    }
}

/// A session, with the keys and ids of its variables and factors.
struct TrackedSmoother {
    session: Smoother,
    keys: Vec<Key>,
    ids: Vec<FactorId>,
    /// Text of the session after the last successful update.
    saved: String,
    saved_ids: Vec<FactorId>,
    /// True if no change is pending.
    is_idle: bool,
}

impl TrackedSmoother {
    fn new(session: Smoother) -> Self {
        let saved = session.save().unwrap_or_else(|e| panic!("{e}"));
        Self { session, keys: vec![], ids: vec![], saved, saved_ids: vec![], is_idle: true }
    }

    /// Loads the saved session.
    fn restarted(&self) -> Self {
        let session = Smoother::load(&self.saved).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(session.save().unwrap_or_else(|e| panic!("{e}")), self.saved);
        let (keys, saved) = (self.keys.clone(), self.saved.clone());
        let (ids, saved_ids) = (self.saved_ids.clone(), self.saved_ids.clone());
        Self { session, keys, ids, saved, saved_ids, is_idle: true }
    }

    /// Makes a change; returns whether the session accepted it.
    fn change(&mut self, line: &Line<'_>) -> bool {
        self.is_idle = false;
        let (mut graph, mut values) = (Graph::new(), Values::new());
        let noise = |place| Noise::sigma(line.number(place)).unwrap_or_else(|_| Noise::unit());
        match line.name() {
            "pose" => {
                let key = Key::indexed("x", self.keys.len());
                values.insert(key.clone(), pose(line.numbers(1)));
                self.keys.push(key);
            }
            "point" => {
                let key = Key::indexed("l", self.keys.len());
                values.insert(key.clone(), Point2::new(line.numbers(1)));
                self.keys.push(key);
            }
            "prior" => match self.key(line.index(1)) {
                Some(key) if key.as_str().starts_with('x') => {
                    graph.add([key], Prior { value: pose(line.numbers(2)) }).noise(noise(5));
                }
                Some(key) => {
                    let value = Point2::new(line.numbers(2));
                    graph.add([key], Prior { value }).noise(noise(5));
                }
                None => return false,
            },
            "between" | "range" | "bearing" => {
                let Some((a, b)) = self.key(line.index(1)).zip(self.key(line.index(2))) else { return false };
                let distance = Positive::new(line.number(3));
                match (line.name(), distance) {
                    ("between", _) => {
                        graph.add([a, b], Between { relative: pose(line.numbers(3)) }).noise(noise(6))
                    }
                    ("range", Ok(range)) => {
                        graph.add([a, b], Range::<Se2, Point2>::new(range)).noise(noise(4))
                    }
                    (_, Ok(range)) => {
                        let bearing = So2::exp(line.number(4));
                        graph.add([a, b], BearingRange2::new(bearing, range)).noise(noise(5))
                    }
                    _ => return false,
                };
            }
            "remove" => {
                let Some(place) = self.place(line.index(1)) else { return false };
                let id = self.ids.swap_remove(place);
                return self.session.remove(&[id]).is_ok();
            }
            "weigh" => {
                let Some(place) = self.place(line.index(1)) else { return false };
                return self.session.set_weight(self.ids[place], line.number(2)).is_ok();
            }
            "replace" => {
                let Some(place) = self.place(line.index(1)) else { return false };
                let Some(mut entry) = self.session.entry(self.ids[place]).cloned() else { return false };
                entry.noise(noise(2));
                return self.session.replace(self.ids[place], entry).is_ok();
            }
            "fix" | "free" => {
                let Some(key) = self.key(line.index(1)) else { return false };
                return self.session.fix(&key, &Fixed::Whole(line.name() == "fix")).is_ok();
            }
            "hold" => {
                let Some(key) = self.key(line.index(1)) else { return false };
                let names = line.0.iter().skip(2).map(|name| (*name).to_owned()).collect();
                return self.session.fix(&key, &Fixed::Directions(names)).is_ok();
            }
            "marginalize" => {
                let Some(key) = self.key(line.index(1)) else { return false };
                return self.session.marginalize(&[key]).is_ok();
            }
            "time" => return self.session.set_time(line.number(1)).is_ok(),
            _ => return false,
        }
        match self.session.push(&graph, &values) {
            Ok(ids) => {
                self.ids.extend(ids);
                true
            }
            Err(_) => false,
        }
    }

    /// Updates the session; returns whether that succeeded.
    fn update(&mut self) -> bool {
        let before = self.last_bits();
        let updated = self.session.update().is_ok();
        let saved = self.session.save().unwrap_or_else(|e| panic!("{e}"));
        if updated {
            let again = Smoother::load(&saved).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(again.save().unwrap_or_else(|e| panic!("{e}")), saved);
            assert_eq!(bits(&again), self.bits());
            (self.saved, self.saved_ids) = (saved, self.ids.clone());
        } else {
            assert_eq!(self.bits(), before, "a failed update has changed estimates");
            assert_eq!(without_ids(&saved), without_ids(&self.saved), "a failed update has left a trace");
            // invalid ids are never used again, so the text differs in the next id
            self.saved = saved;
            self.ids.clone_from(&self.saved_ids);
        }
        self.is_idle = true;
        self.check();
        updated
    }

    /// Returns the estimates after the last successful update.
    fn last_bits(&self) -> Vec<(Key, Vec<u64>)> {
        bits(&Smoother::load(&self.saved).unwrap_or_else(|e| panic!("{e}")))
    }

    /// Checks that all estimates and covariances are finite.
    fn check(&self) {
        let values = self.session.estimates();
        assert_eq!(values.len(), self.session.variables(), "a variable has no estimate");
        is_finite(&values);
        let keys: Vec<&str> = values.iter().map(|(key, _)| key.as_str()).take(2).collect();
        if let Ok(covariance) = self.session.covariance(&keys) {
            assert!(covariance.iter().all(|x| x.is_finite()), "the covariance of {keys:?} is not finite");
        }
    }

    /// Solves the whole graph as one batch.
    fn finish(&mut self) {
        self.session.cost();
        self.session.rejections();
        if let Ok(finished) = self.session.finish(&GaussNewton::default(), &mut third()) {
            is_finite(&finished.values);
        }
    }

    fn bits(&self) -> Vec<(Key, Vec<u64>)> {
        bits(&self.session)
    }

    fn key(&self, index: usize) -> Option<Key> {
        self.keys.get(index.checked_rem(self.keys.len())?).cloned()
    }

    fn place(&self, index: usize) -> Option<usize> {
        index.checked_rem(self.ids.len())
    }
}

fn pose([x, y, angle]: [f64; 3]) -> Se2 {
    Se2::new(So2::exp(angle), [x, y].into())
}

/// Returns all estimates as bits.
fn bits(session: &Smoother) -> Vec<(Key, Vec<u64>)> {
    let numbers = |value: &dyn Variable| -> Vec<f64> {
        let value = value.erased().as_any();
        if let Some(point) = value.downcast_ref::<Point2>() {
            return point.0.iter().copied().collect();
        }
        let Some(Se2 { rotation, translation }) = value.downcast_ref::<Se2>() else { return vec![] };
        let (cos, sin) = rotation.cos_sin();
        vec![cos, sin, translation.x, translation.y]
    };
    let bits = |value| numbers(value).into_iter().map(f64::to_bits).collect();
    session.estimates().iter().map(|(key, value)| (key.clone(), bits(value))).collect()
}

/// Returns a saved session without the id of the next factor. A free slot may have held a variable of the
/// failed update.
fn without_ids(saved: &str) -> serde_json::Value {
    let document = saved.split_once('\n').and_then(|(_, json)| serde_json::from_str(json).ok());
    let mut document: serde_json::Value = document.unwrap_or_default();
    document["next_factor"].take();
    for variable in document["variables"].as_array_mut().into_iter().flatten().filter(|v| v["born"].is_null())
    {
        variable["key"].take();
        variable["point"].take();
    }
    document
}
