//! In-place changes of measurements and noise in a compiled problem, as a tracker needs in its loop.
use crate::problem::Problem;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Noise, Residual, Version};
use std::any::type_name;

/// The error for a factor that cannot be changed. The problem is unchanged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemChangeError {
    /// The factor does not exist.
    #[error("there is no factor {factor}: the problem has {factors}, from 0")]
    NoFactor {
        /// The requested factor.
        factor: usize,
        /// Number of factors.
        factors: usize,
    },
    /// The factor has a different type, or a type that leaves the number of rows open.
    #[error("factor {factor} is a {found}, which cannot be changed as `{expected}`")]
    Type {
        /// Index in the graph, from 0.
        factor: usize,
        /// Name of its type.
        found: &'static str,
        /// The requested Rust type.
        expected: &'static str,
    },
    /// The noise does not fit the residual.
    #[error("factor {factor}: {source}")]
    Noise {
        /// Index in the graph, from 0.
        factor: usize,
        /// The error of the noise.
        source: NoiseError,
    },
    /// The noise is of a different kind. Factors with one kind of noise are stored together.
    #[error(
        "factor {factor}: its noise was compiled as another kind (none, `sigma`, `sigmas`, or a matrix); \
         compile the graph again, or give noise of the same kind"
    )]
    NoiseKind {
        /// Index in the graph, from 0.
        factor: usize,
    },
}

impl Problem {
    /// Returns the residual of a factor for modification, for example of its measurement. Nothing is
    /// compiled again; the next solve or query uses the new value. `R` is the type that was added to the
    /// graph.
    ///
    /// The graph stays unchanged, so from now on the problem no longer corresponds to it.
    ///
    /// # Errors
    /// If there is no such factor, or it is not of type `R`.
    pub fn factor_mut<R: Residual>(&mut self, factor: usize) -> Result<&mut R, ProblemChangeError> {
        let factors = self.factors();
        let Some(place) = self.model.factors.get(factor) else {
            return Err(ProblemChangeError::NoFactor { factor, factors });
        };
        let (batch, index, found) = (place.batch as usize, place.index as usize, place.name);
        let of_another_type = ProblemChangeError::Type { factor, found, expected: type_name::<R>() };
        let residual = self.model.batches.get_mut(batch).and_then(|batch| batch.residual_mut(index));
        if residual.is_none_or(|residual| !residual.is::<R>()) {
            return Err(of_another_type);
        }
        self.version = Version::default();
        let residual = self.model.batches_mut()[batch].residual_mut(index);
        residual.and_then(|residual| residual.downcast_mut()).ok_or(of_another_type)
    }

    /// Sets the noise of a factor. Nothing is compiled again; see [`factor_mut`](Self::factor_mut).
    ///
    /// # Errors
    /// If there is no such factor, or the noise does not fit it or is of a different kind than before.
    pub fn set_noise(&mut self, factor: usize, noise: &Noise) -> Result<(), ProblemChangeError> {
        let factors = self.factors();
        let Some(place) = self.model.factors.get(factor) else {
            return Err(ProblemChangeError::NoFactor { factor, factors });
        };
        let whitener = noise
            .whitener(place.all_rows as usize)
            .map_err(|source| ProblemChangeError::Noise { factor, source })?;
        let (batch, index) = (place.batch as usize, place.index as usize);
        if !self.model.batches_mut()[batch].set_noise(index, &whitener) {
            return Err(ProblemChangeError::NoiseKind { factor });
        }
        self.model.factors[factor].observe(noise);
        self.version = Version::default();
        Ok(())
    }
}
