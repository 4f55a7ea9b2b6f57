//! Memory that goes from front to front.

/// Lists that are not in use, by size: eighths of powers of two, so that at most an eighth of a list is wasted.
#[derive(Debug, Default)]
pub(super) struct Pool {
    classes: Vec<Vec<Vec<f64>>>,
    /// Values that wait here, and those that are in use.
    waiting: usize,
    used: usize,
}

/// So many values may wait, or half of those that are in use: more are needed only where everything is made anew.
const WAITING: usize = 1 << 18;

/// The class for so many values, and its size.
fn class(n: usize) -> (usize, usize) {
    let n = n.max(16);
    let shift = (usize::BITS - 4 - n.leading_zeros()) as usize;
    let eighths = n.div_ceil(1 << shift);
    // sixteen eighths are eight of the next power
    let (shift, eighths) = if eighths == 16 { (shift + 1, 8) } else { (shift, eighths) };
    (shift * 8 + eighths - 8, eighths << shift)
}

impl Pool {
    /// At least so many values, with whatever they are.
    pub(super) fn take(&mut self, n: usize) -> Vec<f64> {
        if n == 0 {
            return vec![];
        }
        let (class, size) = class(n);
        self.used += size;
        match self.classes.get_mut(class).and_then(Vec::pop) {
            Some(values) => {
                self.waiting -= size;
                values
            }
            None => vec![0.0; size],
        }
    }

    pub(super) fn give(&mut self, values: Vec<f64>) {
        self.used -= values.len();
        if values.is_empty() || self.waiting + values.len() > WAITING.max(self.used / 2) {
            return;
        }
        self.waiting += values.len();
        let class = class(values.len()).0;
        if self.classes.len() <= class {
            self.classes.resize(class + 1, vec![]);
        }
        self.classes[class].push(values);
    }

    /// Bytes in use, and waiting.
    pub(super) fn bytes(&self) -> usize {
        8 * (self.used + self.waiting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_wastes_an_eighth_at_most_and_gives_back_what_it_took() {
        for n in 16..5000 {
            let (number, size) = class(n);
            assert!(size >= n && 8 * (size - n) <= n, "{n}: {size}");
            assert_eq!(class(size), (number, size), "{n}");
            assert!(class(n + 1).0 >= number);
        }
    }

    #[test]
    fn what_waits_is_capped() {
        let mut pool = Pool::default();
        let many: Vec<_> = (0..100).map(|_| pool.take(1 << 14)).collect();
        many.into_iter().for_each(|values| pool.give(values));
        assert!(pool.bytes() <= 8 * (50 << 14), "half of what was in use");
    }
}
