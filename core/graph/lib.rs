//! Factor graphs: scalars, manifolds, residuals, noise, losses, keys, values, registration.
