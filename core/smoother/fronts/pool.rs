//! Memory that is reused between fronts.

/// Free lists by size class. Classes are eighths of powers of two, so at most an eighth of a list is wasted.
#[derive(Debug, Default)]
pub(super) struct Pool {
    classes: Vec<Vec<Vec<f64>>>,
    /// Number of free values (`waiting`) and of values in use (`used`).
    waiting: usize,
    used: usize,
}

/// Largest number of free values, or half of the values in use if that is more. Only an update that rebuilds
/// everything needs more.
const MAX_FREE_VALUES: usize = 1 << 18;

/// Returns the class for `n` values, and its size.
fn class(n: usize) -> (usize, usize) {
    let n = n.max(16);
    let shift = (usize::BITS - 4 - n.leading_zeros()) as usize;
    let eighths = n.div_ceil(1 << shift);
    // sixteen eighths are eight eighths of the next power
    let (shift, eighths) = if eighths == 16 { (shift + 1, 8) } else { (shift, eighths) };
    (shift * 8 + eighths - 8, eighths << shift)
}

impl Pool {
    /// Returns a list of at least `n` values with undefined content.
    pub(super) fn acquire(&mut self, n: usize) -> Vec<f64> {
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

    pub(super) fn release(&mut self, values: Vec<f64>) {
        self.used -= values.len();
        if values.is_empty() || self.waiting + values.len() > MAX_FREE_VALUES.max(self.used / 2) {
            return;
        }
        self.waiting += values.len();
        let class = class(values.len()).0;
        if self.classes.len() <= class {
            self.classes.resize(class + 1, vec![]);
        }
        self.classes[class].push(values);
    }

    /// Returns the bytes in use and in free lists.
    pub(super) fn bytes(&self) -> usize {
        8 * (self.used + self.waiting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_wastes_an_eighth_at_most_and_releases_all_it_acquired() {
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
        let many: Vec<_> = (0..100).map(|_| pool.acquire(1 << 14)).collect();
        many.into_iter().for_each(|values| pool.release(values));
        assert!(pool.bytes() <= 8 * (50 << 14), "half of what was in use");
    }
}
