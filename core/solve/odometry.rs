//! Odometry among the factors of a graph: the rule of batch, smoother and replay.
//!
//! A factor is odometry if its variables are neighbours ([`is_sequential`]) and no other factor connects the same variables. If several
//! do, at most one is odometry, and any may be a wrong loop closure. [`Gnc`](crate::Gnc) sees all factors at once and then trusts none
//! of them. A smoother and a replay need an odometry factor to initialize the next variable: they take the factor that fits the initial
//! values best ([`best_fit`]).
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Returns whether variables are of one type and consecutive, like the variables of odometry.
///
/// A variable is given by its column, one for each type, and its position among the variables of that type.
pub fn is_sequential(variables: impl IntoIterator<Item = (usize, u64)>) -> bool {
    let variables: SmallVec<[(usize, u64); 4]> = variables.into_iter().collect();
    variables.windows(2).all(|pair| pair[0].0 == pair[1].0 && pair[0].1.abs_diff(pair[1].1) == 1)
}

/// Returns the factors by the variables that they connect, in ascending order of the variables. Factors of a single variable are left
/// out. A key is a list of variables, such as a `Vec` or a `SmallVec`.
pub fn by_variables<V: Ord, K: AsMut<[V]> + Ord, F>(
    factors: impl IntoIterator<Item = (K, F)>,
) -> BTreeMap<K, Vec<F>> {
    let mut all: BTreeMap<K, Vec<F>> = BTreeMap::new();
    for (mut variables, factor) in factors {
        if variables.as_mut().len() > 1 {
            variables.as_mut().sort_unstable();
            all.entry(variables).or_default().push(factor);
        }
    }
    all
}

/// Returns the factor with the least `misfit`, the first of equals: of parallel factors, the one that may be odometry.
pub fn best_fit<F>(factors: impl IntoIterator<Item = F>, misfit: impl Fn(&F) -> f64) -> Option<F> {
    let misfits = factors.into_iter().map(|factor| (misfit(&factor), factor));
    misfits.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, factor)| factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_of_one_type_and_consecutive() {
        assert!(is_sequential([(0, 4), (0, 5)]) && is_sequential([(0, 5), (0, 4), (0, 3)]));
        assert!(!is_sequential([(0, 4), (0, 6)]) && !is_sequential([(0, 4), (1, 5)]));
    }

    #[test]
    fn parallel_factors_are_found_in_any_order_of_their_variables() {
        let factors = [(vec![1, 2], 'a'), (vec![2, 1], 'b'), (vec![2, 3], 'c'), (vec![1], 'd')];
        let expected = BTreeMap::from([(vec![1, 2], vec!['a', 'b']), (vec![2, 3], vec!['c'])]);
        assert_eq!(by_variables(factors), expected);
    }

    #[test]
    fn the_best_fit_is_the_first_of_equals_and_never_undefined() {
        let misfits = [f64::NAN, 3.0, 1.0, f64::INFINITY, 1.0];
        assert_eq!(best_fit(0..5, |i| misfits[*i]), Some(2));
        assert_eq!(best_fit(0..0, |_| 0.0), None::<usize>);
    }
}
