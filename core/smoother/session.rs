//! A session: what is known so far, and the estimate.
mod changes;
mod factorization;
mod finish;
mod outliers;
mod queue;
mod relinearization;
mod saving;
mod schedule;
mod sealing;
mod step_control;
mod steps;
mod undetermined;
mod update;

use crate::elimination_tree::Couplings;
use crate::fronts::Scalar;
use crate::model::Model;
use crate::report::Report;
use crate::settings::Settings;
use changes::Pending;
use factorization::Factorization;
use manifactor_graph::{Key, ValueError, Values, Variable, manifold_name};
use nalgebra::DMatrix;
use outliers::OutlierCandidates;
use queue::RelinearizationQueue;
use schedule::Schedule;
use std::any::TypeId;
use std::fmt;
use steps::Steps;
use undetermined::Undetermined;

pub use factorization::CovarianceError;
pub use finish::Finished;

/// A factor graph that grows while it is solved. See the [crate](crate).
///
/// Changes are checked when they are asked for, and made by the next [`update`](Self::update). The estimate of a variable
/// is its linearization point, moved by a step δ that the factorization gives.
pub struct Session {
    schedule: Schedule,
    model: Model,
    factorization: Factorization,
    steps: Steps,
    pending: Pending,
    queue: RelinearizationQueue,
    undetermined: Undetermined,
    candidates: OutlierCandidates,
}

impl fmt::Debug for Session {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Session({} variables, {} updates)", self.variables(), self.schedule.updates())
    }
}

impl Session {
    /// An empty session.
    pub fn new(settings: Settings) -> Self {
        Self {
            schedule: Schedule::new(settings),
            model: Model::default(),
            factorization: Factorization::default(),
            pending: Pending::default(),
            steps: Steps::default(),
            queue: RelinearizationQueue::default(),
            undetermined: Undetermined::default(),
            candidates: OutlierCandidates::default(),
        }
    }

    /// The estimate of a variable, as of the last update; `None` where it is not there. O(1).
    pub fn estimate(&self, key: &str) -> Option<Box<dyn Variable>> {
        let variable = self.model.variable(key)?;
        let point = self.model.point(variable)?;
        point.erased().retract(self.steps.of(&self.model, variable))
    }

    /// The same, of a type that is known.
    ///
    /// # Errors
    /// If there is no such variable, or it has another type.
    pub fn get<M: Variable + Clone + 'static>(&self, key: &str) -> Result<M, ValueError> {
        let value = self.estimate(key).ok_or_else(|| ValueError::Missing { key: key.into() })?;
        let found = value.erased().as_any().downcast_ref::<M>();
        found.cloned().ok_or_else(|| ValueError::WrongType {
            key: key.into(),
            expected: manifold_name(TypeId::of::<M>()),
            found: value.typetag_name(),
        })
    }

    /// All estimates, in the order in which the variables came.
    pub fn estimates(&self) -> Values {
        let mut values = Values::new();
        for v in self.model.by_age() {
            let key = &self.model.place(v).key;
            if let Some(value) = self.estimate(key.as_str()) {
                values.insert_boxed(key.clone(), value);
            }
        }
        values
    }

    /// Number of variables, those that are parked or held among them.
    pub fn variables(&self) -> usize {
        self.model.present()
    }

    /// ½ Σ ρ at the estimate, over all factors that took part where they were last linearized and whose variables are not
    /// parked; of variables that have left, what their linear priors say. It looks at every factor.
    pub fn cost(&mut self) -> f64 {
        let factors: Vec<u32> = self.counted().chain(self.model.priors()).collect();
        self.steps.cost_of(&mut self.model, &factors).cost
    }

    /// The factors that count: none of their variables is parked.
    fn counted(&self) -> impl Iterator<Item = u32> {
        self.model.all_factors().map(|(f, ..)| f).filter(|f| self.model.is_whole(*f))
    }

    /// The joint covariance of a few variables, in the order of `keys` and of their tangent directions, in the units of the
    /// noise; what is held has zeros. It is that of the last linearization points, robust weights included.
    ///
    /// # Errors
    /// If a variable is not there or parked, or something that it hangs on is undetermined; if a covariance is too large for a number.
    pub fn covariance(&self, keys: &[&str]) -> Result<DMatrix<f64>, CovarianceError> {
        let mut variables = vec![];
        for key in keys {
            let missing = || CovarianceError::NoVariable { key: Key::from(*key) };
            variables.push(self.model.variable(key).ok_or_else(missing)?);
        }
        self.factorization.covariance(&self.model, &variables)
    }

    /// Bytes of the factorization.
    pub fn bytes(&self) -> usize {
        self.factorization.bytes()
    }

    fn dim(&self, variable: u32) -> usize {
        self.model.dim(variable)
    }

    fn key(&self, variable: u32) -> Key {
        self.model.place(variable).key.clone()
    }

    /// Parked, undetermined and inactive variables and factors, for a report.
    fn tell(&mut self, report: &mut Report) {
        report.parked = self.undetermined.list_parked(&mut self.model);
        let name = |(v, d): Scalar| Some((self.key(v), *self.model.place(v).tangent.get(d as usize)?));
        report.undetermined = self.factorization.open().filter_map(name).collect();
        report.inactive = self.undetermined.inactive();
        report.postponed = self.queue.postponed();
    }
}
