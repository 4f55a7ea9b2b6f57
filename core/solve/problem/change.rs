//! Measurements and noise of a compiled problem, changed in place: the loop of a tracker.
use crate::problem::Problem;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Noise, Residual, Version};
use std::any::type_name;

/// Why a factor of a compiled problem cannot be changed. The problem is as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChangeError {
    /// A factor that is not there.
    #[error("there is no factor {factor}: the problem has {factors}, from 0")]
    NoFactor {
        /// What was asked for.
        factor: usize,
        /// How many there are.
        factors: usize,
    },
    /// A factor of another type, or one whose number of rows is its own.
    #[error("factor {factor} is a {found}, which cannot be changed as `{expected}`")]
    Type {
        /// Its place in the graph, from 0.
        factor: usize,
        /// Its type's name.
        found: &'static str,
        /// The Rust type that it was taken for.
        expected: &'static str,
    },
    /// Noise that does not fit the residual.
    #[error("factor {factor}: {source}")]
    Noise {
        /// Its place in the graph, from 0.
        factor: usize,
        /// What is wrong.
        source: NoiseError,
    },
    /// Noise of another kind: factors with the same kind of noise are stored together.
    #[error(
        "factor {factor}: its noise was compiled as another kind (none, `sigma`, `sigmas`, or a matrix); \
         compile the graph again, or give noise of the same kind"
    )]
    NoiseKind {
        /// Its place in the graph, from 0.
        factor: usize,
    },
}

impl Problem {
    /// The residual of a factor, to be changed: its measurement, say. Nothing is compiled again; the next solve or
    /// question takes it as it is. `R` is the type that was added to the graph.
    ///
    /// The graph keeps what it has: from now on the problem answers for itself, and not for that graph.
    ///
    /// # Errors
    /// If there is no such factor, or it is no `R`.
    pub fn factor_mut<R: Residual>(&mut self, factor: usize) -> Result<&mut R, ChangeError> {
        let factors = self.factors();
        let Some(place) = self.model.factors.get(factor) else {
            return Err(ChangeError::NoFactor { factor, factors });
        };
        let (batch, index, found) = (place.batch as usize, place.index as usize, place.name);
        let of_another_type = ChangeError::Type { factor, found, expected: type_name::<R>() };
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
    /// If there is no such factor, or the noise does not fit it or is of another kind than before.
    pub fn set_noise(&mut self, factor: usize, noise: &Noise) -> Result<(), ChangeError> {
        let factors = self.factors();
        let Some(place) = self.model.factors.get(factor) else {
            return Err(ChangeError::NoFactor { factor, factors });
        };
        let whitener = noise
            .whitener(place.all_rows as usize)
            .map_err(|source| ChangeError::Noise { factor, source })?;
        let (batch, index) = (place.batch as usize, place.index as usize);
        if !self.model.batches_mut()[batch].set_noise(index, &whitener) {
            return Err(ChangeError::NoiseKind { factor });
        }
        self.model.factors[factor].observe(noise);
        self.version = Version::default();
        Ok(())
    }
}
