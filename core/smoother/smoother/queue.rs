//! The queue of variables for relinearization.

/// Variables to examine at the next turn. They have left the region of their linearization, or moved in a
/// graph with robust losses.
#[derive(Debug, Default)]
pub(super) struct RelinearizationQueue {
    /// Without duplicates.
    waiting: Vec<u32>,
    /// Membership in `waiting`, by variable.
    is_waiting: Vec<bool>,
    /// Variables that may be too far out to wait. Some may be back within their regions, or occur twice.
    urgent: Vec<u32>,
    /// Number of waiting variables that the budget has postponed.
    postponed: usize,
}

impl RelinearizationQueue {
    /// Makes room for `variables` variables.
    pub(super) fn resize(&mut self, variables: usize) {
        self.is_waiting.resize(variables, false);
    }

    /// Returns the waiting variables, in the order of their insertion.
    pub(super) fn waiting(&self) -> &[u32] {
        &self.waiting
    }

    /// Returns the variables that may not be able to wait.
    pub(super) fn urgent(&self) -> &[u32] {
        &self.urgent
    }

    /// Returns the number of variables that the budget has postponed.
    pub(super) fn postponed(&self) -> usize {
        self.postponed
    }

    /// Sets the number of variables that the budget has postponed.
    pub(super) fn set_postponed(&mut self, postponed: usize) {
        self.postponed = postponed;
    }

    /// Adds a variable, unless it is already waiting.
    pub(super) fn push(&mut self, variable: u32) {
        if !std::mem::replace(&mut self.is_waiting[variable as usize], true) {
            self.waiting.push(variable);
        }
    }

    /// Adds a variable that cannot wait for its turn.
    pub(super) fn push_urgent(&mut self, variable: u32) {
        self.urgent.push(variable);
    }

    /// Removes variables that can wait. Returns whether any remain.
    pub(super) fn retain_urgent(&mut self, is_urgent: impl Fn(u32) -> bool) -> bool {
        self.urgent.retain(|v| is_urgent(*v));
        self.urgent.sort_unstable();
        self.urgent.dedup();
        !self.urgent.is_empty()
    }

    /// Removes relinearized variables. After a turn, only variables of `out`, which ascend, still wait.
    pub(super) fn relinearized(&mut self, variables: &[u32], out: Option<&[u32]>) {
        variables.iter().for_each(|v| self.is_waiting[*v as usize] = false);
        if out.is_none() && variables.is_empty() {
            return;
        }
        let Self { waiting, is_waiting, .. } = self;
        waiting.retain(|v| {
            let is_out = out.is_none_or(|out| out.binary_search(v).is_ok());
            let stays = is_waiting[*v as usize] && is_out;
            is_waiting[*v as usize] = stays;
            stays
        });
    }

    /// Forgets a variable.
    pub(super) fn forget(&mut self, variable: u32) {
        self.is_waiting[variable as usize] = false;
        self.waiting.retain(|v| *v != variable);
        self.urgent.retain(|v| *v != variable);
    }

    /// Restores a saved queue. Its variables are below `variables`.
    pub(super) fn load(mut waiting: Vec<u32>, urgent: Vec<u32>, postponed: usize, variables: usize) -> Self {
        waiting.dedup();
        let mut is_waiting = vec![false; variables];
        waiting.iter().for_each(|v| is_waiting[*v as usize] = true);
        Self { waiting, is_waiting, urgent, postponed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn queue() -> RelinearizationQueue {
        let mut queue = RelinearizationQueue::default();
        queue.resize(6);
        [4, 1, 4, 3].into_iter().for_each(|v| queue.push(v));
        queue
    }

    #[test]
    fn a_variable_waits_once_and_until_it_is_relinearized() {
        let mut queue = queue();
        assert_eq!(queue.waiting(), [4, 1, 3]);
        queue.relinearized(&[], None);
        assert_eq!(queue.waiting(), [4, 1, 3]);
        queue.relinearized(&[1], None);
        assert_eq!(queue.waiting(), [4, 3]);
        queue.push(1);
        assert_eq!(queue.waiting(), [4, 3, 1]);
    }

    #[test]
    fn after_a_turn_only_variables_out_of_their_regions_wait() {
        let mut queue = queue();
        queue.relinearized(&[3], Some(&[3, 4]));
        assert_eq!(queue.waiting(), [4]);
        queue.push(1);
        queue.forget(4);
        assert_eq!(queue.waiting(), [1]);
    }

    #[test]
    fn urgent_variables_are_sorted_and_examined_again() {
        let mut queue = queue();
        [5, 2, 5, 3].into_iter().for_each(|v| queue.push_urgent(v));
        assert!(queue.retain_urgent(|v| v != 3));
        assert_eq!(queue.urgent(), [2, 5]);
        assert!(!queue.retain_urgent(|_| false));
    }
}
