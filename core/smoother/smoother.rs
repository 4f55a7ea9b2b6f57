//! The smoother: its state and its estimate.
mod changes;
mod factorization;
mod finish;
mod marginalization;
mod outliers;
mod queue;
mod relinearization;
mod saving;
mod schedule;
mod step_control;
mod steps;
mod undetermined;
mod update;

use crate::elimination_tree::Couplings;
use crate::fronts::Scalar;
use crate::model::Model;
use crate::report::UpdateReport;
use crate::settings::SmootherSettings;
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

pub use factorization::SmootherCovarianceError;
pub use finish::Finished;

/// A factor graph that grows while it is solved. See the [crate](crate).
///
/// Changes are checked when they are requested, and applied by the next [`update`](Self::update). The
/// estimate of a variable is its linearization point, moved by a step δ that the factorization gives.
pub struct Smoother {
    schedule: Schedule,
    model: Model,
    factorization: Factorization,
    steps: Steps,
    pending: Pending,
    queue: RelinearizationQueue,
    undetermined: Undetermined,
    candidates: OutlierCandidates,
}

impl fmt::Debug for Smoother {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Smoother({} variables, {} updates)", self.variables(), self.schedule.updates())
    }
}

impl Smoother {
    /// Creates an empty smoother.
    pub fn new(settings: SmootherSettings) -> Self {
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

    /// Returns the estimate of a variable, as of the last update; `None` if there is no such variable. O(1).
    pub fn estimate(&self, key: &str) -> Option<Box<dyn Variable>> {
        let variable = self.model.variable(key)?;
        let point = self.model.point(variable)?;
        point.erased().retract(self.steps.of(&self.model, variable))
    }

    /// Returns the estimate of a variable as a value of type `M`, as of the last update.
    ///
    /// # Errors
    /// If there is no such variable, or it has a different type.
    pub fn get<M: Variable + Clone + 'static>(&self, key: &str) -> Result<M, ValueError> {
        let value = self.estimate(key).ok_or_else(|| ValueError::Missing { key: key.into() })?;
        let found = value.erased().as_any().downcast_ref::<M>();
        found.cloned().ok_or_else(|| ValueError::WrongType {
            key: key.into(),
            expected: manifold_name(TypeId::of::<M>()),
            found: value.typetag_name(),
        })
    }

    /// Returns all estimates, in the order in which the variables were added.
    pub fn estimates(&self) -> Values {
        let mut values = Values::new();
        for v in self.model.by_age() {
            let key = &self.model.record(v).key;
            if let Some(value) = self.estimate(key.as_str()) {
                values.insert_boxed(key.clone(), value);
            }
        }
        values
    }

    /// Returns the number of variables, including undetermined and held ones.
    pub fn variables(&self) -> usize {
        self.model.present()
    }

    /// Returns the cost ½ Σ ρ at the estimate.
    ///
    /// It includes the factors that took part in their last linearization and have no undetermined variable,
    /// and the linear priors of marginalized variables. It evaluates every factor.
    pub fn cost(&mut self) -> f64 {
        let factors: Vec<u32> = self.counted().chain(self.model.priors()).collect();
        self.steps.cost_of(&mut self.model, &factors).cost
    }

    /// Returns the factors that count: they are not rejected and have no undetermined variable.
    fn counted(&self) -> impl Iterator<Item = u32> {
        self.model.all_factors().map(|(f, ..)| f).filter(|f| self.model.is_whole(*f))
    }

    /// Returns the joint covariance of a few variables, in the units of the noise. Rows and columns follow
    /// `keys` and their tangent directions. Held directions have zeros. The covariance is taken at the last
    /// linearization points, including robust weights.
    ///
    /// # Errors
    /// If a variable does not exist or is undetermined, if it depends on an undetermined direction, or if a
    /// covariance overflows.
    pub fn covariance(&self, keys: &[&str]) -> Result<DMatrix<f64>, SmootherCovarianceError> {
        let mut variables = vec![];
        for key in keys {
            let missing = || SmootherCovarianceError::NoVariable { key: Key::from(*key) };
            variables.push(self.model.variable(key).ok_or_else(missing)?);
        }
        self.factorization.covariance(&self.model, &variables)
    }

    /// Returns the size of the factorization in bytes.
    pub fn bytes(&self) -> usize {
        self.factorization.bytes()
    }

    fn dim(&self, variable: u32) -> usize {
        self.model.dim(variable)
    }

    fn key(&self, variable: u32) -> Key {
        self.model.record(variable).key.clone()
    }

    /// Adds undetermined variables, undetermined directions, and the numbers of inactive factors and
    /// postponed variables to a report.
    fn fill_report(&mut self, report: &mut UpdateReport) {
        report.undetermined_variables = self.undetermined.list_undetermined(&mut self.model);
        let name = |(v, d): Scalar| Some((self.key(v), *self.model.record(v).tangent.get(d as usize)?));
        report.undetermined_directions =
            self.factorization.undetermined_directions().filter_map(name).collect();
        report.inactive = self.undetermined.inactive();
        report.postponed = self.queue.postponed();
    }
}
