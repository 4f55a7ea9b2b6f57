//! Variables that leave: their factors are sealed into a linear prior of their neighbours, which keep their linearization
//! points from then on.
//!
//! Points that stay are what makes it consistent: a prior that is evaluated at one point and factors that are linearized at
//! another would tell the estimate of directions that nothing has measured (first estimates; Huang, Mourikis and Roumeliotis,
//! 2008).
use super::Session;
use super::changes::Touched;
use super::parking::Moves;
use crate::error::ChangeError;
use crate::factor_id::FactorId;
use crate::fronts::Overflow;
use crate::report::Report;
use crate::tree::Couplings;
use manifactor_graph::Key;

impl Session {
    /// Has variables leave, at the end of the next [`update`](Self::update): what their factors say of others stays, as a linear
    /// prior, and those others keep their linearization points until they leave as well. Estimates and covariances of what
    /// stays are what they were. Factors that do not count where they are left, as they are not defined there or hang
    /// on something that is parked, are dropped, and the report names them. One that has no factors then leaves nothing behind: another may have
    /// its key.
    ///
    /// # Errors
    /// Where a variable is not there, or gone already. None leaves then.
    pub fn marginalize<K: AsRef<str>>(&mut self, keys: &[K]) -> Result<(), ChangeError> {
        for key in keys.iter().map(AsRef::as_ref) {
            if self.find(key).is_none() {
                return Err(self.no_variable(&Key::from(key)));
            }
        }
        self.pending.leaving.extend(keys.iter().map(|key| Key::from(key.as_ref())));
        Ok(())
    }

    /// Why a key is none of a variable.
    pub(super) fn no_variable(&self, key: &Key) -> ChangeError {
        match self.gone.contains(key.as_str()) {
            true => ChangeError::Gone { key: key.clone() },
            false => ChangeError::NoVariable { key: key.clone() },
        }
    }

    /// Why an id is none of a factor.
    pub(super) fn no_factor(&self, factor: FactorId) -> ChangeError {
        match self.gone_factors.contains(u64::from(factor.0)) {
            true => ChangeError::GoneFactor { factor },
            false => ChangeError::NoFactor { factor },
        }
    }

    /// Seals what these variables leave behind, one after the other, and solves again.
    pub(super) fn seal(&mut self, leaving: &[u32], report: &mut Report) -> Result<(), Overflow> {
        if leaving.is_empty() {
            return Ok(());
        }
        // what is frozen should not be far off; where it cannot be linearized anew, it stays as it is
        let is_stale = |v: &u32| self.is_out(*v) || self.model.coupled(*v).any(|u| self.is_out(u));
        if leaving.iter().any(is_stale) {
            let _ = self.pass(&Touched::default(), &Moves::default(), true, report);
        }
        let mut touched = Touched::default();
        let is_bare = |v: &u32| self.model.factors_of(&[*v]).is_empty();
        let bare: Vec<u32> = leaving.iter().copied().filter(is_bare).collect();
        for v in leaving {
            self.seal_one(*v, &mut touched, report);
        }
        // those that leave one after the other are each other's neighbours
        let is_there = |session: &Self, v: u32| !leaving.contains(&v) && session.model.place(v).is_there;
        touched.doubtful.retain(|v| is_there(self, *v));
        let moves = self.park(&mut touched);
        let passed = self.pass(&touched, &moves, false, report);
        for v in leaving {
            let key = self.key(*v);
            self.gone.insert(key.as_str(), !bare.contains(v));
            report.sealed.push(key);
            self.forget(*v);
        }
        self.waiting_keys = self.parked.iter().map(|v| self.key(*v)).collect();
        passed
    }

    /// Puts a prior in the place of a variable's factors. It is in the tree until the next pass.
    fn seal_one(&mut self, variable: u32, touched: &mut Touched, report: &mut Report) {
        let mut factors = self.model.factors_of(&[variable]);
        let counts = |f: &u32| self.model.is_whole(*f) && self.model.takes_part(*f);
        let (mut sealed, dropped): (Vec<u32>, Vec<u32>) = factors.iter().partition(|f| counts(f));
        sealed.extend(self.covered(&sealed, variable));
        sealed.sort_unstable();
        let prior = self.model.without(variable, &sealed);
        factors.extend(&sealed);
        factors.sort_unstable();
        factors.dedup();
        for f in factors {
            let Some(factor) = self.model.remove(f) else { continue };
            touched.variables.extend(factor.variables());
            // the numbers of priors too: no one holds them, and the runs have no gaps
            self.gone_factors.insert(u64::from(f));
            self.inactive.remove(&f);
            self.forget_suspect(f);
        }
        touched.variables.push(variable);
        for f in dropped {
            report.dropped.push(FactorId(f));
        }
        self.drop_rejected(variable, report);
        if let Some(prior) = prior {
            self.model.insert_prior(self.model.next_factor(), &prior);
        }
        touched.doubtful.extend(&touched.variables);
        // out of the tree
        self.model.place_mut(variable).parked = true;
    }

    /// Priors of some of the others: they become part of the new one, so that there are no more of them than have to be.
    fn covered(&self, factors: &[u32], variable: u32) -> Vec<u32> {
        let variables = factors.iter().filter_map(|f| self.model.factor(*f)).flat_map(|f| f.variables());
        let mut around: Vec<u32> = variables.collect();
        around.sort_unstable();
        around.dedup();
        let with_priors =
            around.iter().copied().filter(|v| *v != variable && self.model.place(*v).sealed > 0);
        let of_these = self.model.factors_of(&with_priors.collect::<Vec<_>>());
        let is_covered = |f: &u32| {
            let prior = self.model.factor(*f).filter(|factor| factor.entry.is_none());
            prior.is_some_and(|prior| {
                prior.variables().all(|v| v != variable && around.binary_search(&v).is_ok())
            })
        };
        of_these.into_iter().filter(is_covered).collect()
    }

    /// Forgets a variable that is out of the tree.
    fn forget(&mut self, variable: u32) {
        self.delta[self.model.blocks.range(variable)].fill(0.0);
        self.is_waiting[variable as usize] = false;
        for list in [&mut self.waiting, &mut self.urgent, &mut self.doubtful] {
            list.retain(|v| *v != variable);
        }
        self.parked.remove(&variable);
        self.shaken.remove(&variable);
        self.damped.remove(&variable);
        self.model.blocks.damp(variable, 0.0);
        self.model.forget(variable);
    }
}
